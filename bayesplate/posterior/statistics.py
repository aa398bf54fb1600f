"""Draws of ensembles as chains (chain = ensemble), and their statistics by ArviZ, 0.23 and 1.x alike."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.libraries import load_arviz

LARGEST_K = 0.7
"""Pareto k-hat beyond which draws of one density do not stand for another."""
_ALIKE = 2.0
"""Largest weight over the mean up to which they do, whatever k-hat is: then it is the shape of next to nothing."""


def thinning(tau_max: float) -> int:
    """Steps from one draw that is kept to the next: half the largest autocorrelation time."""
    return max(1, int(tau_max / 2.0)) if np.isfinite(tau_max) else 1


def walker_major(draws: Floats) -> Floats:
    """(n_ensembles, n_steps, n_walkers, ...) draws as (n_ensembles, n_draws, ...): one walker after the other.

    So neighbours are steps of one walker, and ArviZ's effective sizes see the true autocorrelation; step by step it
    would take the walkers of a step for consecutive draws.
    """
    return np.swapaxes(draws, 1, 2).reshape(len(draws), -1, *draws.shape[3:])


def thin_walker_major(draws: Floats, burn_in: int, tau_max: float, *, n_draws_max: int | None = None) -> Floats:
    """Draws after burn-in, thinned to half an autocorrelation time, (n_ensembles, n_draws, ...) as `walker_major`.

    Thinned further until a chain holds at most `n_draws_max` draws (but at least one per walker).
    """
    n_steps, n_walkers = draws.shape[1:3]
    every = thinning(tau_max)
    if n_draws_max is not None:
        every = max(every, -(-(n_steps - burn_in) // max(1, n_draws_max // n_walkers)))
    return walker_major(draws[:, burn_in::every])


def rhat(chains: Floats) -> Floats:
    """Rank-normalised split R-hat of (n_chains, n_draws, n_dim) draws in order of time: (n_dim,) array."""
    return _of_each(chains, lambda arviz, one: arviz.rhat(one))


def effective_sizes(chains: Floats) -> Floats:
    """The smaller of bulk and tail effective size of (n_chains, n_draws, n_dim) draws: (n_dim,) array."""
    tails = (0.05, 0.95)  # 1.x needs them as an argument
    return _of_each(chains, lambda arviz, one: min(arviz.ess(one), arviz.ess(one, method="tail", prob=tails)))


def smoothed(log_weights: Floats) -> tuple[Floats, float]:
    """Pareto-smoothed importance weights that sum to 1, and the k-hat of their tail; -inf for a draw without weight."""
    arviz = load_arviz()
    if hasattr(arviz, "psislw"):
        log_smoothed, k = arviz.psislw(log_weights)
    else:
        log_smoothed, k = import_module("arviz_stats.base").array_stats.psislw(log_weights)
    weights = np.exp(np.asarray(log_smoothed, dtype=np.float64))
    return weights / weights.sum(), float(k)


def may_stand(weights: Floats, pareto_k: float) -> bool:
    """Whether draws with these smoothed weights stand for those of the density that they are weighted to."""
    return pareto_k <= LARGEST_K or bool(weights.max() * weights.size <= _ALIKE * weights.sum())


def effective_draws(weights: Floats) -> float:
    """Number of draws of equal weight that are worth as much, from weights that sum to 1."""
    return float(1.0 / np.sum(weights**2))


def effective_share(weights: Floats) -> float:
    """Share of the draws that count, from weights that sum to 1."""
    return effective_draws(weights) / weights.size


def resampled(weights: Floats, n: int, rng: np.random.Generator) -> Indices:
    """Indices drawn by weight with the least scatter (systematic), in order: (n,) array."""
    places = (np.arange(n) + rng.random()) / n * weights.sum()
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1), dtype=np.intp)


def _of_each(chains: Floats, statistic: Any) -> Floats:
    arviz = load_arviz()
    with np.errstate(invalid="ignore", divide="ignore"):  # a parameter that never moves has none
        found = [float(statistic(arviz, np.ascontiguousarray(chains[:, :, dim]))) for dim in range(chains.shape[2])]
    return np.array(found)
