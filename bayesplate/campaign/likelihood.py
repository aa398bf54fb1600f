"""A board's likelihood of the shared parameters, all of its own integrated out, from draws of its own posterior.

Draws of the shared parameters z from a density proportional to r(z) L(z), with r known, give L without any integral:
ln L is taken as a polynomial, and that of maximum likelihood is the one under which z has the moments of the draws.
The polynomial is written in products of Hermite polynomials of the whitened z, which are nearly orthonormal over the
draws, and the few terms of higher order are drawn towards zero. Beyond the draws it is continued with the slope at
their rim and the curvature of a normal likelihood, because the polynomial itself may rise there without bound.

References
----------
A. R. Barron and C.-H. Sheu, Approximation of density functions by sequences of exponential families, Annals of
Statistics 19 (1991).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.diagnosis.terms import log_sum, normalised_weights
from bayesplate.posterior.starts import LogDensity


class Likelihood(Protocol):
    """A board's likelihood of the shared parameters."""

    def at(self, z: Floats, /) -> Floats:
        """ln L at standard coordinates: (n,) array from (n, n_shared)."""
        ...


_HIGHEST_ORDER = 4
_DRAWS_PER_TERM = 20
"""Effective draws that each term needs for an order to be used."""
_REACH = 3.5
"""Standard deviations of the draws up to which the polynomial is used."""
_STEP_BACK = 0.05
"""Step back from the rim, standard deviations, by which the slope there is found."""
_COEFFICIENT_SD = 0.3
"""Standard deviation of the coefficients of terms of third and fourth order, before any draw."""
_N_POINTS = 8192
_WIDENING = 1.5


@dataclass(frozen=True, eq=False)
class SharedLikelihood:
    """ln L of one board as a function of the shared parameters.

    Attributes
    ----------
    centre : (n_shared,) array
        Mean of the standard coordinates of the draws.
    whitening : (n_shared, n_shared) array
        Takes coordinates less the centre to coordinates of unit spread.
    curvature : (n_shared, n_shared) array
        Minus the curvature of ln L beyond the draws, in coordinates of unit spread.
    coefficients : (n_terms,) array
        Coefficients of the terms of first, second, ... order.
    level : float
        Constant term of ln L.
    """

    centre: Floats
    whitening: Floats
    curvature: Floats
    coefficients: Floats
    level: float = 0.0

    @classmethod
    def from_draws(
        cls, z: Floats, weights: Floats, n_effective: float, log_reference: LogDensity, log_evidence: float
    ) -> SharedLikelihood:
        """The likelihood from draws of a density proportional to r(z) L(z).

        Parameters
        ----------
        z : (n, n_shared) array
            Standard coordinates of the draws.
        weights : (n,) array
            Weights of the draws; they sum to 1.
        n_effective : float
            Number of independent draws of equal weight that they are worth.
        log_reference : callable
            ln r, -inf where it is zero.
        log_evidence : float
            ln of the integral of r(z) L(z).
        """
        centre, covariance = moments(z, weights)
        factor = np.asarray(np.linalg.cholesky(covariance), dtype=np.float64)
        whitening = np.asarray(np.linalg.inv(factor).T, dtype=np.float64)
        degree = _degree(z.shape[1], n_effective)
        points, log_density = spread_points(centre, _WIDENING * factor, _N_POINTS)
        log_weights = log_reference(points) - log_density - np.log(len(points))
        u, u_drawn = (points - centre) @ whitening, (z - centre) @ whitening
        _, reference_covariance = moments(u, normalised_weights(log_weights))
        is_near, is_near_drawn = (u == _within_reach(u)).all(axis=1), (u_drawn == _within_reach(u_drawn)).all(axis=1)
        share = weights[is_near_drawn].sum()
        term_means = weights[is_near_drawn] @ _hermite_terms(u_drawn[is_near_drawn], degree) / share
        near_terms, log_weights = _hermite_terms(u[is_near], degree), log_weights[is_near]
        firmness = np.where(_orders(z.shape[1], degree) > 2, _COEFFICIENT_SD**-2.0 / n_effective, 0.0)
        coefficients = _match_means(near_terms, log_weights, term_means, firmness)
        level = log_evidence + np.log(share) - float(log_sum(log_weights + near_terms @ coefficients))
        return cls(centre, whitening, _added_precision(reference_covariance), coefficients, level)

    @property
    def degree(self) -> int:
        """Highest order of its terms."""
        n = self.centre.size
        return next(d for d in range(2, _HIGHEST_ORDER + 1) if len(_powers(n, d)) == self.coefficients.size)

    def at(self, z: Floats) -> Floats:
        """ln L at standard coordinates: (n,) array from (n, n_shared)."""
        u = (z - self.centre) @ self.whitening
        near = _within_reach(u)
        log_likelihood = self.level + self._polynomial(near)
        beyond = np.flatnonzero((u != near).any(axis=1))
        if beyond.size:
            away = u[beyond] - near[beyond]
            step = _STEP_BACK * away / np.linalg.norm(away, axis=1)[:, None]
            rise = self._polynomial(near[beyond]) - self._polynomial(near[beyond] - step)
            log_likelihood[beyond] += np.minimum(rise, 0.0) * np.linalg.norm(away, axis=1) / _STEP_BACK
            log_likelihood[beyond] -= 0.5 * np.einsum("ni,ij,nj->n", away, self.curvature, away)
        return np.asarray(log_likelihood)

    def _polynomial(self, u: Floats) -> Floats:
        return np.asarray(_hermite_terms(u, self.degree) @ self.coefficients)


