"""Slips in single readings: octave, decimal place, exchanged labels are told; honest boards are not."""

from __future__ import annotations

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
from bayesplate.estimates.least_squares import log_measured
from bayesplate.posterior import slips
from bayesplate.posterior.doubts import LARGE_NOISE, noise_remarks, reading_remarks
from bayesplate.posterior.posing import PosedProblem, pose
from bayesplate.posterior.slips import RARITY, Slip, SlipSearch

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


CASES = {
    "an octave": ({(2, 1): 2 * HERTZ[2, 1]}, "(2,1)", "1200 cents above", "an octave, or another mode?"),
    "a decimal place": ({(2, 1): 0.1 * HERTZ[2, 1]}, "(2,1)", "3986 cents below", "a decimal place, or another mode?"),
    "a stray": ({(3, 1): 1.25 * HERTZ[3, 1]}, "(3,1)", "386 cents above", "misread, or another mode?"),
}


@pytest.mark.parametrize("case", CASES)
def test_one_wrong_reading_is_named_with_what_the_others_expect(case):
    changed, label, gap, question = CASES[case]
    found = told(with_an_octave() if case == "an octave" else posed(changed))
    sentence = found.splitlines()[0]

    assert sentence.startswith(label)
    assert question in sentence
    stated, (_, direction) = int(sentence.split(" cents ")[0].split()[-1]), gap.split(" cents ")
    # the others' prediction is off by their noise, the reading by its own: about 1.3 noises of 5 cents each
    assert stated == pytest.approx(int(gap.split()[0]), abs=4 * 1.3 * 5.2)
    assert f"{stated} cents {direction}" in sentence
    assert sentence.endswith("--robust gives it less say")
    assert "do not trust the constants" in found


def exchanged(one: tuple[int, int], other: tuple[int, int]) -> dict:
    return {one: HERTZ[other], other: HERTZ[one]}


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({(0, 2): 1.25 * HERTZ[0, 2]}, "(0,2) at {:.5g} Hz is "),
        (exchanged((2, 0), (0, 2)), "(2,0) at {:.5g} Hz and (0,2) at "),
    ],
)
def test_a_slip_that_leads_the_fit_to_another_plate_is_named_all_the_same(changed, sentence):
    """From there a right pair seemed to stand in the wrong order, and mending the slip alone leads nowhere."""
    problem = posed(changed)
    found = told(problem)
    assert found.startswith(sentence.format(next(iter(changed.values()))))
    assert "in the other order" not in found
    search = SlipSearch(problem.posterior, problem.centre)
    best = search.likeliest()
    assert best is None or set(best.readings) != {problem.board.setups[0].labels.index(one) for one in changed}


def test_two_exchanged_labels_are_named_with_the_errors_of_both_readings():
    one, other = (2, 0), (1, 1)
    sentence = told(posed({one: HERTZ[other], other: HERTZ[one]})).splitlines()[0]

    assert f"({one[0]},{one[1]}) at" in sentence
    assert f"({other[0]},{other[1]}) at" in sentence
    assert "have they each other's label?" in sentence
    after, before = (float(text.split()[0]) for text in (sentence.split("exchanged, ")[1], sentence.split("of ")[1]))
    assert after < 3 * 5.2 < 50 < before


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


def test_a_slip_has_to_explain_the_readings_after_a_refit_too(monkeypatch):
    problem = with_an_octave()
    readings = SlipSearch(problem.posterior, problem.centre)
    assert readings.likeliest() is not None
    monkeypatch.setattr(SlipSearch, "refitted", lambda self, *_: self.as_read)
    assert readings.likeliest() is None


@pytest.mark.parametrize("seed", [2, 6])
def test_what_an_effect_may_do_to_all_readings_is_no_slip_however_well_the_noise_is_known(seed, monkeypatch):
    """Every reading 1.5 % off, a noise of 0.3 % known to 5 %: were that believed, one reading would be blamed."""
    off = np.exp(0.015 * np.random.default_rng(seed).standard_normal(len(HERTZ)))
    changed = {label: hertz * factor for (label, hertz), factor in zip(HERTZ.items(), off, strict=True)}
    problem = posed(changed, noise=Quantity.from_median(0.003, 1.05))

    assert SlipSearch(problem.posterior, problem.centre).likeliest() is None
    monkeypatch.setattr(slips, "_LEAST_LOG_SD", 0.05)
    assert SlipSearch(problem.posterior, problem.centre).likeliest() is not None


def test_too_few_readings_show_no_slip():
    labels = [(1, 1), (2, 0), (0, 2), (2, 1)]
    hertz = {label: HERTZ[label] for label in labels} | {(2, 1): 2 * HERTZ[2, 1]}
    board = made_boards.board_of(PLATE, [made_boards.setup_of(ritz.ALL_FREE, hertz)])
    problem = pose(board, load_prior("weakly-informative"))

    assert SlipSearch(problem.posterior, problem.centre).likeliest() is None


