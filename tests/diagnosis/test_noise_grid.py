"""Levels of the noise: against a fine grid, and no more of them for twenty setups than for three."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from made_searches import baseline, table, with_residual

from bayesplate.diagnosis.hypotheses import make_hypotheses
from bayesplate.diagnosis.shifts import no_effect_cells
from bayesplate.diagnosis.terms import NoiseGrid, NormalTerms, noise_grid

N_SETS = 40


def log_odds(base, grid, residuals):
    """Of an effect of a few cells against none."""
    some = table(np.random.default_rng(5), base.n_modes)
    one, none = (
        NormalTerms(each, base, grid).log_evidence(residuals) for each in (some, no_effect_cells(base.n_modes))
    )
    return one - none


def product_grid(base, n_along):
    """Equidistant levels of each noise with every other's."""
    t = np.array(list(product(np.linspace(-2.5, 3.5, 2 * n_along + 1)[1::2], repeat=len(base.board.setups))))
    noise = [setup.noise.median * np.exp(setup.noise.log_sd * t[:, i]) for i, setup in enumerate(base.board.setups)]
    weights = np.exp(-0.5 * (t**2).sum(axis=1))
    return NoiseGrid(np.stack(noise, axis=1), weights / weights.sum())


@pytest.mark.parametrize("n_setups", [1, 3])
def test_odds_are_those_of_a_fine_grid(n_setups):
    """Rms over boards whose noises are drawn from their prior, in nats, against one noise that is taken for known.

    Points among three noises do better than as many in a product.
    """
    rng = np.random.default_rng(1)
    base = baseline(rng, 5 * n_setups, noise=(0.005,) * n_setups)
    noise = 0.005 * np.exp(0.5 * rng.standard_normal((N_SETS, n_setups)))[:, base.setup_index]
    residuals = noise * rng.standard_normal(noise.shape)
    expected = log_odds(base, product_grid(base, 17), residuals)

    def off(grid):
        return np.sqrt(np.mean((log_odds(base, grid, residuals) - expected) ** 2))

    many, few = (off(noise_grid(base.board, is_coarse=few)) for few in (False, True))
    one = off(NoiseGrid(np.full((1, n_setups), 0.005), np.ones(1)))
    assert many < 0.3 < one
    assert many < few < 0.5 * one
    if n_setups == 3:
        assert many < off(product_grid(base, 4))
        assert few < off(product_grid(base, 3))


def test_levels_are_no_more_for_twenty_setups_than_for_three():
    for few in [False, True]:
        grids = [
            noise_grid(baseline(np.random.default_rng(0), 60, noise=(0.005,) * n).board, is_coarse=few) for n in (3, 20)
        ]

        assert grids[0].weights.size == grids[1].weights.size <= 64
        for grid in grids:
            logs = np.log(grid.sd / 0.005) / 0.5
            assert grid.weights.sum() == pytest.approx(1.0)
            np.testing.assert_allclose(grid.weights @ logs, 0.0, atol=0.1)  # the middle of the prior and its width
            np.testing.assert_allclose(grid.weights @ logs**2, 1.0, atol=0.15)


@pytest.mark.parametrize(("n_setups", "times"), [(1, 0.5), (2, 4.0), (1, 16.0)])
def test_a_large_misfit_is_a_large_noise(n_setups, times):
    """The evidence of none and of a pair against a fine grid over nine sd: levels that end at 3.5 sd are off.

    Readings of sixteen times the noise stand 5.5 sd up its prior.
    """
    rng = np.random.default_rng(3)
    base = baseline(rng, 6 * n_setups, noise=(0.005,) * n_setups)
    base = with_residual(base, times * 0.005 * rng.standard_normal(base.n_modes))
    t = np.array(list(product(np.linspace(-4.0, 10.0, 71), repeat=n_setups)))
    weights = np.exp(-0.5 * (t**2).sum(axis=1))
    fine = NoiseGrid(0.005 * np.exp(0.5 * t), weights / weights.sum())
    some = {name: table(rng, base.n_modes) for name in "ab"}
    found = make_hypotheses(base, some, some, "ab")

    def off(one, grid):
        both = (NormalTerms(one.table, base, each).log_evidence(base.residual[None, :])[0] for each in (grid, fine))
        return abs(next(both) - next(both))

    assert off(found[0], found[0].noise) < 0.7
    assert off(found[-1], found[-1].noise) < 1.5  # a pair has few levels
    assert (off(found[0], noise_grid(base.board)) > 5.0) == (times > 10.0)  # levels that end at 3.5 sd
    assert (found[0].noise.weights.size > noise_grid(base.board).weights.size) == (times > 2.0)
