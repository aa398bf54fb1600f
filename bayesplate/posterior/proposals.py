"""What independent proposals are drawn from: a mixture of Student distributions, fitted to draws.

A posterior of a plate is nearly normal given its noise, and the wider the larger the noise is: one ellipsoid fits it
but roughly, a few of them fit it well. Proposals from a mixture of four are accepted seven times out of ten where those
from one Student distribution are accepted five times, and the autocorrelation time of such steps is half as long.

References
----------
D. Peel and G. J. McLachlan, Robust mixture modelling using the t distribution, Statistics and Computing 10 (2000).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

DEGREES_OF_FREEDOM = 6.0
"""Of each part: heavier tails than the posterior's, or walkers far out would stay there."""
N_PARTS = 4
_N_PASSES = 15
_MOST_FITTED = 4096
_DRAWS_PER_NUMBER = 10
"""Fewer draws than that for each number of a part's mean and covariance, and a part would follow single walkers."""
_FLOOR = 1e-3
"""Share of the covariance of all draws that each part keeps, so that none shrinks to a point."""


@dataclass(frozen=True, eq=False)
class Student:
    """A multivariate Student distribution.

    Attributes
    ----------
    centre : (n_dim,) array
    factor : (n_dim, n_dim) array
        Lower Cholesky factor of the scale matrix.
    """

    centre: FloatArray
    factor: FloatArray

    @classmethod
    def with_scale(cls, centre: FloatArray, scale_matrix: FloatArray) -> Student:
        """From centre and scale matrix, whatever the units of the parameters."""
        scale = np.sqrt(np.diagonal(scale_matrix))
        correlation = scale_matrix / np.outer(scale, scale)
        return cls(centre, scale[:, None] * np.linalg.cholesky(correlation + 1e-10 * np.eye(centre.size)))

    @cached_property
    def whitening(self) -> FloatArray:
        """Inverse of the factor, transposed; a triangular solve at each step would wake threads that cost ten steps."""
        return np.asarray(np.linalg.inv(self.factor).T, dtype=np.float64)

    @cached_property
    def _log_peak(self) -> float:
        n_dim, nu = self.centre.size, DEGREES_OF_FREEDOM
        log_volume = float(np.log(np.diagonal(self.factor)).sum())
        return lgamma(0.5 * (nu + n_dim)) - lgamma(0.5 * nu) - 0.5 * n_dim * np.log(nu * np.pi) - log_volume

    def squared_distances(self, points: FloatArray) -> FloatArray:
        """Squared Mahalanobis distances in units of the scale matrix: (...) array from (..., n_dim) points."""
        z = (points - self.centre) @ self.whitening
        return np.asarray(np.einsum("...i,...i->...", z, z))

    def log_density(self, points: FloatArray) -> FloatArray:
        """Logarithm of the density: (...) array from (..., n_dim) points."""
        power = 0.5 * (DEGREES_OF_FREEDOM + self.centre.size)
        return np.asarray(self._log_peak - power * np.log1p(self.squared_distances(points) / DEGREES_OF_FREEDOM))


@dataclass(frozen=True, eq=False)
class Proposal:
    """A mixture of Student distributions to propose from.

    Attributes
    ----------
    weights : (n_parts,) array
        Sum to one.
    parts : tuple of Student
    """

    weights: FloatArray
    parts: tuple[Student, ...]

    @classmethod
    def with_covariance(cls, centre: FloatArray, covariance: FloatArray) -> Proposal:
        """One Student distribution of that mean and covariance."""
        shrink = (DEGREES_OF_FREEDOM - 2.0) / DEGREES_OF_FREEDOM
        return cls(np.ones(1), (Student.with_scale(centre, shrink * covariance),))

    @classmethod
    def one_fitted(cls, draws: FloatArray) -> Proposal:
        """The Student distribution with the mean and covariance of (..., n_dim) draws."""
        flat = draws.reshape(-1, draws.shape[-1])
        return cls.with_covariance(flat.mean(axis=0), np.cov(flat.T).reshape(flat.shape[1], flat.shape[1]))

    @classmethod
    def fitted(cls, draws: FloatArray) -> Proposal:
        """The mixture of greatest likelihood, nearly, for (..., n_dim) draws; fewer parts where the draws are few.

        Started from the draws in order of their distance from the mean, in as many shells as there are parts: what one
        ellipsoid misses first is how the density falls off, so the start needs no random numbers.
        """
        flat = draws.reshape(-1, draws.shape[-1])
        flat = flat[:: -(-len(flat) // _MOST_FITTED)]
        n_dim = flat.shape[1]
        n_parts = min(N_PARTS, len(flat) // (_DRAWS_PER_NUMBER * n_dim * (n_dim + 3) // 2))
        whole = cls.one_fitted(flat)
        if n_parts < 2:
            return whole
        floor = _FLOOR * np.cov(flat.T).reshape(n_dim, n_dim)
        order = np.argsort(np.argsort(whole.parts[0].squared_distances(flat)))
        shares = np.eye(n_parts)[order * n_parts // len(flat)].T * 0.9 + 0.1 / n_parts
        mixture, pulls = whole, np.ones_like(shares)
        for _ in range(_N_PASSES):
            mixture = cls._of_shares(flat, shares, pulls, floor)
            logs = np.stack([part.log_density(flat) for part in mixture.parts]) + np.log(mixture.weights)[:, None]
            shares = np.exp(logs - np.logaddexp.reduce(logs, axis=0))
            distances = np.stack([part.squared_distances(flat) for part in mixture.parts])
            pulls = (DEGREES_OF_FREEDOM + n_dim) / (DEGREES_OF_FREEDOM + distances)
        return mixture

    @classmethod
    def _of_shares(cls, flat: FloatArray, shares: FloatArray, pulls: FloatArray, floor: FloatArray) -> Proposal:
        """The mixture of greatest likelihood given which part each draw belongs to, in (n_parts, n_draws) shares."""
        parts = []
        for share, weight in zip(shares, shares * pulls, strict=True):
            centre = weight @ flat / weight.sum()
            away = flat - centre
            parts.append(Student.with_scale(centre, (weight[:, None] * away).T @ away / share.sum() + floor))
        return cls(shares.mean(axis=1), tuple(parts))

    def log_density(self, points: FloatArray) -> FloatArray:
        """Logarithm of the density: (...) array from (..., n_dim) points."""
        if len(self.parts) == 1:
            return self.parts[0].log_density(points)
        logs = [np.log(w) + part.log_density(points) for w, part in zip(self.weights, self.parts, strict=True)]
        return np.asarray(np.logaddexp.reduce(logs, axis=0))

    def points(self, n_points: int, rng: np.random.Generator) -> FloatArray:
        """Draws: (n_points, n_dim) array."""
        n_dim = self.parts[0].centre.size
        normal = rng.standard_normal((n_points, n_dim))
        normal *= np.sqrt(DEGREES_OF_FREEDOM / rng.chisquare(DEGREES_OF_FREEDOM, n_points))[:, None]
        chosen = np.searchsorted(np.cumsum(self.weights)[:-1], rng.random(n_points), side="right")
        result = np.empty_like(normal)
        for i, part in enumerate(self.parts):
            own = chosen == i
            result[own] = part.centre + normal[own] @ part.factor.T
        return result
