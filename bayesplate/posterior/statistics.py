"""Statistics of draws by ArviZ, 0.23 and 1.x alike: plain arrays in, plain arrays out."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.libraries import load_arviz

Floats = NDArray[np.float64]

LARGEST_K = 0.7
"""Pareto k-hat beyond which draws of one density do not stand for another."""
_ALIKE = 2.0
"""Largest weight over the mean up to which they do, whatever k-hat is: then it is the shape of next to nothing."""


def rhat(chains: Floats) -> Floats:
    """Rank-normalised split R-hat of (n_chains, n_draws, n_dim) draws in order of time: (n_dim,) array."""
    return _of_each(chains, lambda arviz, one: arviz.rhat(one))


def effective_sizes(chains: Floats) -> Floats:
    """The smaller of bulk and tail effective size of (n_chains, n_draws, n_dim) draws: (n_dim,) array."""
    tails = (0.05, 0.95)  # which 1.x wants to be told
    return _of_each(chains, lambda arviz, one: min(arviz.ess(one), arviz.ess(one, method="tail", prob=tails)))


def smoothed(log_weights: Floats) -> tuple[Floats, float]:
    """Pareto-smoothed importance weights that sum to 1, and the k-hat of their tail.

    Parameters
    ----------
    log_weights : (n,) array
        Minus infinity where a draw has none.
    """
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
    """How many draws of equal weight are worth as much, from weights that sum to 1."""
    return float(1.0 / np.sum(weights**2))


def effective_share(weights: Floats) -> float:
    """Share of the draws that count, from weights that sum to 1."""
    return effective_draws(weights) / weights.size


def resampled(weights: Floats, n: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Indices drawn by weight with the least scatter (systematic), in order: (n,) array."""
    places = (np.arange(n) + rng.random()) / n * weights.sum()
    return np.asarray(np.minimum(np.searchsorted(np.cumsum(weights), places), len(weights) - 1), dtype=np.intp)


def _of_each(chains: Floats, statistic: Any) -> Floats:
    arviz = load_arviz()
    with np.errstate(invalid="ignore", divide="ignore"):  # a parameter that never moves has none
        found = [float(statistic(arviz, np.ascontiguousarray(chains[:, :, dim]))) for dim in range(chains.shape[2])]
    return np.array(found)
