"""Labels proposed for peaks: those of an independent solver's modes, with labels to begin with, with few, with none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import board_of, setup_of

from bayesplate.cards import load_prior
from bayesplate.estimates.labelling import propose_labels, with_labels
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label
from bayesplate.plate.setup import Peak
from bayesplate.posterior.inference import pose
from bayesplate.quantities import Quantity

LABELS = ((1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (3, 2), (4, 0))
HERTZ = ritz.simulate(ritz.FREE_SPRUCE, LABELS)
SPURIOUS = 330.0
PRIOR = load_prior("spruce")


def board_with(labelled, peaks, noise=0.002):
    setup = setup_of(
        ritz.ALL_FREE, {beams: HERTZ[beams] for beams in labelled}, noise=Quantity.from_median(noise, 1.65)
    )
    setup = replace(setup, peaks=tuple(Peak(Quantity.exact(hertz)) for hertz in peaks), missed=0.3)
    return board_of(ritz.FREE_SPRUCE, [setup])


def labels_of(board):
    (setup,) = board.setups
    return {round(reading.frequency.mean, 3): (reading.label.m, reading.label.n) for reading in setup.readings}


TRUE = {round(hertz, 3): label for label, hertz in HERTZ.items()}
ALL = [*HERTZ.values()]


@pytest.mark.parametrize("n_labelled", [4, 2, 0])
def test_peaks_get_the_labels_of_their_modes(n_labelled):
    labelled = LABELS[:n_labelled]
    rest = [hertz for label, hertz in HERTZ.items() if label not in labelled]
    proposed = propose_labels(board_with(labelled, [*rest, SPURIOUS]), PRIOR).board

    assert labels_of(proposed) == TRUE
    assert proposed.setups[0].unlabelled == (SPURIOUS,)
    assert [one.confidence for one in proposed.setups[0].readings] == [1.0] * n_labelled + [0.0] * (10 - n_labelled)


def test_sure_labels_are_left_as_they_are():
    board = board_with(LABELS, ())
    assert propose_labels(board, PRIOR).board is board


def test_a_doubtful_label_that_is_wrong_is_corrected_and_remembered():
    board = board_with(LABELS, ())
    (setup,) = board.setups
    wrong = [replace(reading, confidence=0.8) for reading in setup.readings]
    wrong[6] = replace(wrong[6], label=Label(2, 3), beams=(2, 3))
    proposed = propose_labels(replace(board, setups=(replace(setup, readings=tuple(wrong)),)), PRIOR).board
    (found,) = proposed.setups

    assert labels_of(proposed) == TRUE
    assert [reading.stated for reading in found.readings] == [None] * 6 + [Label(2, 3)] + [None] * 3


def test_too_few_peaks_get_none():
    board = board_with((), ALL[:2])
    assert propose_labels(board, PRIOR).board is board


@pytest.fixture(scope="module")
def likelihood():
    board = board_with(LABELS[:4], [HERTZ[2, 2], HERTZ[3, 1]])
    values = pose(board_with(LABELS, ()), PRIOR).estimate.values
    model = with_others(setup_model(system_of(board, board.setups[0]), values), values)
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
    values = {**board_with(LABELS, ()).nominal(), "D_x": 120.0, "D_y": 9.0, "D_s": 26.0}
    before = dict(zip(model.every_beams, model.every_log_frequency(values, "linear")[0], strict=True))
    after = dict(zip(again.every_beams, again.every_log_frequency(values, "linear")[0], strict=True))

    assert after == before
    assert [reading.beams for reading in setup.readings] == list(again.every_beams[:6])
