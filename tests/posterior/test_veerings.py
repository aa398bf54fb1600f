"""Labels near a veering: in doubt where they may be the neighbour's, sure where it makes no difference."""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any

import made_boards
import numpy as np
import pytest
import ritz
from scipy import stats
from scipy.optimize import minimize
from validation.calibration.sbc import random_lines
from validation.calibration.truths import Design, draw_truth, make_problem

from bayesplate.board.prior import load_prior
from bayesplate.posterior.assessment import labels_contradicted
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.veerings import contradicted_labels, with_veering_doubts

AT_THE_VEERING, BESIDE_IT = 0.0632, 0.08
"""E_y / E_x at which (2,0) and (0,2), of one class, have half of each other's shape; and where they have little."""
FIRST, SECOND = (2, 0), (0, 2)
LABELS = ((1, 1), FIRST, SECOND, (2, 1), (1, 2), (3, 0), (2, 2))
EXCHANGED = 71
"""A simulation of the calibration whose estimate lies on the other side of a veering than its truth."""


@cache
def plate(ratio: float) -> tuple[ritz.Plate, dict[tuple[int, int], float]]:
    """A free plate, and its frequencies by the shapes."""
    material = 11e9, ratio * 11e9, 0.67e9, 0.4
    made = ritz.Plate.from_moduli(*material, rho=406.0, h=2.8e-3, L_x=0.36, L_y=0.18, edges=ritz.ALL_FREE)
    return made, dict(ritz.simulate(made, LABELS))


@cache
def posed(ratio: float, **how: Any) -> PosedProblem:
    """A board whose modes were read, but for one that is `left_out`; one may be `misread`, a label and a factor."""
    made, hertz = plate(ratio)
    read = {label: f for label, f in hertz.items() if label != how.get("left_out")}
    label, factor = how.get("misread", (FIRST, 1.0))
    read[label] *= factor
    board = made_boards.board_of(made, [made_boards.setup_of(ritz.ALL_FREE, read)])
    return pose(board, load_prior("weakly-informative"), law=how.get("law"))


def in_doubt(problem: PosedProblem) -> dict[tuple[int, int], float]:
    readings = (reading for setup in problem.board.setups for reading in setup.readings)
    return {tuple(one.stated or one.label): one.confidence for one in readings if not one.is_sure}


DOUBTS = {
    "both were read in their order": (AT_THE_VEERING, {}, []),
    "one of two at a veering": (AT_THE_VEERING, {"left_out": SECOND}, [FIRST]),
    "under the exact law": (AT_THE_VEERING, {"left_out": SECOND, "law": "exact"}, [FIRST]),
    "a law that was asked for follows the shapes": (AT_THE_VEERING, {"left_out": SECOND, "law": "linear"}, []),
    "beside the veering": (BESIDE_IT, {"left_out": SECOND}, []),
}
"""E_y / E_x, what was read and under which law, and the labels in doubt."""


@pytest.mark.parametrize("case", DOUBTS)
def test_a_label_at_a_veering_is_in_doubt_and_told_where_it_makes_a_difference(case):
    """None where both modes were read: which of the two shapes is called which changes nothing."""
    ratio, how, doubted = DOUBTS[case]
    problem = posed(ratio, **how)

    assert list(in_doubt(problem)) == doubted
    assert len(problem.veerings) == len(doubted)
    assert "law" in how or problem.posterior.law == "linear"
    for confidence in in_doubt(problem).values():
        assert 0.5 < confidence < 0.95
        told = f"(2,0) {100 * confidence:.0f} % (its shape mixes with that of (0,2))"
        assert any(told in sentence for sentence in problem.doubts)


@pytest.mark.parametrize(
    "how",
    [{"misread": ((2, 1), 2.0)}, pytest.param({"misread": ((2, 1), 10.0), "left_out": SECOND}, marks=pytest.mark.slow)],
)
def test_a_misread_frequency_puts_no_label_in_doubt(how):
    """It makes the estimate wrong, and the plates that look plausible with it; what is misread is told instead."""
    problem = posed(AT_THE_VEERING, **how)

    assert in_doubt(problem) == {}
    assert any("the readings scatter about the fitted plate" in sentence for sentence in problem.doubts)


@pytest.mark.slow
def test_a_truth_on_the_other_side_of_the_veering_is_as_likely_as_it_should_be(monkeypatch):
    """Twice the log of the greatest density over that of the truth is a chi-square.

    Of a plate a tenth stiffer it is none, nor of the truth where the labels of the estimate are taken for sure.
    """
    design = Design(edges="both")
    truth = draw_truth(design, random_lines(design.base_seed, EXCHANGED)[0])
    doubted = make_problem(design, truth)
    monkeypatch.setattr("bayesplate.posterior.posing.with_veering_doubts", lambda board, *_: (board, ()))
    sure = make_problem(design, truth)

    def distance(problem: PosedProblem, stiffer: float = 0.0) -> float:
        theta = truth.theta(problem)
        theta[:, 0] += stiffer
        at_truth = float(problem.posterior(theta)[0])
        best = minimize(
            lambda x: -float(problem.posterior(x[None])[0]),
            problem.centre,
            method="Nelder-Mead",
            options={"maxfev": 150},  # what it leaves to be found makes no distance larger
        )
        return 2.0 * (max(-best.fun, at_truth) - at_truth)

    limit = stats.chi2.ppf(0.999, doubted.parameters.n_dim)
    assert set(in_doubt(doubted)) == {FIRST, SECOND, (3, 1)}
    assert in_doubt(sure) == {}
    assert distance(doubted) < limit < distance(doubted, np.log(1.1))
    assert limit < distance(sure)


