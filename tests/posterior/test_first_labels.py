"""First labels for peaks: those of an independent solver's modes, with labels to begin with, with few, with none."""

from __future__ import annotations

from dataclasses import replace

import pytest
import ritz
from made_boards import board_of, setup_of

from bayesplate.cards import load_prior
from bayesplate.labels import Label
from bayesplate.plate.setup import Peak
from bayesplate.posterior.first_labels import propose_labels
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
