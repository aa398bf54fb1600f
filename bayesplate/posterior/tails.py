"""Coordinates that shorten long tails: a parameter itself near the estimate, its logarithm far away.

Where the data hardly determine a constant, the density of its logarithm has a flat tail many standard errors long:
below some stiffness the frequencies no longer depend on it and only the prior remains. An ensemble crosses such a tail
by diffusion, a hundred autocorrelation times for one per cent of the probability. With ln D = centre + scale sinh(y)
the tail is a few units of y long, the middle is unchanged, and the Jacobian keeps the density the same.

The parameters of effects have such tails too: readings that give a mass of 2 g within a factor of 1.5 leave a few per
cent of the probability to all lighter masses that the prior allows, for below some mass none changes the frequencies.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Bools, Floats, Indices
from bayesplate.posterior.starts import LogDensity

_SCALE_IN_SDS = 1.5
_EFFECT_SCALE_IN_SDS = 0.8
"""Smaller, as the tails of an effect's parameter are longer than a rigidity's: for the mass of a 2.5 g sensor on a free
board, the autocorrelation time falls from some 500 steps to 45 at a scale of 1.5 and to 22 at 0.8."""
_START_REACH = 3.0
_FARTHEST = 60.0
"""A rigidity e^60 times the estimate, or an input 60 sds away, is outside every prior; beyond, sinh would overflow."""


@dataclass(frozen=True, eq=False)
class TailCoordinates:
    """Map between the parameters theta and the sampled coordinates y."""

    centre: Floats  # (n_dim,), theta of the estimate
    scale: Floats  # (n_changed,)
    columns: Indices  # (n_changed,), the columns of theta that are changed; all others are the same in y
    shrink: Floats  # (n_changed,), standard deviation of the starts in y over that in theta: 1 / scale to first order

    @classmethod
    def around(
        cls, centre: Floats, covariance: Floats, rigidities: Sequence[int], effects: Sequence[int] = ()
    ) -> TailCoordinates:
        """Coordinates for a normal approximation of the posterior; `rigidities` and `effects` are columns of theta."""
        columns = np.array([*rigidities, *effects], dtype=np.intp)
        sds = np.sqrt(np.diagonal(covariance))[columns]
        in_sds = np.repeat([_SCALE_IN_SDS, _EFFECT_SCALE_IN_SDS], [len(rigidities), len(effects)])
        shrink = 1.0 / (in_sds * sds)
        # At first order, a narrow scale would start some walkers hundreds of standard deviations away.
        reach = np.arcsinh(_START_REACH / _EFFECT_SCALE_IN_SDS) / _START_REACH
        shrink[len(rigidities) :] = reach / sds[len(rigidities) :]
        return cls(centre, in_sds * sds, columns, shrink)

    @property
    def start(self) -> Floats:
        """The estimate in y: (n_dim,) array."""
        y = self.centre.copy()
        y[self.columns] = 0.0
        return y

    def start_covariance(self, covariance: Floats) -> Floats:
        """Covariance in y of starts around the estimate: (n_dim, n_dim) array."""
        factor = np.ones(self.centre.size)
        factor[self.columns] = self.shrink
        return covariance * np.outer(factor, factor)

    def theta(self, y: Floats) -> Floats:
        """theta from (..., n_dim) y, of the same shape."""
        theta = np.array(y)
        theta[..., self.columns] = self.centre[self.columns] + self.scale * np.sinh(y[..., self.columns])
        return theta

    def y(self, theta: Floats) -> Floats:
        """y from (..., n_dim) theta, of the same shape; the inverse of `theta`."""
        y = np.array(theta)
        y[..., self.columns] = np.arcsinh((theta[..., self.columns] - self.centre[self.columns]) / self.scale)
        return y

    def log_jacobian(self, y: Floats) -> Floats:
        """ln |d theta / d y| of (..., n_dim) y: (...) array."""
        return np.asarray(np.log(self.scale * np.cosh(y[..., self.columns])).sum(axis=-1))

    def is_near(self, y: Floats) -> Bools:
        """Whether (n_draws, n_dim) y are near enough for the map not to overflow; farther ones are in no prior."""
        return np.asarray(np.all(np.abs(y[:, self.columns]) < np.arcsinh(_FARTHEST / self.scale), axis=1))

    def density(self, log_density: LogDensity) -> LogDensity:
        """Log density of y from that of theta, both vectorised: (n_draws, n_dim) -> (n_draws,)."""

        def transformed(y: Floats) -> Floats:
            is_near = self.is_near(y)
            result = np.full(len(y), -np.inf)
            if is_near.any():
                result[is_near] = log_density(self.theta(y[is_near])) + self.log_jacobian(y[is_near])
            return result

        return transformed
