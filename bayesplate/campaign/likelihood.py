"""A board's likelihood of what is shared, everything of its own integrated out, from draws of its own posterior.

Draws of the shared parameters z from a density proportional to r(z) L(z), r being known, tell L without any integral:
its logarithm is a polynomial, and the one of greatest likelihood is that under which z has the moments of the draws.
The polynomial is written in products of Hermite polynomials of the whitened z, which are nearly orthonormal where the
draws are, and the few terms of higher order are drawn towards zero. Where there are no draws it goes on as it falls at
their rim, with the curvature of a normal likelihood: a polynomial itself may rise there without bound.

References
----------
A. R. Barron and C.-H. Sheu, Approximation of density functions by sequences of exponential families, Annals of
Statistics 19 (1991).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.diagnosis.terms import log_sum, normalised

LogDensity = Callable[[Floats], Floats]
"""From (n, n_shared) standard coordinates to (n,) logarithms of a density."""


class Likelihood(Protocol):
    """A board's likelihood of what is shared."""

    def at(self, z: Floats, /) -> Floats:
        """ln L at standard coordinates: (n,) array from (n, n_shared)."""
        ...


_HIGHEST = 4
_DRAWS_PER_TERM = 20
"""Effective draws for each term of an order that is to be used."""
_REACH = 3.5
"""Standard deviations of the draws up to which the polynomial is taken at its word."""
_BACK = 0.05
"""Step back from the rim, standard deviations, by which the slope there is found."""
_SIZE = 0.3
"""Standard deviation of the coefficients of terms of third and fourth order, before any draw."""
_N_POINTS = 8192
_WIDER = 1.5


@dataclass(frozen=True, eq=False)
class SharedLikelihood:
    """ln L of one board as a function of the shared parameters.

    Attributes
    ----------
    centre : (n_shared,) array
        Mean of the standard coordinates of the draws that it was found from.
    whitening : (n_shared, n_shared) array
        Takes coordinates less the centre to coordinates of unit spread.
    curvature : (n_shared, n_shared) array
        Minus that of ln L beyond the draws, in coordinates of unit spread.
    coefficients : (n_terms,) array
        Of the terms of first, second, ... order.
    """

    centre: Floats
    whitening: Floats
    curvature: Floats
    coefficients: Floats
    level: float = 0.0

    @classmethod
    def found(
        cls, z: Floats, weights: Floats, n_effective: float, log_reference: LogDensity, log_evidence: float
    ) -> SharedLikelihood:
        """From draws of a density proportional to r(z) L(z).

        Parameters
        ----------
        z : (n, n_shared) array
            Standard coordinates of the draws.
        weights : (n,) array
            Of the draws; they sum to 1.
        n_effective : float
            How many independent draws of equal weight they are worth.
        log_reference : callable
            ln r, -inf where it is zero.
        log_evidence : float
            ln of the integral of r(z) L(z).
        """
        centre, covariance = moments(z, weights)
        factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        whitening = np.asarray(np.linalg.inv(factor).T, dtype=np.float64)
        degree = _degree(z.shape[1], n_effective)
        points, log_density = spread_points(centre, _WIDER * factor, _N_POINTS)
        log_weights = log_reference(points) - log_density - np.log(len(points))
        u, drawn = (points - centre) @ whitening, (z - centre) @ whitening
        _, reference = moments(u, normalised(log_weights))
        near, near_drawn = (u == _near(u)).all(axis=1), (drawn == _near(drawn)).all(axis=1)
        share = weights[near_drawn].sum()
        wanted = weights[near_drawn] @ _terms(drawn[near_drawn], degree) / share
        there, log_weights = _terms(u[near], degree), log_weights[near]
        firmness = np.where(_orders(z.shape[1], degree) > 2, _SIZE**-2.0 / n_effective, 0.0)
        coefficients = _with_moments(there, log_weights, wanted, firmness)
        level = log_evidence + np.log(share) - float(log_sum(log_weights + there @ coefficients))
        return cls(centre, whitening, _told(reference), coefficients, level)

    @property
    def degree(self) -> int:
        """Highest order of its terms."""
        n = self.centre.size
        return next(d for d in range(2, _HIGHEST + 1) if len(_powers(n, d)) == self.coefficients.size)

    def at(self, z: Floats) -> Floats:
        """ln L at standard coordinates: (n,) array from (n, n_shared)."""
        u = (z - self.centre) @ self.whitening
        near = _near(u)
        found = self.level + self._polynomial(near)
        beyond = np.flatnonzero((u != near).any(axis=1))
        if beyond.size:
            away = u[beyond] - near[beyond]
            step = _BACK * away / np.linalg.norm(away, axis=1)[:, None]
            rise = self._polynomial(near[beyond]) - self._polynomial(near[beyond] - step)
            found[beyond] += np.minimum(rise, 0.0) * np.linalg.norm(away, axis=1) / _BACK
            found[beyond] -= 0.5 * np.einsum("ni,ij,nj->n", away, self.curvature, away)
        return np.asarray(found)

    def _polynomial(self, u: Floats) -> Floats:
        return np.asarray(_terms(u, self.degree) @ self.coefficients)


