"""The prior predictive p-value: it is uniform under what the priors expect, and small for anything larger."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import NOISE, bare, baseline, candidate, one_level, table
from scipy.stats import chi2, kstest, kstwobign

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.search import LEAST_P_VALUE, predictive_p_value
from bayesplate.diagnosis.terms import noise_grid

N_SETS = 4000
N_SIMULATED = {"bare": 20_000, "with an effect": 6000}
"""By `predictive_p_value`, for all sets together."""
CERTAIN = 1e-3
"""Probability at which a test of uniformity may fail a p-value that is right."""


def uniformity(p_values, n_simulated=N_SIMULATED["bare"]):
    """Probability of as large a distance from uniform, what is simulated beside the sets counted as a sample too."""
    share = len(p_values) * n_simulated / (len(p_values) + n_simulated)
    return kstwobign.sf(np.sqrt(share) * kstest(p_values, "uniform").statistic)


def noisy(base, rng, factor=1.0):
    """Readings whose noise is drawn from the log-normal prior of each setup itself, not by the code under test."""
    levels = [
        factor * one.noise.median * np.exp(one.noise.log_sd * rng.standard_normal((N_SETS, 1)))
        for one in base.board.setups
    ]
    level = np.concatenate(
        [np.tile(a, len(b.readings)) for a, b in zip(levels, base.board.setups, strict=True)], axis=1
    )
    rounding = np.sqrt(base.own_variance) * rng.standard_normal((N_SETS, base.n_modes))
    inputs = rng.standard_normal((N_SETS, base.input_slopes.shape[1])) @ base.input_slopes.T
    constants = rng.standard_normal((N_SETS, 3)) @ base.slopes.T
    return level * rng.standard_normal((N_SETS, base.n_modes)) + rounding + inputs + constants


@pytest.mark.parametrize(("noise", "n_inputs"), [((NOISE,), 1), ((0.4 * NOISE, 3.0 * NOISE, NOISE), 0)])
def test_the_p_value_is_uniform_under_noise_of_the_prior_and_not_under_three_times_it(noise, n_inputs):
    rng = np.random.default_rng(1)
    base = baseline(rng, 3 + 3 * len(noise), n_inputs=n_inputs, noise=noise, resolution=0.2)
    nothing_lacks = bare(base, noise_grid(base.board))

    assert uniformity(predictive_p_value(nothing_lacks, base, noisy(base, rng))) > CERTAIN
    too_large = predictive_p_value(nothing_lacks, base, noisy(base, rng, 3.0))
    assert uniformity(too_large) < CERTAIN
    assert np.mean(too_large < LEAST_P_VALUE) > 0.3


def test_the_p_value_of_a_known_noise_is_that_of_chi_squared():
    rng = np.random.default_rng(2)
    base = baseline(rng, resolution=1.0)
    (setup,) = base.board.setups
    known = replace(setup, noise=Quantity.from_median(NOISE, 1.0 + 1e-9))
    base = replace(base, board=replace(base.board, setups=(known,)))
    residuals = 0.01 * rng.standard_normal((50, 6))
    white = base.slopes / base.scales[:, None]
    left = residuals / base.scales - (residuals / base.scales) @ np.linalg.pinv(white).T @ white.T
    expected = chi2.sf((left**2).sum(axis=1), 3)
    found = predictive_p_value(bare(base, one_level(base)), base, residuals)
    bound = 4.0 * np.sqrt(expected * (1.0 - expected) / N_SIMULATED["bare"]) + 2.0 / N_SIMULATED["bare"]
    assert np.all(np.abs(found - expected) < bound)
    assert np.any(np.abs(found - chi2.sf((left**2).sum(axis=1), 4)) > bound)


def test_an_effect_that_is_there_passes_as_often_as_it_should_and_its_absence_does_not():
    rng = np.random.default_rng(3)
    base = baseline(rng)
    direction = 0.02 * rng.standard_normal(6)
    there = Hypothesis(("first",), 0.5, candidate(base, "first", direction).fine, noise_grid(base.board), base)
    shift = np.abs(rng.standard_normal((N_SETS, 1))) * direction
    readings = noisy(base, rng) + shift
    n_simulated = N_SIMULATED["with an effect"]
    bound = LEAST_P_VALUE + 4.0 * np.sqrt(LEAST_P_VALUE / N_SETS + LEAST_P_VALUE / n_simulated)

    assert uniformity(predictive_p_value(there, base, readings), n_simulated) > CERTAIN
    assert np.mean(predictive_p_value(bare(base, noise_grid(base.board)), base, readings) < LEAST_P_VALUE) > bound
    assert np.mean(predictive_p_value(there, base, readings - 2.0 * shift) < LEAST_P_VALUE) > bound


def test_sizes_that_the_prior_hardly_allows_count_as_misfit():
    rng = np.random.default_rng(4)
    base = baseline(rng)
    cells = table(rng, n_cells=2, n_tangents=0, size=0.05)
    residual = cells.shift[1][None, :]
    likely = Hypothesis(("first",), 0.5, cells, noise_grid(base.board), base)
    assert predictive_p_value(likely, base, residual)[0] > 0.5
    hardly = replace(likely, table=replace(cells, weights=np.array([1.0 - 1e-9, 1e-9])))
    assert predictive_p_value(hardly, base, residual)[0] < LEAST_P_VALUE
    nothing_lacks = bare(base, noise_grid(base.board))
    smallest = 1.0 / (1.0 + N_SIMULATED["bare"])
    assert predictive_p_value(nothing_lacks, base, np.eye(6)[:1])[0] == smallest  # nothing allows these
