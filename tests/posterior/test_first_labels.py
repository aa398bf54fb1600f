"""First labels for peaks: those of an independent solver's modes, with labels to begin with, with few, with none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import board_of, setup_of, with_noise

from bayesplate.board.board import Board
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.reading import Peak
from bayesplate.commands.prepare import prepare
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.wide_search import Guess
from bayesplate.labels import Label
from bayesplate.posterior import first_labels
from bayesplate.posterior.first_labels import Labelling, choose_labelling, probable_labellings, propose_labels

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


def test_peaks_get_the_labels_of_their_modes():
    rest = [hertz for label, hertz in HERTZ.items() if label not in LABELS[:4]]
    proposed = propose_labels(board_with(LABELS[:4], [*rest, SPURIOUS]), PRIOR).board

    assert labels_of(proposed) == TRUE
    assert proposed.setups[0].unlabelled == (SPURIOUS,)
    assert [one.confidence for one in proposed.setups[0].readings] == [1.0] * 4 + [0.0] * 6


def test_bare_peaks_of_which_one_is_missing_are_labelled_with_probabilities():
    """Seven of the lowest eight modes, with noise, in no order, under the prior of the wood."""
    read = {beams: HERTZ[beams] for beams in LABELS[:8] if beams != (0, 2)}
    hertz = with_noise(read, 0.003, np.random.default_rng(5))
    ways = probable_labellings(board_with((), hertz.values()), PRIOR)
    (best, share), *others = ways

    assert labels_of(best.board) == {round(each, 3): beams for beams, each in hertz.items()}
    assert best.board.setups[0].peaks == ()
    assert share > 0.9
    assert share + sum(one for _, one in others) == pytest.approx(1.0)
    assert [one for _, one in ways] == sorted((one for _, one in ways), reverse=True)


def test_sure_labels_and_too_few_peaks_are_left_as_they_are():
    for board in (board_with(LABELS, ()), board_with((), ALL[:2])):
        assert propose_labels(board, PRIOR).board is board
    assert probable_labellings(board_with((), ALL[:3]), PRIOR) == []
    assert probable_labellings(board_with([(1, 1)], ALL[1:8]), PRIOR) == []


def test_a_doubtful_label_that_is_wrong_is_corrected_and_remembered():
    board = board_with(LABELS, ())
    (setup,) = board.setups
    wrong = [replace(reading, confidence=0.8) for reading in setup.readings]
    wrong[6] = replace(wrong[6], label=Label(2, 3), beams=(2, 3))
    proposed = propose_labels(replace(board, setups=(replace(setup, readings=tuple(wrong)),)), PRIOR).board
    (found,) = proposed.setups

    assert labels_of(proposed) == TRUE
    assert [reading.stated for reading in found.readings] == [None] * 6 + [Label(2, 3)] + [None] * 3


WIDE = load_prior("weakly-informative")


def guess(board, *rigidities):
    """A region of a hundredth about a plate."""
    logs = np.log(rigidities) + 0.01 * np.random.default_rng(0).standard_normal((64, 3))
    return Guess(board.nominal() | dict(zip(RIGIDITIES, map(np.asarray, rigidities), strict=True)), logs, 0.01)


def test_peaks_that_fit_a_plate_with_its_grain_the_other_way_are_refused(monkeypatch):
    """Both plates are told, and the label that decides.

    The other plate bends along y as this one along x: its D_x is D_y (L_x / L_y)^4, and D_y likewise.
    """
    plate = ritz.FREE_SPRUCE
    sides = (plate.L_x / plate.L_y) ** 4
    both = (plate.D_x, plate.D_y, plate.D_s), (plate.D_y * sides, plate.D_x / sides, plate.D_s)
    monkeypatch.setattr(first_labels, "search_widely", lambda board, *_: [guess(board, *one) for one in both])
    with pytest.raises(NotIdentifiableError, match=r"lie far apart, E_x .* or E_x .*%\); the peak at") as told:
        propose_labels(board_with((), ALL[:7]), WIDE)
    assert "(2,0) in the" in str(told.value)
    assert "(0,2) in the" in str(told.value)

    proposed = propose_labels(board_with([(2, 0)], [hertz for hertz in ALL[:7] if hertz != HERTZ[2, 0]]), WIDE)
    apart = np.log(proposed.rigidities / np.array(both[0]))
    assert apart == pytest.approx(0.0, abs=0.004)  # the noise of the card, doubled for a square: the peaks have none
    assert labels_of(proposed.board) == {round(hertz, 3): label for label, hertz in [*HERTZ.items()][:7]}


def way(beams, log_rigidities, log_density, log_density_at_model_error):
    (setup,) = board_with([(2, 0)], ()).setups
    reading = replace(setup.readings[0], label=Label(*beams))
    board = board_of(ritz.FREE_SPRUCE, [replace(setup, readings=(reading,))])
    return Labelling(board, np.array(log_rigidities), log_density, log_density_at_model_error)


HERE = way((2, 0), [4.6, 2.2, 3.2], 10.0, 5.0)


@pytest.mark.parametrize(
    ("other", "is_refused"),
    [
        (way((0, 2), [6.1, 0.7, 3.2], 10.0, 5.0), True),
        (way((0, 2), [6.1, 0.7, 3.2], 0.0, 5.0), True),  # by what the plate may lack it is as good
        (way((0, 2), [6.1, 0.7, 3.2], 10.0, 5.0 + np.log(0.019)), False),
        (way((0, 2), [6.1, 0.7, 3.2], 10.0, 5.0 + np.log(0.022)), True),
        (way((0, 2), [4.6, 2.69, 3.2], 10.0, 5.0), False),
        (way((0, 2), [4.6, 2.71, 3.2], 10.0, 5.0), True),
    ],
)
def test_answers_far_apart_are_refused_where_both_are_possible(other, is_refused):
    if not is_refused:
        assert choose_labelling([other, HERE]) is (HERE if other.is_far_from(HERE) else other)
        return
    with pytest.raises(NotIdentifiableError, match=r"is \((2,0|0,2)\) in the first and"):
        choose_labelling([HERE, other])


def test_a_fit_begins_with_the_way_that_is_probable_whatever_the_plate_lacks(monkeypatch):
    """Not with one far off that a small noise would favour."""
    ways = iter([HERE, way((0, 2), [6.1, 0.7, 3.2], 100.0, -10.0)])
    monkeypatch.setattr(first_labels, "_first_guesses", lambda *_: [None, None])
    monkeypatch.setattr(first_labels, "_assess_labellings", lambda *_: [*ways])
    monkeypatch.setattr(first_labels, "_settle_labels", lambda board, *_: (board, np.ones(3)))
    proposed = propose_labels(board_with([(2, 0)], ALL[3:]), PRIOR)

    assert proposed.rigidities == pytest.approx(np.exp(HERE.log_rigidities))
    assert proposed.spread == pytest.approx(0.0)


@pytest.mark.slow
def test_a_plate_stiffer_across_its_grain_is_an_unlikely_way(monkeypatch):
    """Peaks that fit a plate either way round, under a prior of any solid: all probable unless cards mean the grain."""
    board = board_with((), ALL[:7])
    shares = {way.is_usual: share for way, share in reversed(probable_labellings(board, WIDE))}
    assert shares[True] > 0.9 > 10 * shares[False]
    monkeypatch.setattr(first_labels, "_UNUSUAL_PROBABILITY", 1.0)
    assert {way.is_usual: share for way, share in reversed(probable_labellings(board, WIDE))}[False] > 0.1


FALSE = {49.51: 0.17, 401.91: 0.18, 441.52: 0.46}
"""What else was heard on the measured board below, Hz, and how probably it is no mode."""


def heard(board: Board, doubts: dict[float, float]) -> Board:
    """The twelve lowest peaks of a measured board without their labels, among them some that are hardly modes."""
    (setup,) = board.setups
    hertz = sorted([*setup.measured, *setup.unlabelled, *doubts])[:12]
    peaks = tuple(Peak(Quantity.from_mean(hz, 1e-4 * hz), spurious=doubts.get(hz, 0.005)) for hz in hertz)
    return replace(board, setups=(replace(setup, readings=(), peaks=peaks),))


def test_the_right_plate_is_found_though_another_fits_the_peaks_of_a_real_board_better_by_chance():
    """Spruce 2R, whose residues confirm its labels: with less and less noise a plate of E_x = 50 GPa remains alone."""
    prepared = prepare("spruce-free-2R")
    (setup,) = prepared.board.setups
    known = {float(one.frequency.mean): one.label for one in setup.readings}

    (best, share), *_ = probable_labellings(heard(prepared.board, FALSE), load_prior("weakly-informative"))

    found = {float(one.frequency.mean): one.label for one in best.board.setups[0].readings}
    assert share > 0.9
    assert {hz: label for hz, label in found.items() if hz in known} == {hz: known[hz] for hz in known if hz < 440.0}
    assert not {49.51} & found.keys()
