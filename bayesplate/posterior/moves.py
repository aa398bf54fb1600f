"""How walkers move: half the steps by differences within the ensemble, half by independent proposals.

A posterior of a plate is close to normal, and nearly known before sampling. Proposals drawn from a Student distribution
that was fitted to the warm-up are accepted about every other time and forget everything, so the autocorrelation time
falls from 60 steps to a handful; the moves by differences keep what the proposal does not know, curvature and tails, in
reach. The proposal is fixed once the warm-up ends, and the warm-up is discarded: both moves then leave the posterior
unchanged.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

INDEPENDENT_SHARE = 0.5
DIFFERENTIAL_SHARE = 0.4
STRETCH_SHARE = 0.1
DEGREES_OF_FREEDOM = 6.0
"""Of the proposal: heavier tails than the posterior's, or walkers far out would stay there."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """A multivariate Student distribution to propose from.

    Attributes
    ----------
    centre : (n_dim,) array
    factor : (n_dim, n_dim) array
        Lower Cholesky factor of the scale matrix.
    """

    centre: FloatArray
    factor: FloatArray

    @classmethod
    def with_covariance(cls, centre: FloatArray, covariance: FloatArray) -> Proposal:
        """The Student distribution of that mean and covariance."""
        scale = np.sqrt(np.diagonal(covariance))
        correlation = covariance / np.outer(scale, scale)
        shrink = np.sqrt((DEGREES_OF_FREEDOM - 2.0) / DEGREES_OF_FREEDOM)
        return cls(centre, shrink * scale[:, None] * np.linalg.cholesky(correlation + 1e-10 * np.eye(centre.size)))

    @classmethod
    def fitted(cls, draws: FloatArray) -> Proposal:
        """The Student distribution with the mean and covariance of (..., n_dim) draws."""
        flat = draws.reshape(-1, draws.shape[-1])
        return cls.with_covariance(flat.mean(axis=0), np.cov(flat.T).reshape(flat.shape[1], flat.shape[1]))

    @cached_property
    def whitening(self) -> FloatArray:
        """Inverse of the factor, transposed; a triangular solve at each step would wake threads that cost ten steps."""
        return np.asarray(np.linalg.inv(self.factor).T, dtype=np.float64)

    def log_density(self, points: FloatArray) -> FloatArray:
        """Logarithm of the density up to a constant: (n_points,) array."""
        z = (points - self.centre) @ self.whitening
        n_dim = self.centre.size
        return -0.5 * (DEGREES_OF_FREEDOM + n_dim) * np.log1p(np.sum(z**2, axis=1) / DEGREES_OF_FREEDOM)

    def __call__(self, coords: FloatArray, random: Any) -> tuple[FloatArray, FloatArray]:
        """Propose for all walkers, as emcee's Metropolis-Hastings move asks: points, and log of the proposal ratio."""
        normal = random.standard_normal(coords.shape)
        chi_square = random.chisquare(DEGREES_OF_FREEDOM, coords.shape[0])
        points = self.centre + (normal @ self.factor.T) * np.sqrt(DEGREES_OF_FREEDOM / chi_square)[:, None]
        return points, self.log_density(coords) - self.log_density(points)


def moves(proposal: Proposal) -> Sequence[tuple[Any, float]]:
    """The moves of an emcee sampler with their shares.

    emcee's snooker move is left out on purpose: up to release 3.1.6 it breaks detailed balance (its unit vector is not
    one) and, as a fifth of the steps, it made the standard deviations of a normal target 1 to 3 % too small.
    """
    import emcee

    return [
        (emcee.moves.MHMove(proposal), INDEPENDENT_SHARE),
        (emcee.moves.DEMove(), DIFFERENTIAL_SHARE),
        (emcee.moves.StretchMove(), STRETCH_SHARE),
    ]