def named_apart(ranks: dict[tuple[int, int], list[int]], hertz: dict[tuple[int, int], float], ends_y=("free", "free")):
    """The confidences where products of beam functions name these ranks: at the estimate, then at other plates."""
    ends = {"x0": "free", "x1": "free", "y0": ends_y[0], "y1": ends_y[1]}
    board = made_boards.board_of(plate(BESIDE_IT)[0], [made_boards.setup_of(ends, hertz)])
    every = {beams: np.array(one) for beams, one in ranks.items()}
    model: Any = SimpleNamespace(
        setup=board.setups[0],
        exact=SimpleNamespace(reduced=SimpleNamespace(ranks=lambda *_: every)),
        system=SimpleNamespace(weights=lambda _: None),
    )
    found, _ = with_veering_doubts(board, [model], {})
    return {one.beams: one.confidence for one in found.setups[0].readings if not one.is_sure}


def test_the_confidence_is_the_share_of_plates_that_agree():
    """One draw is no plate, and counts for neither."""
    ranks = {(2, 0): [0, 0, -1, 0, 1, 1], (0, 2): [1, 1, -1, 1, 0, 2], (2, 2): [2, 2, -1, 2, 2, 0]}
    assert named_apart(ranks, {(2, 0): 100.0}) == {(2, 0): pytest.approx(3 / 5)}


EXCHANGES = {(2, 0): [0, 0, 1, 0], (0, 2): [1, 1, 0, 1]}


@pytest.mark.parametrize(
    ("hertz", "n_doubted"),
    [
        ({(2, 0): 100.0, (0, 2): 101.0}, 0),
        ({(2, 0): 100.0, (0, 2): 100.0}, 0),
        ({(2, 0): 101.0, (0, 2): 100.0}, 2),
        ({(2, 0): 100.0}, 1),
        ({(0, 2): 100.0}, 1),
    ],
)
def test_two_readings_are_in_doubt_where_their_order_is_not_that_of_the_modes(hertz, n_doubted):
    assert len(named_apart(EXCHANGES, hertz)) == n_doubted


def test_modes_of_different_classes_cross_and_leave_labels_sure():
    """(1,2) is odd along x, (2,2) even: they hardly mix. Along y nothing is even where the edges differ."""
    crossing = {(2, 2): [0, 1], (1, 2): [1, 0]}
    assert named_apart(crossing, {(2, 2): 100.0}) == {}
    clamped = {(2, 2): [0, 1], (2, 1): [1, 0]}
    assert named_apart(clamped, {(2, 2): 100.0}) == {}
    assert named_apart(clamped, {(2, 2): 100.0}, ("clamped", "free")) == {(2, 2): 0.5}


def draws_beyond(problem: PosedProblem, n_draws: int, n_beyond: int) -> np.ndarray:
    """Draws of a plate, the last ones far on the other side of the veering: E_y there is half as large."""
    theta = np.tile(problem.centre, (n_draws, 1))
    theta[n_draws - n_beyond :, 1] -= np.log(2.0)
    return theta


@pytest.mark.parametrize(("n_beyond", "is_told"), [(0, False), (37, False), (38, True), (40, True)])
def test_labels_are_contradicted_where_nearly_all_plates_have_each_others_figures(n_beyond, is_told):
    problem = posed(BESIDE_IT, law="exact")
    values = problem.parameters.values(draws_beyond(problem, 40, n_beyond))
    told = contradicted_labels(problem.posterior.models, values)

    assert len(told) == is_told
    for sentence in told:
        _, hertz = plate(BESIDE_IT)
        assert f"{hertz[FIRST]:.5g} Hz, read as (2,0), has that of (0,2)" in sentence
        assert f"{hertz[SECOND]:.5g} Hz, read as (0,2), has that of (2,0)" in sentence
        assert sentence.count("read as") == 2


def test_figures_that_are_half_of_each_others_contradict_no_label():
    """Just beyond the veering, where which is which cannot be told."""
    problem = posed(BESIDE_IT, law="exact")
    theta = np.tile(problem.centre, (5, 1))
    theta[:, 1] += np.log((AT_THE_VEERING - 0.001) / BESIDE_IT)
    values = problem.parameters.values(theta)
    model = problem.posterior.models[0]
    ranks = model.exact.reduced.ranks(model.system.weights(values))

    assert np.all(ranks[FIRST] > ranks[SECOND])
    assert contradicted_labels(problem.posterior.models, values) == ()


def test_a_label_in_doubt_is_not_contradicted():
    problem = posed(AT_THE_VEERING, left_out=SECOND, law="exact")
    values = problem.parameters.values(draws_beyond(problem, 5, 5))

    assert list(in_doubt(problem)) == [FIRST]
    assert contradicted_labels(problem.posterior.models, values) == ()


@pytest.mark.parametrize(("law", "n_told"), [("exact", 1), ("linear", 0)])
def test_a_fit_tells_of_them_under_the_law_whose_labels_are_ranks(law, n_told):
    problem = posed(BESIDE_IT, law=law)
    draws: Any = SimpleNamespace(problem=problem, flat=draws_beyond(problem, 1000, 1000))

    assert len(labels_contradicted(draws)) == n_told
