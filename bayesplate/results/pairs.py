"""Boards that match like the two halves of a book: which pairs, and with what probability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.results.log_figures import FIGURES
from bayesplate.results.normal_box import box_probability

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_NEAREST = 12
"""Partners that are looked at for each board."""
_AT_ONCE = 200_000
"""Pairs that are looked at together, so that the memory does not grow with the number of boards."""
LEAST_PROBABILITY = 0.05
"""Pairs that match with less are not proposed."""


@dataclass(frozen=True)
class Pair:
    """Two boards, by their places, and the probability that they match."""

    first: int
    second: int
    probability: float


def proposed_pairs(log_mean: Floats, log_covariance: Floats, percent: Mapping[str, float]) -> tuple[Pair, ...]:
    """Pairs of boards, each board at most once, the likeliest match first.

    Two boards match if each constant of the one is that of the other within its tolerance:
    |ln(E_a / E_b)| <= ln(1 + tolerance). Their errors are taken to be independent, and those of one board's constants
    vary together as its readings tell them. The likeliest pair is taken first, then the likeliest of those that are
    left, and so on.

    Parameters
    ----------
    log_mean : (n, 7) array
        Of the names of `JOINT`.
    log_covariance : (n, 7, 7) array
    percent : dict of float
        Tolerance of each figure that has to match.

    Returns
    -------
    tuple of Pair
        Those that match with at least 5 %.
    """
    if len(log_mean) < 2 or not percent:
        return ()
    along = np.stack([FIGURES[name].direction for name in percent])
    width = np.log1p(np.array(list(percent.values())) / 100.0)
    mean = log_mean @ along.T
    covariance = along @ log_covariance @ along.T
    first, second = _candidates(mean, np.diagonal(covariance, axis1=1, axis2=2), width)
    found = box_probability(mean[first] - mean[second], covariance[first] + covariance[second], -width, width)
    order = np.lexsort((second, first, -found))
    pairs, taken = [], np.zeros(len(mean), dtype=bool)
    for i in order:
        a, b = int(first[i]), int(second[i])
        if found[i] >= LEAST_PROBABILITY and not taken[a] and not taken[b]:
            pairs.append(Pair(a, b, float(found[i])))
            taken[[a, b]] = True
    return tuple(pairs)


def _candidates(mean: Floats, variance: Floats, width: Floats) -> tuple[Rows, Rows]:
    """For each board its likeliest partners if the constants were independent: two arrays of places, first < second."""
    from scipy.special import ndtr

    n = len(mean)
    first, second = [], []
    step = max(1, _AT_ONCE // n)
    for start in range(0, n, step):
        rows = np.arange(start, min(start + step, n))
        apart = mean[rows, None, :] - mean[None]
        sd = np.sqrt(np.maximum(variance[rows, None, :] + variance[None], 1e-24))
        within = ndtr((width - apart) / sd) - ndtr((-width - apart) / sd)
        together = np.log(np.maximum(within, 1e-300)).sum(axis=2)
        together[np.arange(rows.size), rows] = -np.inf
        n_nearest = min(_NEAREST, n - 1)
        nearest = np.argsort(-together, axis=1, kind="stable")[:, :n_nearest]
        first.append(np.repeat(rows, n_nearest))
        second.append(nearest.ravel())
    a, b = np.concatenate(first), np.concatenate(second)
    ordered = np.unique(np.stack([np.minimum(a, b), np.maximum(a, b)], axis=1), axis=0)
    return ordered[:, 0], ordered[:, 1]