def _terms(u: Floats, degree: int) -> Floats:
    """Products of normalised Hermite polynomials by order: (n, n_terms) array."""
    polynomials, powers = _hermite(u, degree), _powers(u.shape[1], degree)
    return np.asarray(np.prod([polynomials[powers[:, i], i] for i in range(u.shape[1])], axis=0).T)


def _near(u: Floats) -> Floats:
    """The same points, those out of reach brought back towards the middle: in a corner of a box there are no draws."""
    radius = np.linalg.norm(u, axis=1, keepdims=True)
    return np.asarray(np.where(radius > _REACH, u * (_REACH / np.maximum(radius, _REACH)), u))


def _told(reference: Floats) -> Floats:
    """What draws of unit spread say beyond a reference of some covariance: a precision, nowhere negative."""
    sizes, directions = np.linalg.eigh(np.eye(len(reference)) - np.linalg.inv(reference))
    return np.asarray((directions * np.maximum(sizes, 0.0)) @ directions.T)


def moments(z: Floats, weights: Floats) -> tuple[Floats, Floats]:
    """Mean and covariance of weighted draws: (k,) and (k, k) arrays."""
    mean = weights @ z
    away = z - mean
    return mean, (weights[:, None] * away).T @ away


def spread_points(centre: Floats, factor: Floats, n_points: int) -> tuple[Floats, Floats]:
    """Evenly spread points of a normal distribution, by Sobol's sequence, and ln of its density there.

    Parameters
    ----------
    centre : (k,) array
    factor : (k, k) array
        Of its covariance.
    n_points : int
        A power of two.
    """
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    k = centre.size
    normal = ndtri(np.clip(Sobol(k, seed=0).random(n_points), 1e-9, 1.0 - 1e-9))
    log_density = -0.5 * (normal**2).sum(axis=1) - 0.5 * k * np.log(2.0 * np.pi) - np.linalg.slogdet(factor)[1]
    return centre + normal @ factor.T, log_density


def _with_moments(terms: Floats, log_weights: Floats, wanted: Floats, firmness: Floats) -> Floats:
    """Coefficients of the exponential family that has wanted means of its terms: a convex problem."""
    from scipy.optimize import minimize

    def shares(c: Floats) -> Floats:
        log_shares = log_weights + terms @ c
        return np.asarray(np.exp(log_shares - log_sum(log_shares)))

    def lack(c: Floats) -> tuple[float, Floats]:
        value = float(log_sum(log_weights + terms @ c) - wanted @ c + 0.5 * firmness @ c**2)
        return value, shares(c) @ terms - wanted + firmness * c

    def curvature(c: Floats) -> Floats:
        _, covariance = moments(terms, shares(c))
        return covariance + np.diag(firmness)

    found = minimize(lack, np.zeros(wanted.size), jac=True, hess=curvature, method="trust-exact")
    return np.asarray(found.x, dtype=np.float64)


def _degree(n_shared: int, n_effective: float) -> int:
    able = [d for d in range(2, _HIGHEST + 1) if _DRAWS_PER_TERM * _orders(n_shared, d).size <= n_effective]
    return max(able, default=2)


@lru_cache
def _powers(n_shared: int, degree: int) -> NDArray[np.intp]:
    """Power of each coordinate in each term, by order: (n_terms, n_shared) array."""
    factors = (each for d in range(1, degree + 1) for each in combinations_with_replacement(range(n_shared), d))
    return np.array([[each.count(i) for i in range(n_shared)] for each in factors], dtype=np.intp)


def _orders(n_shared: int, degree: int) -> NDArray[np.intp]:
    """Order of each term: (n_terms,) array."""
    return np.asarray(_powers(n_shared, degree).sum(axis=1))


def _hermite(u: Floats, degree: int) -> Floats:
    """Normalised Hermite polynomials of each coordinate: (degree + 1, k, n) array from (n, k)."""
    found = [np.ones_like(u.T), u.T]
    for m in range(1, degree):
        found.append((u.T * found[m] - np.sqrt(m) * found[m - 1]) / np.sqrt(m + 1.0))
    return np.stack(found)
