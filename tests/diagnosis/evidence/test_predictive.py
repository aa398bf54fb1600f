"""The prior predictive p-value: it is uniform under noise as the prior expects it, and small for anything larger."""

from __future__ import annotations

import numpy as np
import pytest
from made_searches import bare, baseline, candidate, one_level, table
from scipy.stats import chi2, kstest

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.noise_grid import noise_grid
from bayesplate.diagnosis.evidence.predictive import PASSES, predictive_p_value
from bayesplate.diagnosis.evidence.terms import Fold

N_SETS = 4000
CERTAIN = 1e-3
"""Probability at which a test of uniformity may fail a p-value that is right."""


def noisy(base, rng, factor=1.0):
    """Readings whose noise is drawn from the log-normal prior itself, not from the levels."""
    (setup,) = base.board.setups
    level = factor * setup.noise.median * np.exp(setup.noise.log_sd * rng.standard_normal((N_SETS, 1)))
    rounding = np.sqrt(base.own_variance) * rng.standard_normal((N_SETS, base.n_modes))
    inputs = rng.standard_normal((N_SETS, base.input_slopes.shape[1])) @ base.input_slopes.T
    constants = rng.standard_normal((N_SETS, 3)) @ base.slopes.T
    return level * rng.standard_normal((N_SETS, base.n_modes)) + rounding + inputs + constants


@pytest.mark.parametrize("n_inputs", [0, 1])
def test_the_gate_is_uniform_under_noise_of_the_prior_and_not_under_three_times_it(n_inputs):
    rng = np.random.default_rng(1)
    base = baseline(rng, n_inputs=n_inputs)
    nothing_lacks = bare(base, noise_grid(base.board))

    found = predictive_p_value(nothing_lacks, Fold(base), noisy(base, rng))
    assert kstest(found, "uniform").pvalue > CERTAIN
    too_large = predictive_p_value(nothing_lacks, Fold(base), noisy(base, rng, 3.0))
    assert kstest(too_large, "uniform").pvalue < CERTAIN
    assert np.mean(too_large < PASSES) > 0.3


def test_the_gate_of_a_known_noise_is_that_of_chi_squared():
    rng = np.random.default_rng(2)
    base = baseline(rng, resolution=1.0)
    residual = 0.01 * rng.standard_normal(6)
    fitted = base.slopes @ np.linalg.lstsq(base.slopes / base.scales[:, None], residual / base.scales, rcond=None)[0]
    misfit = float((((residual - fitted) / base.scales) ** 2).sum())
    known = bare(base, one_level(base))
    assert predictive_p_value(known, Fold(base), residual[None, :])[0] == pytest.approx(chi2.sf(misfit, 3), rel=1e-9)
    assert predictive_p_value(known, Fold(base), 3.0 * residual[None, :])[0] == pytest.approx(
        chi2.sf(9.0 * misfit, 3), rel=1e-9
    )


def test_an_effect_that_is_there_passes_as_often_as_it_should_and_its_absence_does_not():
    """The best size leaves no more misfit than the true one: chi squared, with one degree more for its prior."""
    rng = np.random.default_rng(3)
    base = baseline(rng)
    direction = 0.02 * rng.standard_normal(6)
    there = Hypothesis(("first",), 0.5, candidate(base, "first", direction).fine, noise_grid(base.board))
    shift = np.abs(rng.standard_normal((N_SETS, 1))) * direction
    readings = noisy(base, rng) + shift
    at_true_size = chi2.sf(chi2.isf(PASSES, 3), 4)
    bound = at_true_size + 4.0 * np.sqrt(at_true_size / N_SETS)

    assert np.mean(predictive_p_value(there, Fold(base), readings) < PASSES) < bound
    assert np.mean(predictive_p_value(bare(base, noise_grid(base.board)), Fold(base), readings) < PASSES) > bound
    assert np.mean(predictive_p_value(there, Fold(base), readings - 2.0 * shift) < PASSES) > bound


def test_sizes_that_the_prior_hardly_allows_count_as_misfit():
    rng = np.random.default_rng(4)
    base = baseline(rng)
    cells = table(rng, n_cells=2, n_tangents=0, size=0.05)
    residual = cells.shift[1][None, :]
    likely = Hypothesis(("first",), 0.5, cells, noise_grid(base.board))
    assert predictive_p_value(likely, Fold(base), residual)[0] > 0.5
    cells.weights[...] = [1.0 - 1e-9, 1e-9]
    assert predictive_p_value(likely, Fold(base), residual)[0] < PASSES
