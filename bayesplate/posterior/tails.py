"""Coordinates that shorten long tails: the logarithm of a rigidity near the estimate, the logarithm of that far away.

Where the data hardly tell a constant, the density of its logarithm has a level tail many standard errors long: below
some stiffness the frequencies no longer depend on it and only the prior is left. An ensemble crosses such a tail by
diffusion, a hundred autocorrelation times for one per cent of the probability. With ln D = centre + scale sinh(y) the
tail is a few units of y long, the middle is as before, and the Jacobian keeps the density the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_SCALE_IN_SDS = 1.5
_FARTHEST = 60.0
"""A rigidity e^60 times the estimate is outside every prior; beyond it sinh would overflow."""


@dataclass(frozen=True, eq=False)
class TailCoordinates:
    """Map between theta and the coordinates y that are sampled; only the first columns, the rigidities, change.

    Attributes
    ----------
    centre : (n_dim,) array
        theta of the estimate.
    scale : (n_changed,) array
    """

    centre: Floats
    scale: Floats

    @classmethod
    def around(cls, centre: Floats, covariance: Floats, n_changed: int) -> TailCoordinates:
        """Coordinates fit for a normal approximation of the posterior."""
        return cls(centre, _SCALE_IN_SDS * np.sqrt(np.diagonal(covariance))[:n_changed])

    @property
    def start(self) -> Floats:
        """The estimate in y: (n_dim,) array."""
        y = self.centre.copy()
        y[: self.scale.size] = 0.0
        return y

    def start_covariance(self, covariance: Floats) -> Floats:
        """Covariance in y, to first order at the estimate: (n_dim, n_dim) array."""
        factor = np.ones(self.centre.size)
        factor[: self.scale.size] = 1.0 / self.scale
        return covariance * np.outer(factor, factor)

    def theta(self, y: Floats) -> Floats:
        """theta from (..., n_dim) y, of the same shape."""
        n = self.scale.size
        return np.concatenate([self.centre[:n] + self.scale * np.sinh(y[..., :n]), y[..., n:]], axis=-1)

    def log_jacobian(self, y: Floats) -> Floats:
        """ln |d theta / d y| of (..., n_dim) y: (...) array."""
        return np.asarray(np.log(self.scale * np.cosh(y[..., : self.scale.size])).sum(axis=-1))

    def density(self, log_density: Callable[[Floats], Floats]) -> Callable[[Floats], Floats]:
        """Log density of y from that of theta, both vectorised: (n_draws, n_dim) -> (n_draws,)."""
        n = self.scale.size
        limit = np.arcsinh(_FARTHEST / self.scale)

        def transformed(y: Floats) -> Floats:
            near = np.all(np.abs(y[:, :n]) < limit, axis=1)
            result = np.full(y.shape[0], -np.inf)
            if near.any():
                result[near] = log_density(self.theta(y[near])) + self.log_jacobian(y[near])
            return result

        return transformed