def _hermite_terms(u: Floats, degree: int) -> Floats:
    """Products of normalised Hermite polynomials by order: (n, n_terms) array."""
    polynomials, powers = _hermite(u, degree), _powers(u.shape[1], degree)
    return np.asarray(np.prod([polynomials[powers[:, i], i] for i in range(u.shape[1])], axis=0).T)


def _within_reach(u: Floats) -> Floats:
    """The points, those beyond `_REACH` from the middle moved back to it: by radius, as corners of a box lack draws."""
    radius = np.linalg.norm(u, axis=1, keepdims=True)
    return np.asarray(np.where(radius > _REACH, u * (_REACH / np.maximum(radius, _REACH)), u))


def _added_precision(reference_covariance: Floats) -> Floats:
    """Precision that draws of unit spread add to a reference of some covariance, nowhere negative."""
    sizes, directions = np.linalg.eigh(np.eye(len(reference_covariance)) - np.linalg.inv(reference_covariance))
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
        Cholesky factor of its covariance.
    n_points : int
        A power of two.
    """
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    k = centre.size
    normal = ndtri(np.clip(Sobol(k, seed=0).random(n_points), 1e-9, 1.0 - 1e-9))
    log_density = -0.5 * (normal**2).sum(axis=1) - 0.5 * k * np.log(2.0 * np.pi) - np.linalg.slogdet(factor)[1]
    return centre + normal @ factor.T, log_density


def _match_means(terms: Floats, log_weights: Floats, term_means: Floats, firmness: Floats) -> Floats:
    """Coefficients with which an exponential family has the given means of its terms: a convex problem."""
    from scipy.optimize import minimize

    def shares(c: Floats) -> Floats:
        log_shares = log_weights + terms @ c
        return np.asarray(np.exp(log_shares - log_sum(log_shares)))

    def objective(c: Floats) -> tuple[float, Floats]:
        value = float(log_sum(log_weights + terms @ c) - term_means @ c + 0.5 * firmness @ c**2)
        return value, shares(c) @ terms - term_means + firmness * c

    def curvature(c: Floats) -> Floats:
        _, covariance = moments(terms, shares(c))
        return covariance + np.diag(firmness)

    solution = minimize(objective, np.zeros(term_means.size), jac=True, hess=curvature, method="trust-exact")
    return np.asarray(solution.x, dtype=np.float64)


def _degree(n_shared: int, n_effective: float) -> int:
    degrees = [d for d in range(2, _HIGHEST_ORDER + 1) if _DRAWS_PER_TERM * _orders(n_shared, d).size <= n_effective]
    return max(degrees, default=2)


@lru_cache
def _powers(n_shared: int, degree: int) -> NDArray[np.intp]:
    """Power of each coordinate in each term, by order: (n_terms, n_shared) array."""
    products = (factors for d in range(1, degree + 1) for factors in combinations_with_replacement(range(n_shared), d))
    return np.array([[factors.count(i) for i in range(n_shared)] for factors in products], dtype=np.intp)


def _orders(n_shared: int, degree: int) -> NDArray[np.intp]:
    """Order of each term: (n_terms,) array."""
    return np.asarray(_powers(n_shared, degree).sum(axis=1))


def _hermite(u: Floats, degree: int) -> Floats:
    """Normalised Hermite polynomials of each coordinate: (degree + 1, k, n) array from (n, k)."""
    polynomials = [np.ones_like(u.T), u.T]
    for m in range(1, degree):
        polynomials.append((u.T * polynomials[m] - np.sqrt(m) * polynomials[m - 1]) / np.sqrt(m + 1.0))
    return np.stack(polynomials)
