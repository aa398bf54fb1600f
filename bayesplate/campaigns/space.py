"""Where the nodes of the shared parameters stand: around all that the boards together, or all but one, find likely."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_NODES = {1: 17, 2: 11, 3: 7}
_FINE = {1: 1601, 2: 121, 3: 41}
"""Points along an axis: of the nodes, and of the sums over what is interpolated between them."""
_REACH = 4.5


@dataclass(frozen=True, eq=False)
class Pull:
    """What a board's likelihood of the shared parameters amounts to as a normal one: exp(h'z - z'Pz / 2).

    Attributes
    ----------
    precision : (n_shared, n_shared) array
        P, positive semi-definite.
    lean : (n_shared,) array
        h = P times where it is highest.
    """

    precision: Floats
    lean: Floats

    @classmethod
    def of_draws(cls, z: Floats, weights: Floats | None = None) -> Pull:
        """From (n, n_shared) draws of the board's own posterior, whose prior of z is standard normal.

        A posterior that is wider than the prior in a direction says nothing there.
        """
        n = z.shape[1]
        mean = np.average(z, axis=0, weights=weights)
        after = np.linalg.inv(np.cov(z.T, aweights=weights).reshape(n, n))
        gained, directions = np.linalg.eigh(after - np.eye(n))
        told = (directions * np.maximum(gained, 0.0)) @ directions.T
        return cls(told, (directions * (gained > 0.0)) @ directions.T @ after @ mean)


@dataclass(frozen=True, eq=False)
class Space:
    """A box in standard coordinates z = middle + factor u, u within +- 4.5 along each axis.

    Attributes
    ----------
    middle : (n_shared,) array
    factor : (n_shared, n_shared) array
    """

    middle: Floats
    factor: Floats

    @classmethod
    def around(cls, pulls: Sequence[Pull]) -> Space:
        """Around the posterior from all boards and from all but each, the prior being standard normal."""
        n = pulls[0].lean.size
        total = np.eye(n) + np.sum([one.precision for one in pulls], axis=0)
        lean = np.sum([one.lean for one in pulls], axis=0)
        kept = [(total, lean), *((total - one.precision, lean - one.lean) for one in pulls)]
        covariances = [np.linalg.inv(precision) for precision, _ in kept]
        means = [covariance @ each for covariance, (_, each) in zip(covariances, kept, strict=True)]
        return cls.of_moments(means, covariances)

    @classmethod
    def of_moments(cls, means: Sequence[Floats], covariances: Sequence[Floats]) -> Space:
        """Around several normal distributions: where most of each of them is."""
        middle = np.mean(means, axis=0)
        apart = [np.outer(mean - middle, mean - middle) for mean in means]
        spread = np.mean(covariances, axis=0) + np.mean(apart, axis=0)
        widest = np.max([np.diagonal(one + two) for one, two in zip(covariances, apart, strict=True)], axis=0)
        grow = np.sqrt(widest / np.diagonal(spread))  # one board that stands apart from many is not averaged away
        grow = np.clip(grow, 1.0, 2.0)
        return cls(middle, np.linalg.cholesky(spread * np.outer(grow, grow)))

    @property
    def n_shared(self) -> int:
        """Number of shared parameters."""
        return int(self.middle.size)

    def z(self, u: Floats) -> Floats:
        """Standard coordinates of points of the box: (n, n_shared) arrays."""
        return self.middle + u @ self.factor.T

    def u(self, z: Floats) -> Floats:
        """Places in the box of standard coordinates: the inverse of `z`."""
        return np.asarray(np.linalg.solve(self.factor, (z - self.middle).T).T)

    @cached_property
    def axis(self) -> Floats:
        """Coordinates of the nodes along each axis: (n,) array."""
        return np.linspace(-_REACH, _REACH, _NODES[self.n_shared])

    @cached_property
    def nodes(self) -> Floats:
        """Standard coordinates of the nodes, the last axis running fastest: (n_nodes, n_shared) array."""
        return self.z(np.array(list(product(self.axis, repeat=self.n_shared))))

    @cached_property
    def fine(self) -> Floats:
        """Places in the box at which what is interpolated is summed: (n_fine, n_shared) array."""
        axis = np.linspace(-_REACH, _REACH, _FINE[self.n_shared])
        return np.array(list(product(axis, repeat=self.n_shared)))

    @property
    def log_cell(self) -> float:
        """ln of the volume of z that each of the fine places stands for."""
        step = 2.0 * _REACH / (_FINE[self.n_shared] - 1)
        return float(self.n_shared * np.log(step) + np.linalg.slogdet(self.factor)[1])

    def is_inside(self, u: Floats) -> NDArray[np.bool_]:
        """Whether places are in the box: (n,) array."""
        return np.asarray((np.abs(u) <= _REACH).all(axis=1))