def test_the_probability_of_the_readings_is_that_of_a_wide_normal_prior():
    """At each noise level against SciPy's multivariate normal with the constants' prior made wide: a constant apart."""
    thickness = Quantity.from_mean(2.8e-3, 0.05e-3)
    setup = made_boards.setup_of(ritz.ALL_FREE, HERTZ)
    problem = pose(made_boards.board_of(PLATE, [setup], thickness=thickness), load_prior("weakly-informative"))
    readings = SlipSearch(problem.posterior, problem.centre)
    fit = readings.as_read
    levels = [0, 12, 30]
    wide = 1e2
    for left_out in ((), (3,)):
        kept = np.setdiff1d(np.arange(8), left_out)
        found = readings._by_noise(fit, left_out)[levels]
        expected = []
        for level in levels:
            prior = np.diag([wide] * 3 + [1.0] * (fit.slopes.shape[1] - 3))
            covariance = np.diag(readings._variances[level][kept]) + fit.slopes[kept] @ prior @ fit.slopes[kept].T
            seen = fit.residuals[kept] + fit.slopes[kept, 3:] @ fit.inputs
            density = stats.multivariate_normal(np.zeros(kept.size), covariance).logpdf(seen)
            expected.append(density + 1.5 * np.log(2 * np.pi * wide) - 0.5 * slips._NOISE_SDS[level] ** 2)
        np.testing.assert_allclose(found, expected, atol=1e-3)


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
    sure = with_noise(board, Quantity.from_median(0.003, 1.01))
    assert noise_remarks(sure, np.log(0.99 * LARGE_NOISE)) == ()
    assert noise_remarks(sure, np.log(1.01 * LARGE_NOISE)) != ()


def with_noise(board: Board, noise: Quantity) -> Board:
    return replace(board, setups=tuple(replace(setup, noise=noise) for setup in board.setups))


def test_a_robust_problem_is_posed_where_most_readings_agree():
    """Its centre is that of the board without the wrong reading; the normal one is pulled away."""
    wrong = {(2, 1): 2 * HERTZ[2, 1]}
    truth = np.log([PLATE.D_x, PLATE.D_y, PLATE.D_s])
    robust, normal = posed(wrong, robust=True), posed(wrong)
    errors = np.sqrt(np.diagonal(robust.covariance))[:3]

    assert np.all(np.abs(robust.centre[:3] - truth) < 4 * errors)
    assert np.abs(normal.centre[:3] - truth).max() > 0.2 > 4 * errors.max()
    assert "an octave, or another mode?" in told(robust)
    assert "--robust" not in told(robust)
    assert "do not trust" not in told(robust)
    residuals = [SlipSearch(one.posterior, one.centre).as_read.residuals for one in (robust, normal)]
    assert residuals[0] == pytest.approx(residuals[1], abs=0.05)  # slips are weighed from where normal errors would be


def test_a_slip_mends_what_was_read():
    target = np.log([10.0, 20.0, 40.0])

    np.testing.assert_allclose(np.exp(Slip((0, 2)).mended(target)), [40.0, 20.0, 10.0])
    np.testing.assert_allclose(np.exp(Slip((1,), 2.0).mended(target)), [10.0, 10.0, 40.0])
    assert (Slip((1,)).left_out, Slip((1,), 2.0).left_out, Slip((0, 1)).left_out) == ((1,), (), ())


@pytest.mark.parametrize("slip", [Slip(()), Slip((9, 12)), Slip((9,), 2.0), Slip((9,)), Slip((0,), 0.1)])
def test_a_board_is_mended_as_its_readings_are(slip):
    """In the second of two setups: the frequencies of `mended`, without those that say nothing; labels and sds stay."""
    free = made_boards.setup_of(
        ritz.ALL_FREE, {label: Quantity.from_mean(hz, 0.01 * hz) for label, hz in HERTZ.items()}
    )
    board = made_boards.board_of(PLATE, [replace(free, name="one"), replace(free, name="two")])
    mended = slip.mended_board(board)
    kept = np.setdiff1d(np.arange(2 * len(HERTZ)), slip.left_out)
    labels = [(setup.name, one.label) for setup in board.setups for one in setup.readings]
    read = [(setup.name, one) for setup in mended.setups for one in setup.readings]
    assert [(name, one.label) for name, one in read] == [labels[i] for i in kept]
    found = [one.frequency for _, one in read]
    np.testing.assert_allclose(np.log([one.mean for one in found]), slip.mended(log_measured(board))[kept], rtol=1e-12)
    assert [one.sd / one.mean for one in found] == pytest.approx([0.01] * len(kept))


def test_a_slip_that_leaves_a_constant_open_is_not_weighed(monkeypatch):
    """A refit may run to where no reading knows a constant any more; then the readings have no probability."""
    search = SlipSearch(as_read().posterior, as_read().centre)
    assert search.disordered() is None
    slip = Slip((0,), 2.0)
    assert np.isfinite(search._refitted_best([slip]).log_odds)
    fit = search.refitted(slip, search.as_read)
    slopes = fit.slopes.copy()
    slopes[:, 2] = 0.0
    monkeypatch.setattr(SlipSearch, "refitted", lambda *_: replace(fit, slopes=slopes))

    assert search._refitted_best([slip]) is None
    assert search.likeliest() is None
