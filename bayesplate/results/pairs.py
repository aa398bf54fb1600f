"""Boards that match like the two halves of a book: which pairs, and with what probability."""

from __future__ import annotations

from array import array
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
_AT_ONCE = 1_000
"""Pairs whose probability is computed together, so that the memory hardly grows with the number of boards."""
LEAST_PROBABILITY = 0.05
"""Pairs that match with less are not proposed."""


@dataclass(frozen=True, slots=True)
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
    covariance = np.einsum("ai,nij,bj->nab", along, log_covariance, along)
    either = _candidates(mean, np.diagonal(covariance, axis1=1, axis2=2), width)
    found = np.empty(len(either))
    for start in range(0, len(either), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        a, b = np.divmod(either[some], len(mean))
        found[some] = box_probability(mean[a] - mean[b], covariance[a] + covariance[b], -width, width)
    pairs, taken = [], np.zeros(len(mean), dtype=bool)
    may_match = found >= LEAST_PROBABILITY
    either, found = either[may_match], found[may_match]
    for i in np.argsort(-found, kind="stable"):
        first, second = divmod(int(either[i]), len(mean))
        if not taken[first] and not taken[second]:
            pairs.append(Pair(first, second, float(found[i])))
            taken[[first, second]] = True
    return tuple(pairs)


def _candidates(mean: Floats, variance: Floats, width: Floats) -> Rows:
    """The likeliest partners of each board if the constants were independent: n first + second, each pair once.

    Only boards that may match at all are looked at: that a figure of two of them is between two limits is no more
    probable than that it is below the upper one. Along the first figure those boards are neighbours.
    """
    from scipy.special import ndtr, ndtri

    n = len(mean)
    farthest = -ndtri(LEAST_PROBABILITY)  # standard deviations beyond the width
    order = np.argsort(mean[:, 0], kind="stable")
    mean, variance = mean[order], variance[order]
    reach = width[0] + farthest * np.sqrt(variance[:, 0] + variance[:, 0].max())
    starts = np.searchsorted(mean[:, 0], mean[:, 0] - reach)
    ends = np.searchsorted(mean[:, 0], mean[:, 0] + reach, side="right")
    either = array("q")
    for i, (start, end) in enumerate(zip(starts, ends, strict=True)):
        apart = np.abs(mean[start:end] - mean[i])
        sd = np.sqrt(np.maximum(variance[start:end] + variance[i], 1e-24))
        may_match = np.all(apart <= width + farthest * sd, axis=1)
        may_match[i - start] = False
        apart, sd = apart[may_match], sd[may_match]
        within = ndtr((width - apart) / sd) - ndtr((-width - apart) / sd)
        together = np.log(np.maximum(within, 1e-300)).sum(axis=1)
        nearest = np.flatnonzero(may_match)[np.argsort(-together, kind="stable")[:_NEAREST]]
        own, other = order[i], order[start + nearest]
        either.frombytes((n * np.minimum(own, other) + np.maximum(own, other)).tobytes())
    return np.unique(np.frombuffer(either, dtype=np.int64))
