"""Statistics of draws: how they are thinned, weights with a heavy tail are seen, and draws follow their weights."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayesplate.posterior.statistics import (
    LARGEST_PARETO_K,
    effective_share,
    resample,
    smooth_weights,
    thin_walker_major,
    weights_suffice,
)

RNG = np.random.default_rng(2)


def pareto(k, n=4000, seed=1):
    """Log weights whose tail has the shape k."""
    return np.log(stats.genpareto(k).rvs(n, random_state=seed) + 1.0)


@pytest.mark.parametrize("k", [0.2, 0.5])
def test_k_hat_is_the_shape_of_the_tail(k):
    """To its scatter at 4000 draws."""
    assert smooth_weights(pareto(k))[1] == pytest.approx(k, abs=0.2)


def test_a_tail_without_a_mean_is_beyond_the_limit():
    assert smooth_weights(pareto(1.0))[1] > LARGEST_PARETO_K


def test_weights_sum_to_one_and_a_draw_without_a_density_has_none():
    log_weights = np.append(pareto(0.2), -np.inf)
    weights, _ = smooth_weights(log_weights)
    assert weights.sum() == pytest.approx(1.0)
    assert weights[-1] == 0.0


def test_draws_stand_for_others_up_to_the_limit_of_k_hat_or_where_all_weights_are_alike():
    weights, alike = smooth_weights(pareto(0.5))[0], np.full(4, 0.25)
    assert weights_suffice(weights, LARGEST_PARETO_K)
    assert not weights_suffice(weights, LARGEST_PARETO_K + 1e-6)
    assert weights_suffice(alike, 3.0)
    assert weights_suffice(np.array([0.5, 0.25, 0.125, 0.125]), 3.0)
    assert not weights_suffice(np.array([0.51, 0.25, 0.12, 0.12]), 3.0)


def test_the_share_that_counts():
    assert effective_share(np.full(8, 0.125)) == pytest.approx(1.0)
    assert effective_share(np.array([0.5, 0.5, 0.0, 0.0])) == pytest.approx(0.5)


def test_each_draw_comes_as_often_as_its_weight_says_to_one():
    weights = RNG.dirichlet(np.ones(50))
    counts = np.bincount(resample(weights, 1000, RNG), minlength=50)
    assert np.all(np.abs(counts - 1000 * weights) < 1.0)


def test_thinned_draws_are_walker_major():
    ensemble, step, walker = np.meshgrid(np.arange(2), np.arange(100), np.arange(3), indexing="ij")
    draws = np.stack([ensemble, step, walker], axis=-1).astype(float)
    thinned = thin_walker_major(draws, burn_in=40, tau_max=20.9)
    assert thinned.shape == (2, 3 * 6, 3)
    assert thinned[1, :7].tolist() == [*([1, step, 0] for step in range(40, 100, 10)), [1, 40, 1]]
    np.testing.assert_array_equal(thin_walker_major(draws[..., 1], 40, 20.9), thinned[..., 1])


def test_thinning_keeps_every_draw_of_independent_steps_and_obeys_the_limit():
    draws = np.zeros((2, 100, 3, 1))
    assert thin_walker_major(draws, 0, 1.0).shape == (2, 300, 1)
    assert thin_walker_major(draws, 0, np.inf).shape == (2, 300, 1)
    assert thin_walker_major(draws, 0, 1.0, n_draws_max=30).shape == (2, 30, 1)
