"""The probability that jointly normal numbers all lie between their limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_N_POINTS = 1024
_AT_ONCE = 8
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37)
MOST = len(_PRIMES) + 1
"""Numbers that may be limited together."""
_RIDGE = 1e-12
"""Share of a variance that is added to it, so that numbers that follow from one another are no obstacle."""


def box_probability(mean: Floats, covariance: Floats, low: Floats, high: Floats) -> Floats:
    """Probability of low <= x <= high in every component.

    The components are taken one after the other, each given those before it, at the points of a lattice in the unit
    cube: with three of them the result errs by less than 1e-3.

    Parameters
    ----------
    mean : (n, k) array
    covariance : (n, k, k) array
    low, high : (k,) arrays
        May be infinite.

    Returns
    -------
    (n,) array

    References
    ----------
    Genz, "Numerical computation of multivariate normal probabilities", J. Comp. Graph. Stat. 1, 1992, 141.
    """
    found = np.empty(len(mean))
    for start in range(0, len(mean), _AT_ONCE):
        some = slice(start, start + _AT_ONCE)
        found[some] = _some(low - mean[some], high - mean[some], covariance[some])
    return found


def _some(low: Floats, high: Floats, covariance: Floats) -> Floats:
    """The same of a few, limits less means: (n, k) arrays."""
    from scipy.special import ndtr, ndtri

    n, k = low.shape
    scale = np.sqrt(np.maximum(np.diagonal(covariance, axis1=1, axis2=2), 1e-24))
    low, high = low / scale, high / scale
    correlation = covariance / (scale[:, :, None] * scale[:, None, :])
    root = np.linalg.cholesky(correlation + _RIDGE * k * np.eye(k))
    points = _lattice(k - 1)
    given = np.zeros((n, k, points.shape[0]))
    product = np.ones((n, points.shape[0]))
    for i in range(k):
        before = np.einsum("nj,njp->np", root[:, i, :i], given[:, :i])
        own = root[:, i, i, None]
        below, above = ndtr((low[:, i, None] - before) / own), ndtr((high[:, i, None] - before) / own)
        width = np.maximum(above - below, 0.0)
        product *= width
        if i < k - 1:
            inside = np.clip(below + points[:, i] * width, 1e-300, 1.0 - 1e-16)
            given[:, i] = ndtri(inside)
    return np.asarray(product.mean(axis=1))


def _lattice(k: int) -> Floats:
    """Points that fill the unit cube evenly: (n_points, k) array."""
    steps = np.sqrt(np.array(_PRIMES[:k], dtype=float))
    at = np.mod(np.outer(np.arange(1, _N_POINTS + 1), steps) + 0.5 * steps, 1.0)
    return np.abs(2.0 * at - 1.0) if k else np.zeros((1, 0))
