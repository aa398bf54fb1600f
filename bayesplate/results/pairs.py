"""Boards that match like the two halves of a book: which pairs, and with what probability."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.results.log_figures import FIGURES, covariance_along
from bayesplate.results.normal_box import box_probability

Floats = NDArray[np.float64]
Rows = NDArray[np.signedinteger]

_NEAREST = 12
"""Partners that are looked at for each board."""
_AT_ONCE = 16
"""Boards whose pairs are judged together, so that the memory hardly grows with the number of boards."""
LEAST_PROBABILITY = 0.05
"""Pairs that match with less are not proposed."""


@dataclass(frozen=True, slots=True)
class Pair:
    """Two boards, by their places, and the probability that they match."""

    first: int
    second: int
    probability: float


def proposed_pairs(log_mean: Floats, triangles: Floats, percent: Mapping[str, float]) -> tuple[Pair, ...]:
    """Pairs of boards, each board at most once, the likeliest match first.

    Two boards match if each constant of the one is that of the other within its tolerance:
    |ln(E_a / E_b)| <= ln(1 + tolerance). Their errors are taken to be independent, and those of one board's constants
    vary together as its readings tell them. The likeliest pair is taken first, then the likeliest of those that are
    left, and so on.

    Parameters
    ----------
    log_mean : (n, 7) array
        Of the names of `JOINT`.
    triangles : (n, 28) array
        Upper ones of their covariance.
    percent : dict of float
        Tolerance of each figure that has to match.

    Returns
    -------
    tuple of Pair
        Those that match with at least 5 %.
    """
    if len(log_mean) < 2 or not percent:
        return ()
    first, second, probability = _matches(log_mean, triangles, percent)
    pairs, taken = [], np.zeros(len(log_mean), dtype=bool)
    for i in np.lexsort((second, first, -probability)):
        if not taken[first[i]] and not taken[second[i]]:
            pairs.append(Pair(int(first[i]), int(second[i]), float(probability[i])))
            taken[[first[i], second[i]]] = True
    return tuple(pairs)


def _matches(log_mean: Floats, triangles: Floats, percent: Mapping[str, float]) -> tuple[Rows, Rows, Floats]:
    """All pairs that may be proposed: both boards and the probability that they match, (n_pairs,) arrays."""
    along = np.stack([FIGURES[name].direction for name in percent])
    width = np.log1p(np.array(list(percent.values())) / 100.0)
    mean = log_mean @ along.T
    variances = (covariance_along(one[None], triangles)[:, 0, 0] for one in along)
    nearest = _nearest(mean, np.stack(list(variances), axis=1), width)
    first, second = np.empty((2, nearest.size), dtype=np.int32)
    probability, n = np.empty(nearest.size), 0
    for start in range(0, len(mean), _AT_ONCE):
        one, other = _pairs_of(nearest, start, start + _AT_ONCE)
        covariance = covariance_along(along, triangles[one]) + covariance_along(along, triangles[other])
        found = box_probability(mean[one] - mean[other], covariance, -width, width)
        may_match = found >= LEAST_PROBABILITY
        some = slice(n, n := n + int(may_match.sum()))
        first[some], second[some], probability[some] = one[may_match], other[may_match], found[may_match]
    return first[:n], second[:n], probability[:n]


def _pairs_of(nearest: Rows, start: int, end: int) -> tuple[Rows, Rows]:
    """The pairs of some boards with their partners: two (n_pairs,) arrays, the first board before the second.

    Among the pairs of all boards each is there once.
    """
    own = np.arange(start, min(end, len(nearest)))[:, None]
    partners = nearest[own[:, 0]]
    is_mutual = np.any(nearest[partners] == own[:, :, None], axis=2)
    row, column = np.nonzero((partners >= 0) & ((own < partners) | ~is_mutual))
    one, other = own[row, 0], partners[row, column]
    return np.minimum(one, other), np.maximum(one, other)


def _nearest(mean: Floats, variance: Floats, width: Floats) -> Rows:
    """The likeliest partners of each board if the constants were independent: (n, 12) array, -1 where there are fewer.

    Only boards that may match at all are looked at: that a figure of two of them is between two limits is no more
    probable than that it is below the upper one. Along the first figure those boards are neighbours.
    """
    from scipy.special import ndtr, ndtri

    found = np.full((len(mean), _NEAREST), -1, dtype=np.int32)
    farthest = -ndtri(LEAST_PROBABILITY)  # standard deviations beyond the width
    order = np.argsort(mean[:, 0], kind="stable")
    first = mean[order, 0]
    reach = width[0] + farthest * np.sqrt(variance[order, 0] + variance[:, 0].max())
    starts, ends = np.searchsorted(first, first - reach), np.searchsorted(first, first + reach, side="right")
    for i, own in enumerate(order):
        others = np.delete(order[starts[i] : ends[i]], i - starts[i])
        for k, limit in enumerate(width):
            far = limit + farthest * np.sqrt(variance[others, k] + variance[own, k])
            others = others[np.abs(mean[others, k] - mean[own, k]) <= far]
        apart = np.abs(mean[others] - mean[own])
        sd = np.sqrt(np.maximum(variance[others] + variance[own], 1e-24))
        within = ndtr((width - apart) / sd) - ndtr((-width - apart) / sd)
        together = np.log(np.maximum(within, 1e-300)).sum(axis=1)
        likeliest = others[np.argsort(-together, kind="stable")[:_NEAREST]]
        found[own, : len(likeliest)] = likeliest
    return found
