"""Labels given to likely peaks: from the least probability on, and nothing is solved again for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import FREE_LABELS, board_of, peaks_of, setup_of

from bayesplate.estimates.labelling import with_labels
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import system_of

PLATE = ritz.FREE_SPRUCE
HERTZ = ritz.simulate(PLATE, FREE_LABELS)
SETUP = replace(
    setup_of(ritz.ALL_FREE, {beams: HERTZ[beams] for beams in FREE_LABELS[:4]}),
    peaks=peaks_of(HERTZ[2, 2], HERTZ[3, 1]),
    missed=0.3,
)
BOARD = board_of(PLATE, [SETUP])
VALUES = {**BOARD.nominal(), "D_x": PLATE.D_x, "D_y": PLATE.D_y, "D_s": PLATE.D_s}


@pytest.fixture(scope="module")
def likelihood():
    model = with_others(setup_model(system_of(BOARD, SETUP), VALUES), VALUES)
    return model, PeakLikelihood.of(model)


def test_labels_are_given_from_the_least_probability_on(likelihood):
    model, peaks = likelihood
    shares = np.zeros(peaks.log_prior.shape)
    names = [str(label) for label in peaks.labels]
    order = [int(i) for i in peaks.bare]
    shares[order.index(0), names.index("(2,2)")] = 0.8
    shares[order.index(1), names.index("(3,1)")] = 0.55

    assert [str(one.label) for one in with_labels(model.setup, peaks, shares, 0.5).readings[4:]] == ["(3,1)", "(2,2)"]
    assert [str(one.label) for one in with_labels(model.setup, peaks, shares, 0.6).readings[4:]] == ["(2,2)"]
    assert with_labels(model.setup, peaks, shares, 0.9).readings == model.setup.readings


def test_a_model_labelled_anew_has_the_same_frequencies(likelihood):
    """Columns change their places; nothing is solved again."""
    model, peaks = likelihood
    shares = np.eye(len(peaks.labels))[[[str(one) for one in peaks.labels].index(name) for name in ("(3,1)", "(2,2)")]]
    setup = with_labels(model.setup, peaks, shares, 0.5)
    again = model.labelled_as(setup)
    values = {**VALUES, "D_x": 120.0, "D_y": 9.0, "D_s": 26.0}
    before = dict(zip(model.every_beams, model.every_log_frequency(values, "linear")[0], strict=True))
    after = dict(zip(again.every_beams, again.every_log_frequency(values, "linear")[0], strict=True))

    assert after == before
    assert [reading.beams for reading in setup.readings] == list(again.every_beams[:6])
