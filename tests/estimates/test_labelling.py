"""Labels given to likely peaks: from the least probability on, and nothing is solved again for them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import FREE_LABELS, board_of, peaks_of, setup_of

from bayesplate.estimates.labelling import label_likely_peaks
from bayesplate.frequencies.model import setup_model, with_other_modes
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
    model = with_other_modes(setup_model(system_of(BOARD, SETUP), VALUES), VALUES)
    return model, PeakLikelihood.of(model)


def test_labels_are_given_from_the_least_probability_on(likelihood):
    model, peaks = likelihood
    shares = np.zeros(peaks.log_prior.shape)
    names = [str(label) for label in peaks.labels]
    order = [int(i) for i in peaks.unlabelled]
    shares[order.index(0), names.index("(2,2)")] = 0.8
    shares[order.index(1), names.index("(3,1)")] = 0.55

    assert [str(one.label) for one in label_likely_peaks(model.setup, peaks, shares, 0.5).readings[4:]] == [
        "(3,1)",
        "(2,2)",
    ]
    assert [str(one.label) for one in label_likely_peaks(model.setup, peaks, shares, 0.6).readings[4:]] == ["(2,2)"]
    assert label_likely_peaks(model.setup, peaks, shares, 0.9).readings == model.setup.readings


def test_a_doubtful_label_that_stays_is_no_other_peaks():
    """Its reading is likelier to be what another label says: neither that label nor its own goes to a bare peak."""
    doubtful = [replace(one, confidence=0.9) for one in SETUP.readings[:2]]
    setup = replace(SETUP, readings=(*doubtful, *SETUP.readings[2:]), peaks=peaks_of(HERTZ[2, 2]))
    model = with_other_modes(setup_model(system_of(BOARD, setup), VALUES), VALUES)
    peaks = PeakLikelihood.of(model)
    first, second = (peaks.labels.index(one.label) for one in doubtful)
    shares = np.zeros(peaks.log_prior.shape)
    shares[list(peaks.readings).index(1), first] = 0.8
    shares[list(peaks.unlabelled).index(0), second] = 0.9

    labels = [one.label for one in label_likely_peaks(setup, peaks, shares, 0.5).readings]
    assert labels == [one.label for one in setup.readings]


def test_labels_that_move_in_a_chain_stay_where_its_end_does():
    """The second is likely what the first says, the first what the third says, and that stays."""
    doubtful = [replace(one, confidence=0.9) for one in SETUP.readings[:3]]
    setup = replace(SETUP, readings=(*doubtful, *SETUP.readings[3:]))
    model = with_other_modes(setup_model(system_of(BOARD, setup), VALUES), VALUES)
    peaks = PeakLikelihood.of(model)
    columns = [peaks.labels.index(one.label) for one in doubtful]
    shares = np.zeros(peaks.log_prior.shape)
    shares[list(peaks.readings).index(1), columns[0]] = 0.8
    shares[list(peaks.readings).index(0), columns[2]] = 0.8
    assert [one.label for one in label_likely_peaks(setup, peaks, shares, 0.5).readings] == [
        o.label for o in setup.readings
    ]

    shares[list(peaks.readings).index(2), columns[1]] = 0.8  # a ring: each has another's
    moved = label_likely_peaks(setup, peaks, shares, 0.5).readings[:3]
    assert [one.label for one in moved] == [doubtful[i].label for i in (2, 0, 1)]
    assert [one.stated for one in moved] == [one.label for one in doubtful]


def test_a_peak_below_all_open_modes_has_one_all_the_same():
    """Above the highest peak, far from it: whoever asks what the peak may be has something to look at."""
    setup = replace(setup_of(ritz.ALL_FREE, {beams: HERTZ[beams] for beams in FREE_LABELS}), peaks=peaks_of(40.0))
    model = with_other_modes(setup_model(system_of(BOARD, setup), VALUES), VALUES)
    assert len(model.other_modes) == 1
    assert np.exp(model.mode_log_frequencies(VALUES, "linear")[0, -1]) > max(HERTZ.values())


def test_a_model_labelled_anew_has_the_same_frequencies(likelihood):
    """Columns change their places; nothing is solved again."""
    model, peaks = likelihood
    shares = np.eye(len(peaks.labels))[[[str(one) for one in peaks.labels].index(name) for name in ("(3,1)", "(2,2)")]]
    setup = label_likely_peaks(model.setup, peaks, shares, 0.5)
    again = model.labelled_as(setup)
    values = {**VALUES, "D_x": 120.0, "D_y": 9.0, "D_s": 26.0}
    before = dict(zip(model.mode_beams, model.mode_log_frequencies(values, "linear")[0], strict=True))
    after = dict(zip(again.mode_beams, again.mode_log_frequencies(values, "linear")[0], strict=True))

    assert after == before
    assert [reading.beams for reading in setup.readings] == list(again.mode_beams[:6])
