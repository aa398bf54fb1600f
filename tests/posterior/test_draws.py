"""Thinned draws: the order that ArviZ reads, and how many are kept."""

from __future__ import annotations

import numpy as np

from bayesplate.posterior.statistics import thin_walker_major


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
