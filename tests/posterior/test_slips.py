"""Slips in single readings: octave, decimal place, exchanged labels are told; honest boards are not."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import made_boards
import numpy as np
import pytest
import ritz
from scipy import stats

from bayesplate.board.board import Board
from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.commands.problem import Problem
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.unusual import odd_reading, unusual_sentences
from bayesplate.posterior import slips
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.slips import LARGE_NOISE, RARITY, Slip, SlipSearch, noise_remarks, reading_remarks

PLATE = ritz.Plate.from_moduli(11e9, 0.95e9, 0.67e9, 0.4, rho=406.0, h=2.8e-3, L_x=0.55, L_y=0.2, edges=ritz.ALL_FREE)
NOISE = 0.003
HERTZ = made_boards.with_noise(
    ritz.simulate(PLATE, made_boards.FREE_LABELS), NOISE, np.random.default_rng(3)
)  # by an independent solver


@cache
def as_read() -> PosedProblem:
    return posed()


@cache
def with_an_octave() -> PosedProblem:
    return posed({(2, 1): 2 * HERTZ[2, 1]})


def posed(changed: dict | None = None, *, robust: bool = False, noise: Quantity | None = None) -> PosedProblem:
    setup = made_boards.setup_of(ritz.ALL_FREE, HERTZ | (changed or {}), noise=noise)
    board = made_boards.board_of(PLATE, [setup])
    return pose(board, load_prior("weakly-informative"), robust=robust)


def told(problem: PosedProblem) -> str:
    slips, others = reading_remarks(problem.posterior, problem.centre)
    return "\n".join((*slips, *others))


STRAYS = {
    "an octave": ((2, 1), 2.0, "an octave, or another mode?"),
    "a stray": ((3, 1), 1.25, "misread, or another mode?"),
    "a stray that leads the fit to another plate": ((0, 2), 1.25, "misread, or another mode?"),
}


@pytest.mark.parametrize("case", STRAYS)
def test_one_wrong_reading_is_named_with_what_the_others_expect(case):
    (m, n), factor, question = STRAYS[case]
    problem = with_an_octave() if case == "an octave" else posed({(m, n): factor * HERTZ[m, n]})
    found = told(problem)
    sentence = found.splitlines()[0]
    stated = int(sentence.split(" cents ")[0].split()[-1])

    assert sentence.startswith(f"({m},{n}) at {factor * HERTZ[m, n]:.5g} Hz is {stated} cents above what")
    assert question in sentence
    # the others' prediction is off by their noise, the reading by its own: about 1.3 noises of 5 cents each
    assert stated == pytest.approx(1200 * np.log2(factor), abs=4 * 1.3 * 5.2)
    assert sentence.endswith("--robust gives it less say")
    assert "do not trust the constants" in found
    assert "in the other order" not in found
    if case.endswith("another plate"):  # from there mending the slip alone leads nowhere
        best = SlipSearch(problem.posterior, problem.centre).likeliest()
        assert best is None or best.readings != (made_boards.FREE_LABELS.index((m, n)),)


@pytest.mark.parametrize(("factor", "kind"), [(10.0, "a decimal place"), (0.5, "an octave"), (1.0, "misread")])
def test_what_a_factor_may_be_is_asked(factor, kind):
    readings = SlipSearch(as_read().posterior, as_read().centre)
    sentence = slips._stray_sentence(readings, Slip((0,), factor, 9.0, np.log(1.25)))
    assert "386 cents above" in sentence
    assert f": {kind}, or another mode?" in sentence


@pytest.mark.parametrize("pair", [((1, 1), (2, 0)), ((2, 0), (0, 2))])
def test_two_exchanged_labels_are_named_with_the_errors_of_both_readings(pair):
    """Of the second pair the fit leads to another plate, where a right pair seems to stand in the wrong order."""
    one, other = pair
    changed = {one: HERTZ[other], other: HERTZ[one]}
    found = told(posed(changed))
    sentence = found.splitlines()[0]

    names = [f"({m},{n}) at {changed[m, n]:.5g} Hz" for m, n in pair]
    assert sentence.startswith(f"{names[0]} and {names[1]} fit far better exchanged")
    assert "have they each other's label?" in sentence
    after, before = (float(text.split()[0]) for text in (sentence.split("exchanged, ")[1], sentence.split("of ")[1]))
    assert after < 3 * 5.2 < 50 < before
    assert "in the other order" not in found


@pytest.mark.parametrize(("factor", "is_told"), [(1.0, False), (2.0, True)])
def test_a_board_with_peaks_is_told_of_too_much_scatter(factor, is_told):
    """No slip is looked for there: the assignments of its peaks say what a label may be."""
    setup = made_boards.setup_of(ritz.ALL_FREE, HERTZ | {(2, 1): factor * HERTZ[2, 1]})
    board = made_boards.board_of(PLATE, [replace(setup, peaks=made_boards.peaks_of(250.0))])
    doubts = pose(board, load_prior("weakly-informative")).doubts

    assert any("do not trust the constants" in sentence for sentence in doubts) is is_told


def test_a_board_without_a_slip_is_told_nothing():
    assert told(as_read()) == ""


def test_a_reading_is_told_from_the_stated_rarity_on(monkeypatch):
    changed = {(3, 1): 1.08 * HERTZ[3, 1]}
    problem = posed(changed)
    slip = SlipSearch(problem.posterior, problem.centre).likeliest()

    assert slip is not None
    assert slip.readings == (made_boards.FREE_LABELS.index((3, 1)),)
    assert slip.log_odds > np.log(RARITY)
    monkeypatch.setattr(slips, "RARITY", 1.01 * np.exp(slip.log_odds))
    assert SlipSearch(problem.posterior, problem.centre).likeliest() is None


def test_of_four_readings_two_close_ones_are_not_exchanged_for_the_others_determine_nothing():
    """Two readings for three constants: no fit, and none is tried."""
    board = Board.from_numbers(
        "square", length_x=0.3, length_y=0.3, thickness=3e-3, density=650.0,
        setups=Setup.from_frequencies({"(1,1)": 83.2, "(2,1)": 189.5, "(1,2)": 189.6, "(0,3)": 251.0}, edges="free"),
    )  # fmt: skip
    problem = pose(Problem.from_card(board).board, load_prior("weakly-informative"))

    assert SlipSearch(problem.posterior, problem.centre)._exchanges([(1, 2)]) == []


def test_what_an_effect_may_do_to_all_readings_is_no_slip_however_well_the_noise_is_known(monkeypatch):
    """Every reading 1.5 % off, a noise of 0.3 % known to 5 %: were that believed, one reading would be blamed."""
    off = np.exp(0.015 * np.random.default_rng(2).standard_normal(len(HERTZ)))
    changed = {label: hertz * factor for (label, hertz), factor in zip(HERTZ.items(), off, strict=True)}
    problem = posed(changed, noise=Quantity.from_median(0.003, 1.05))

    assert SlipSearch(problem.posterior, problem.centre).likeliest() is None
    monkeypatch.setattr(slips, "_READINGS_OF_PRIOR", 200.0)
    assert SlipSearch(problem.posterior, problem.centre).likeliest() is not None


SEVEN_MODES = """
format = 1
name = "seven"
[plate]
length_x_mm = 400
length_y_mm = 150
thickness_mm = 3.0
mass_g = 79.2
[material]
prior = "spruce"
[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
[setup.frequencies_hz]
"(1,1)" = 65.0
"(2,0)" = 96.2
"(2,1)" = 163.9
"(0,2)" = 203.0
"(1,2)" = 238.3
"(3,0)" = 269.0
"(3,1)" = 330.6
"""


def with_slip(read: str = "", slipped: str = "") -> Problem:
    return Problem.from_card(Board.from_text(SEVEN_MODES.replace(read, slipped) if read else SEVEN_MODES, "seven"))


@pytest.mark.parametrize(
    ("read", "slipped", "named"),
    [
        ('"(1,1)" = 65.0', '"(1,1)" = 650', "(1,1) at 650 Hz"),
        ('"(3,0)" = 269.0', '"(3,0)" = 26900', "(3,0) at 26900 Hz"),
    ],
)
def test_a_slip_after_which_the_other_readings_leave_a_pair_wide_open_is_named(read, slipped, named):
    """And one so high that no mesh has its modes."""
    assert named in told(with_slip(read, slipped).posed)


def test_readings_that_fit_best_where_plates_end_are_refused_with_the_odd_one():
    slipped = with_slip('"(0,2)" = 203.0', '"(0,2)" = 20300')
    with pytest.raises(NotIdentifiableError, match=r"without \(0,2\) at 20300 Hz the others fit to 0\.1") as refused:
        pose(slipped.board, slipped.prior)
    assert "fit best where constants are those of no plate" in str(refused.value)


SLIP_IN_WATER = """
format = 1
name = "wet"
[plate]
length_x_mm = 400
length_y_mm = 180
thickness_mm = 3.2
density_kg_m3 = 430
[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
[setup.fluid]
density_kg_m3 = 997
baffle = "none"
[setup.frequencies_hz]
"(1,1)" = 11.02
"(2,0)" = 16.48
"(0,2)" = 0.2927
"(2,1)" = 30.76
"(1,2)" = 39.64
"(3,0)" = 48.73
"(2,2)" = 65.63
"""


def test_a_slip_in_water_that_asks_for_more_modes_than_there_are_is_refused():
    """Shapes without a mass of their own are no modes, so that a class may have fewer than are looked for."""
    wet = Problem.from_card(Board.from_text(SLIP_IN_WATER, "wet"))
    with pytest.raises(NotIdentifiableError, match="no plate comes near the readings"):
        wet.posed  # noqa: B018


@pytest.mark.parametrize(
    ("hertz", "sides", "said"),
    [
        ({"(2,0)": 241.0, "(0,2)": 312.0, "(2,1)": 240.0, "(1,2)": 311.0}, (0.253, 0.114),
         "they fit best where D_s is next to nothing. Does each label belong to its frequency?"),
        ({"(2,0)": 15.5, "(3,0)": 43.0, "(1,1)": 55.0, "(4,0)": 84.0, "(2,1)": 110.0}, (1.0, 0.05),
         "add a mode that bends across the grain"),
    ],
)  # fmt: skip
def test_modes_that_would_tell_a_constant_of_a_usual_board_ask_about_labels(hertz, sides, said):
    """A twisting mode below the one that it twists; a strip that shows nothing across is the control."""
    setup = Setup.from_frequencies(hertz, edges="free")
    board = Board.from_numbers("one", length_x=sides[0], length_y=sides[1], thickness=3e-3, mass=0.041, setups=setup)
    with pytest.raises(NotIdentifiableError, match=re.escape(said)):
        pose(Problem.from_card(board).board, load_prior("weakly-informative"))


def test_no_reading_is_odd_where_none_or_two_are():
    assert odd_reading(with_slip().board) == ""
    two = SEVEN_MODES.replace("65.0", "6500").replace("203.0", "20300")
    assert odd_reading(Board.from_text(two, "seven")) == ""


def test_too_few_readings_show_no_slip():
    labels = [(1, 1), (2, 0), (0, 2), (2, 1)]
    hertz = {label: HERTZ[label] for label in labels} | {(2, 1): 2 * HERTZ[2, 1]}
    board = made_boards.board_of(PLATE, [made_boards.setup_of(ritz.ALL_FREE, hertz)])
    problem = pose(board, load_prior("weakly-informative"))

    assert SlipSearch(problem.posterior, problem.centre).likeliest() is None


@pytest.mark.parametrize(
    ("low", "high", "told_as", "odds"),
    [
        ((3, 1), (2, 2), "stand in the other order than the modes of the fitted plate", "times as probable"),
        ((1, 2), (3, 0), "modes of one kind exchange their shapes", "taken as right with a probability of"),
    ],
)
def test_readings_in_the_other_order_than_the_plate_are_told_with_their_odds(low, high, told_as, odds):
    """Two modes 8 % apart, read as one at a noise of 3 %: past a veering if of one class; otherwise they crossed."""
    middle = np.sqrt(HERTZ[low] * HERTZ[high])
    problem = posed({low: 1.0002 * middle, high: 0.9998 * middle}, noise=Quantity.from_median(0.03, 1.5))
    (sentence,) = (one for one in problem.doubts if told_as in one)

    assert f"({low[0]},{low[1]})" in sentence
    assert f"({high[0]},{high[1]})" in sentence
    assert odds in sentence


def test_a_noise_far_above_its_prior_is_told_and_one_that_is_allowed_is_not():
    board = as_read().board  # a noise of 0.3 %, factor e^0.5

    assert noise_remarks(board, 1.49) == ()
    assert "4.5 %" not in noise_remarks(board, 1.51)[0]
    assert "1.4 % where about 0.3 % is expected" in noise_remarks(board, 1.51)[0]
    second = replace(board.setups[0], name="second")
    (told,) = noise_remarks(replace(board, setups=(board.setups[0], second)), np.array([1.51, 0.0]))
    assert "1.4 % where about 0.3 % is expected in setup" in told
    assert "0.3 % where about 0.3 % is expected in setup second" in told
    sure = with_noise(board, Quantity.from_median(0.003, 1.01))
    assert noise_remarks(sure, np.log(0.99 * LARGE_NOISE)) == ()
    assert noise_remarks(sure, np.log(1.01 * LARGE_NOISE)) != ()


def test_the_noise_of_the_residuals_is_the_root_of_their_mean_square_over_its_median():
    """The prior counts as one reading that scatters as it expects; three constants are fitted."""
    problem = with_an_octave()
    posterior = problem.under("exact").posterior
    ((predicted,),) = posterior.log_frequencies(problem.centre[None, :])
    z = (log_measured(problem.board) - predicted) / problem.board.setups[0].noise.median
    expected = 0.5 * np.log((z @ z + 1.0) / (z.size - 3 + 1))

    assert SlipSearch(posterior, problem.centre).log_widening == pytest.approx(expected, abs=1e-6)
    assert expected > 2.0  # an octave apart is far beyond the noise


def test_constants_are_judged_at_the_centre_and_not_where_least_squares_begin():
    """Uncertain inputs move between the two, as far as a soft core makes a sandwich another board."""
    problem = as_read()
    other = replace(problem.estimate, rigidities=problem.estimate.rigidities * [1.0, 20.0, 1.0])

    assert "is x along the grain?" in unusual_sentences(problem.board, problem.prior, other.rigidities)[0]
    assert replace(problem, estimate=other).doubts == ()


def with_noise(board: Board, noise: Quantity) -> Board:
    return replace(board, setups=tuple(replace(setup, noise=noise) for setup in board.setups))


def test_a_robust_problem_is_posed_where_most_readings_agree():
    """Its centre is that of the board without the wrong reading; the normal one is pulled away."""
    truth = np.log([PLATE.D_x, PLATE.D_y, PLATE.D_s])
    robust, normal = posed({(2, 1): 2 * HERTZ[2, 1]}, robust=True), with_an_octave()
    errors = np.sqrt(np.diagonal(robust.covariance))[:3]

    assert np.all(np.abs(robust.centre[:3] - truth) < 4 * errors)
    assert np.abs(normal.centre[:3] - truth).max() > 0.2 > 4 * errors.max()
    said = told(robust)
    assert "an octave, or another mode?" in said
    assert "--robust" not in said
    assert "do not trust" not in said
    residuals = [SlipSearch(one.posterior, one.centre)._full_fit.residuals for one in (robust, normal)]
    assert residuals[0] == pytest.approx(residuals[1], abs=0.05)  # slips are weighed from where normal errors would be


class Straight:
    """A law whose ln f are linear in the constants."""

    n_constants = 3

    def __init__(self, slopes):
        self.slopes = slopes

    def __call__(self, x):
        return x @ self.slopes.T


def test_what_the_others_predict_for_a_reading_is_as_uncertain_as_it_says(monkeypatch):
    """400 sets of readings under linear laws: the probability of less than was read is uniform.

    Where the density is twice as wide as it should be, it is not.
    """
    monkeypatch.setattr(slips, "_READINGS_OF_PRIOR", 0.0)
    rng, gaps = np.random.default_rng(2), np.linspace(-200.0, 200.0, 20_001) * NOISE
    below, below_wide = [], []
    for _ in range(400):
        law = Straight(rng.normal(size=(9, 3)))
        target = law(rng.normal(size=3)) + NOISE * rng.normal(size=9)
        kept = np.arange(9) != 2
        x = np.linalg.lstsq(law.slopes[kept], target[kept], rcond=None)[0]
        fit = slips._Fit(law, x, target, np.full(9, 2.0 * NOISE))
        for factor, told_below in ((1.0, below), (2.0, below_wide)):
            density = np.exp(fit.log_predictive((2,), gaps[:, None] / factor))
            told_below.append(np.interp(fit.residuals[2], gaps, np.cumsum(density) / density.sum()))
    assert stats.kstest(below, "uniform").pvalue > 1e-3
    assert stats.kstest(below_wide, "uniform").pvalue < 1e-3
