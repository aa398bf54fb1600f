"""Draws of ensembles as chains (chain = ensemble), and their statistics by ArviZ, 0.23 and 1.x alike."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.libraries import load_arviz

LARGEST_PARETO_K = 0.7
"""Largest Pareto k-hat at which weighted draws of one density may be used for another."""
_EVEN_WEIGHTS = 2.0
"""Largest ratio of a weight to the mean at which they may be used whatever k-hat is: the weights are nearly even."""


def thinning_step(tau_max: float) -> int:
    """Steps from one kept draw to the next: half the largest autocorrelation time."""
    return max(1, int(tau_max / 2.0)) if np.isfinite(tau_max) else 1


def walker_major(draws: Floats) -> Floats:
    """(n_ensembles, n_steps, n_walkers, ...) draws as (n_ensembles, n_draws, ...): one walker after the other.

    Consecutive draws are then steps of one walker, and ArviZ's effective sizes contain the true autocorrelation; in
    order of steps it would take the walkers of a step for consecutive draws.
    """
    return np.swapaxes(draws, 1, 2).reshape(len(draws), -1, *draws.shape[3:])


def thin_walker_major(draws: Floats, burn_in: int, tau_max: float, *, n_draws_max: int | None = None) -> Floats:
    """Draws after burn-in, thinned to half an autocorrelation time, (n_ensembles, n_draws, ...) as `walker_major`.

    Thinned further until a chain holds at most `n_draws_max` draws (but at least one per walker).
    """
    n_steps, n_walkers = draws.shape[1:3]
    step = thinning_step(tau_max)
    if n_draws_max is not None:
        step = max(step, -(-(n_steps - burn_in) // max(1, n_draws_max // n_walkers)))
    return walker_major(draws[:, burn_in::step])


def rhat(chains: Floats) -> Floats:
    """Rank-normalised split R-hat of (n_chains, n_draws, n_dim) draws in order of time: (n_dim,) array."""
    return _by_parameter(chains, lambda arviz, draws: arviz.rhat(draws))


def effective_sizes(chains: Floats) -> Floats:
    """The smaller of bulk and tail effective size of (n_chains, n_draws, n_dim) draws: (n_dim,) array."""
    tails = (0.05, 0.95)  # 1.x needs them as an argument
    return _by_parameter(
        chains, lambda arviz, draws: min(arviz.ess(draws), arviz.ess(draws, method="tail", prob=tails))
    )


def smooth_weights(log_weights: Floats) -> tuple[Floats, float]:
    """Pareto-smoothed importance weights that sum to 1, and the k-hat of their tail; -inf for a draw without weight."""
    arviz = load_arviz()
    if hasattr(arviz, "psislw"):
        log_smoothed, k = arviz.psislw(log_weights)
    else:
        log_smoothed, k = import_module("arviz_stats.base").array_stats.psislw(log_weights)
    weights = np.exp(np.asarray(log_smoothed, dtype=np.float64))
    return weights / weights.sum(), float(k)


def weights_suffice(weights: Floats, pareto_k: float) -> bool:
    """Whether draws with these smoothed weights may be used for the density that they are weighted to."""
    return pareto_k <= LARGEST_PARETO_K or bool(weights.max() * weights.size <= _EVEN_WEIGHTS * weights.sum())


def effective_draws(weights: Floats) -> float:
    """Effective number of draws, from weights that sum to 1."""
    return float(1.0 / np.sum(weights**2))


def effective_share(weights: Floats) -> float:
    """Effective number of draws over their number, from weights that sum to 1."""
    return effective_draws(weights) / weights.size


def resample(weights: Floats, n: int, rng: np.random.Generator) -> Indices:
    """Indices drawn by weight in a systematic resampling, which has the least scatter, in order: (n,) array."""
    places = (np.arange(n) + rng.random()) / n * weights.sum()
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1), dtype=np.intp)


def _by_parameter(chains: Floats, statistic: Any) -> Floats:
    arviz = load_arviz()
    with np.errstate(invalid="ignore", divide="ignore"):  # a parameter that never moves has none
        statistics = [
            float(statistic(arviz, np.ascontiguousarray(chains[:, :, dim]))) for dim in range(chains.shape[2])
        ]
    return np.array(statistics)
