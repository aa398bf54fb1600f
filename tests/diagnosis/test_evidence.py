"""Evidence, and what a fold predicts, against sums over a dense grid and against refits by hand."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from made_searches import NOISE, bare, baseline, ground_of, left_out, one_level, table, with_modes
from scipy.stats import multivariate_normal

from bayesplate.board.parameter import Owner
from bayesplate.diagnosis.folds import log_score, log_score_gains, nested_leave_one_out
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.terms import NoiseGrid, NormalTerms, noise_grid

_REACH, _STEP = 6.0, 1.0
"""Of the grid, in standard deviations.  The trapezoidal sum of a normal density errs by 2 exp(-2 (pi / step)^2) a
dimension, 5.4e-9 here, and what lies beyond the reach is 2e-9 of it: five dimensions stay below 5e-8."""
EXACT = 5e-8


def log_normal(residuals, variances):
    return -0.5 * (residuals**2 / variances + np.log(2.0 * np.pi * variances)).sum(axis=-1)


def by_grid(base, cells, grid, residual, used):
    """Log evidence as a sum of the plain likelihood over constants, place in the cell, inputs, cells and noise levels.

    The grid lies along the axes of each term's least-squares fit; that only places its points.
    """
    y = residual[used]
    X, Z = base.slopes[used], base.input_slopes[used]
    total = 0.0
    for sd, level in zip(grid.sd, grid.weights, strict=True):
        variances = (sd[base.setup_index] ** 2 + base.own_variance)[used]
        for shift, slopes, weight in zip(cells.shift[:, used], cells.slopes[:, used], cells.weights, strict=True):
            columns = np.hstack([X, slopes, Z])
            n_standard = columns.shape[1] - 3
            prior = np.r_[np.zeros(3), np.ones(n_standard)]
            spread = np.linalg.inv(columns.T @ (columns / variances[:, None]) + np.diag(prior))
            centre = spread @ (columns.T @ ((y - shift) / variances))
            axes = np.linalg.cholesky(spread)
            line = np.arange(-_REACH, _REACH + _STEP, _STEP)
            points = centre + np.array(list(product(line, repeat=columns.shape[1]))) @ axes.T
            standard = points[:, 3:]
            log_density = log_normal(y - shift - points @ columns.T, variances)
            log_density += -0.5 * (standard**2).sum(axis=1) - 0.5 * n_standard * np.log(2.0 * np.pi)
            total += level * weight * np.exp(log_density).sum() * np.abs(np.diagonal(axes)).prod() * _STEP ** len(axes)
    return float(np.log(total))


CASES = {
    "an uncertain input": {"n_inputs": 1, "resolution": 1.0},
    "two setups": {"noise": (0.004, 0.009), "resolution": 0.5},
}


@pytest.mark.parametrize(("case", "without"), [("an uncertain input", None), ("two setups", None), ("two setups", 2)])
def test_evidence_is_the_integral_over_constants_sizes_inputs_and_noise(case, without):
    rng = np.random.default_rng(1)
    base = baseline(rng, **CASES[case])
    cells = table(rng, n_cells=2)
    grid = NoiseGrid(np.array([[0.6], [1.7]]) * [s.noise.median for s in base.board.setups], np.array([0.3, 0.7]))
    residual = 0.01 * rng.standard_normal(6)
    terms = NormalTerms(cells, base, grid)
    used = np.arange(6) if without is None else np.delete(np.arange(6), without)

    found = [terms.log_evidence(residual[None, :])[0]]
    if without is not None:  # as a reading that is left out, and as one that is no mode
        fewer = base.labelled(np.where(np.isin(np.arange(6), used), base.rows, -1))
        found = [terms.left_out(residual[None, :])[0][without, 0]]
        found += [NormalTerms(cells, fewer, grid).log_evidence(residual[None, :])[0]]
    expected = by_grid(base, cells, grid, residual, used)
    assert found == pytest.approx([expected] * len(found), abs=EXACT)


def test_few_cells_at_a_time_give_what_all_together_do(monkeypatch):
    rng = np.random.default_rng(4)
    base = baseline(rng, noise=(0.004, 0.009))
    cells = table(rng, n_cells=7, n_tangents=2)
    residuals = 0.01 * rng.standard_normal((5, base.n_modes))

    def found():
        terms = NormalTerms(cells, base, noise_grid(base.board))
        return terms.log_evidence(residuals), *terms.left_out(residuals)

    together = found()
    monkeypatch.setattr("bayesplate.diagnosis.terms._MOST_ARRAY_ELEMENTS", 300)
    assert len(list(NormalTerms(cells, base, noise_grid(base.board))._in_parts(5))) > 2
    for apart, whole in zip(found(), together, strict=True):
        np.testing.assert_allclose(apart, whole, rtol=1e-12)


def refitted_without(base, mode, residual, cell, sd):
    """Error of predicting one reading by the fit of constants, inputs and place in the cell to the others."""
    shift, slopes = cell
    used = np.delete(np.arange(base.n_modes), mode)  # or those of one mode
    columns = np.hstack([base.slopes, slopes, base.input_slopes])
    scales = np.broadcast_to(sd, base.n_modes)[used]
    rows = np.vstack([columns[used] / scales[:, None], np.eye(columns.shape[1])[3:]])
    target = np.r_[(residual - shift)[used] / scales, np.zeros(columns.shape[1] - 3)]
    fitted = np.linalg.lstsq(rows, target, rcond=None)[0]
    return (residual - shift)[mode] - columns[mode] @ fitted


@pytest.mark.parametrize("case", CASES)
def test_a_reading_that_was_left_out_is_predicted_by_refits_of_cells_and_levels_with_their_share(case):
    """Where readings differ in noise, what each level of it makes of the others is another fit of the constants.

    What the others tell of the inputs counts too: sizes of declared effects, which may lie far from their priors.
    """
    rng = np.random.default_rng(5)
    base = baseline(rng, **CASES[case])
    cells = table(rng, n_cells=3)
    grid = noise_grid(base.board)
    residual = 0.01 * rng.standard_normal(6)
    found = NormalTerms(cells, base, grid).left_out(residual[None, :])[1][:, 0]
    for mode in (1, 4):
        used = np.delete(np.arange(6), mode)
        total, predicted = 0.0, 0.0
        for by_setup, level in zip(grid.sd, grid.weights, strict=True):
            sd = np.sqrt(by_setup[base.setup_index] ** 2 + base.own_variance)
            for shift, slopes, weight in zip(cells.shift, cells.slopes, cells.weights, strict=True):
                constants, others = base.slopes[used], np.hstack([slopes, base.input_slopes])[used]
                gap = (residual - shift)[used]
                wide = np.diag(sd[used] ** 2) + 1e4 * constants @ constants.T + others @ others.T
                share = np.exp(-0.5 * gap @ np.linalg.solve(wide, gap) - 0.5 * np.linalg.slogdet(wide)[1])
                total += share * level * weight
                refit = refitted_without(base, mode, residual, (shift, slopes), sd)
                predicted += share * level * weight * refit
        # the constants' sd of 100 stands for a flat prior
        assert found[mode] == pytest.approx(predicted / total, abs=1e-7)


@pytest.fixture(scope="module")
def days():
    """Six modes read on two days, one of them off on both as by something that the plate lacks."""
    rng = np.random.default_rng(8)
    base = baseline(rng, 12, noise=(NOISE, NOISE))
    first = base.board.setups[0]
    setups = tuple(replace(first, name=day, group=Owner("group", "days")) for day in ("monday", "friday"))
    slopes, frequency = np.tile(base.slopes[:6], (2, 1)), np.tile(base.log_frequency[:6], 2)
    base = with_modes(replace(base, board=replace(base.board, setups=setups)), slopes=slopes, log_frequency=frequency)
    return base, 0.02 * np.tile(np.eye(6)[2], 2) + 0.001 * rng.standard_normal(12)


def test_of_several_sessions_a_mode_is_left_out_with_all_its_readings(days):
    """Its reading on the other day would foretell it, whatever the model."""
    base, residual = days
    ground = ground_of(base, bare(base, one_level(base)))
    assert base.readings_by_mode == tuple((i, i + 6) for i in range(6))
    found = left_out(ground, 0, residual)
    nothing_added = np.zeros(12), np.zeros((12, 0))
    for i in range(12):
        mode = [i, (i + 6) % 12]
        without = refitted_without(base, mode, residual, nothing_added, NOISE)
        assert found[i] == pytest.approx(without[0], abs=1e-12)
    assert nested_leave_one_out(ground, residual[None, :]).before[0] == pytest.approx(found, abs=1e-12)
    alone = refitted_without(base, 2, residual, nothing_added, NOISE)
    assert abs(found[2]) > abs(alone) + 1e-3


def test_the_log_score_of_several_sessions_is_one_term_per_mode(days):
    """What both days say of a mode is one piece of evidence: as two, it would halve the variance of a gain."""
    base, residual = days
    cells = table(np.random.default_rng(9), 12, n_cells=1, n_tangents=1)
    ground = ground_of(base, bare(base, one_level(base)), Hypothesis(("first",), 0.5, cells, one_level(base), base))
    scores, wide = np.zeros((2, 6)), 10.0  # sd of the constants; the flat prior is its limit
    for k, (shift, slopes) in enumerate([(np.zeros(12), np.zeros((12, 1))), (cells.shift[0], cells.slopes[0])]):
        precision = np.linalg.inv(NOISE**2 * np.eye(12) + slopes @ slopes.T + wide**2 * base.slopes @ base.slopes.T)
        for i in range(6):
            mode = [i, i + 6]
            covariance = np.linalg.inv(precision[np.ix_(mode, mode)])
            error = covariance @ (precision @ (residual - shift))[mode]
            scores[k, i] = multivariate_normal(np.zeros(2), covariance).logpdf(error)
    gains = log_score_gains(ground, residual, np.ones(12, dtype=int))
    assert gains == pytest.approx(scores[1] - scores[0], abs=1e-3)
    assert log_score(ground, 1, residual) == pytest.approx(scores[1].sum(), abs=1e-3)
