"""A mixture of Student distributions, fitted to draws: the distribution of independent proposals.

The posterior of a plate is nearly normal given the noise, and wider for a larger noise: one ellipsoid fits it only
roughly, a few fit it well. Proposals from a mixture of four are accepted seven times out of ten where those from one
Student distribution are accepted five times, and the autocorrelation time is half as long.

References
----------
D. Peel and G. J. McLachlan, Robust mixture modelling using the t distribution, Statistics and Computing 10 (2000).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import lgamma

import numpy as np

from bayesplate.arrays import Floats

DEGREES_OF_FREEDOM = 6.0
"""Degrees of freedom of each part: with lighter tails than the posterior's, distant walkers would not move."""
N_PARTS = 4
_N_PASSES = 15
_FEWEST_PER_NUMBER, _MOST_PER_NUMBER = 10, 200
"""Draws for each number in a part's mean and covariance: fewer would fit single walkers, more would only add time."""
_FLOOR = 1e-3
"""Share of the covariance of all draws added to that of each part, so that none shrinks to a point."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """A mixture of Student distributions."""

    weights: Floats  # (n_parts,), sum to one
    centres: Floats  # (n_parts, n_dim)
    factors: Floats  # (n_parts, n_dim, n_dim), lower Cholesky factors of the scale matrices

    @classmethod
    def with_covariance(cls, centre: Floats, covariance: Floats) -> Mixture:
        """One Student distribution of that mean and covariance."""
        shrink = (DEGREES_OF_FREEDOM - 2.0) / DEGREES_OF_FREEDOM
        return cls(np.ones(1), centre[None], _cholesky(shrink * covariance)[None])

    @classmethod
    def fitted_single(cls, draws: Floats) -> Mixture:
        """The Student distribution with the mean and covariance of (..., n_dim) draws."""
        flat = draws.reshape(-1, draws.shape[-1])
        return cls.with_covariance(flat.mean(axis=0), np.cov(flat.T).reshape(flat.shape[1], flat.shape[1]))

    @classmethod
    def fitted(cls, draws: Floats) -> Mixture:
        """Nearly the mixture of greatest likelihood for (..., n_dim) draws; with fewer parts where the draws are few.

        The parts start as shells of draws by distance from the mean: the fall of the density is the first thing that
        one ellipsoid misses, and such a start needs no random numbers.
        """
        flat = draws.reshape(-1, draws.shape[-1])
        n_dim = flat.shape[1]
        n_numbers = n_dim * (n_dim + 3) // 2
        flat = flat[:: -(-len(flat) // (_MOST_PER_NUMBER * n_numbers))]
        n_parts = min(N_PARTS, len(flat) // (_FEWEST_PER_NUMBER * n_numbers))
        mixture = cls.fitted_single(flat)
        if n_parts < 2:
            return mixture
        floor = _FLOOR * np.cov(flat.T).reshape(n_dim, n_dim)
        order = np.argsort(np.argsort(mixture.squared_distances(flat)[0]))
        shares = np.eye(n_parts)[order * n_parts // len(flat)].T * 0.9 + 0.1 / n_parts
        pulls = np.ones_like(shares)
        for _ in range(_N_PASSES):
            mixture = cls._from_shares(flat, shares, pulls, floor)
            distances = mixture.squared_distances(flat)
            logs = mixture._log_shares(distances)
            shares = np.exp(logs - np.logaddexp.reduce(logs, axis=0))
            pulls = (DEGREES_OF_FREEDOM + n_dim) / (DEGREES_OF_FREEDOM + distances)
        return mixture

    @classmethod
    def _from_shares(cls, flat: Floats, shares: Floats, pulls: Floats, floor: Floats) -> Mixture:
        """The mixture of greatest likelihood given the (n_parts, n_draws) shares of each draw in the parts."""
        centres, factors = [], []
        for share, weight in zip(shares, shares * pulls, strict=True):
            centres.append(weight @ flat / weight.sum())
            deviations = flat - centres[-1]
            factors.append(_cholesky((weight[:, None] * deviations).T @ deviations / share.sum() + floor))
        return cls(shares.mean(axis=1), np.stack(centres), np.stack(factors))

    def widened(self, factor: float) -> Mixture:
        """Half this mixture and half the same one `factor` times as wide."""
        factors = np.concatenate([self.factors, factor * self.factors])
        return Mixture(np.tile(0.5 * self.weights, 2), np.tile(self.centres, (2, 1)), factors)

    @cached_property
    def _whitenings(self) -> Floats:
        """Inverses of the factors, transposed: a solve at each step would start threads that cost ten steps."""
        return np.swapaxes(np.linalg.inv(self.factors), 1, 2)

    @cached_property
    def _log_peaks(self) -> Floats:
        """Logarithm of each part's density at its centre, times its weight: (n_parts,) array."""
        n_dim, nu = self.centres.shape[1], DEGREES_OF_FREEDOM
        log_volumes = np.log(np.diagonal(self.factors, axis1=1, axis2=2)).sum(axis=1)
        log_constant = lgamma(0.5 * (nu + n_dim)) - lgamma(0.5 * nu) - 0.5 * n_dim * np.log(nu * np.pi)
        return np.log(self.weights) + log_constant - log_volumes

    def squared_distances(self, points: Floats) -> Floats:
        """Squared Mahalanobis distances in units of the scale matrices: (n_parts, n) array from (n, n_dim) points."""
        z = (points - self.centres[:, None]) @ self._whitenings
        return np.einsum("kni,kni->kn", z, z)

    def _log_shares(self, distances: Floats) -> Floats:
        """Logarithm of each part's contribution to the density, from squared distances: (n_parts, n) array."""
        power = 0.5 * (DEGREES_OF_FREEDOM + self.centres.shape[1])
        return np.asarray(self._log_peaks[:, None] - power * np.log1p(distances / DEGREES_OF_FREEDOM))

    def log_density(self, points: Floats) -> Floats:
        """Logarithm of the density: (...) array from (..., n_dim) points."""
        logs = self._log_shares(self.squared_distances(points.reshape(-1, points.shape[-1])))
        return np.asarray(np.logaddexp.reduce(logs, axis=0)).reshape(points.shape[:-1])

    def points(self, n_points: int, rng: np.random.Generator | np.random.RandomState) -> Floats:
        """Draws: (n_points, n_dim) array."""
        normal = rng.standard_normal((n_points, self.centres.shape[1]))
        normal *= np.sqrt(DEGREES_OF_FREEDOM / rng.chisquare(DEGREES_OF_FREEDOM, n_points))[:, None]
        chosen = np.searchsorted(np.cumsum(self.weights)[:-1], rng.uniform(size=n_points), side="right")
        result = np.empty_like(normal)
        for i, (centre, factor) in enumerate(zip(self.centres, self.factors, strict=True)):
            is_chosen = chosen == i
            result[is_chosen] = centre + normal[is_chosen] @ factor.T
        return result


def _cholesky(scale_matrix: Floats) -> Floats:
    """Lower Cholesky factor of a scale matrix, whatever the units of the parameters: (n_dim, n_dim) array."""
    scale = np.sqrt(np.diagonal(scale_matrix))
    correlation = scale_matrix / np.outer(scale, scale)
    return np.asarray(scale[:, None] * np.linalg.cholesky(correlation + 1e-10 * np.eye(scale.size)))
