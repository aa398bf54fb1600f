"""The boards' marginal likelihoods multiplied: what all of them, or all but one, say of the shared parameters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.campaigns.shared import Shared
from bayesplate.campaigns.space import Pull, Space
from bayesplate.diagnosis.evidence.terms import log_sum
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample

Floats = NDArray[np.float64]

_EXCLUDED = 60.0
"""How far below a board's lowest finite node an excluded one is taken to be, so that it can be interpolated."""
_DEEPEST = 2000.0
"""Log likelihoods that far below a board's highest are all the same: nothing comes from there, and splines ring."""


@dataclass(frozen=True, eq=False)
class Together:
    """Boards that are independent given the shared parameters.

    Attributes
    ----------
    shared : tuple of Shared
    space : Space
    names : tuple of str
        Of the boards.
    at_nodes : (n_boards, n_nodes) array
        ln of each board's marginal likelihood.
    pulls : tuple of Pull
        What each board says by itself, as a normal likelihood.
    """

    shared: tuple[Shared, ...]
    space: Space
    names: tuple[str, ...]
    at_nodes: Floats
    pulls: tuple[Pull, ...]

    @cached_property
    def _splines(self) -> list[Any]:
        from scipy.interpolate import RegularGridInterpolator

        axes = (self.space.axis,) * self.space.n_shared
        shape = tuple(axis.size for axis in axes)
        return [
            RegularGridInterpolator(axes, _finite(values).reshape(shape), method="cubic", bounds_error=False)
            for values in self.at_nodes
        ]

    def log_likelihoods(self, u: Floats) -> Floats:
        """ln of each board's marginal likelihood at places of the box: (n_boards, n) array; -inf outside the box."""
        found = np.stack([spline(u) for spline in self._splines])
        found[:, ~self.space.is_inside(u)] = -np.inf
        return found

    def log_prior(self, u: Floats) -> Floats:
        """ln of the prior density of the standard coordinates: (n,) array."""
        z = self.space.z(u)
        return np.sum([one.prior.log_prior(z[:, i]) for i, one in enumerate(self.shared)], axis=0)

    @cached_property
    def _fine(self) -> tuple[Floats, Floats]:
        """ln likelihood of each board, and ln prior, at the fine places."""
        return self.log_likelihoods(self.space.fine), self.log_prior(self.space.fine)

    def log_evidence(self, without: Collection[int] = ()) -> float:
        """ln of the probability of the readings of all boards but some."""
        return float(log_sum(self._log_density(without)) + self.space.log_cell)

    def weights(self, without: Collection[int] = ()) -> Floats:
        """Posterior probability of each fine place from all boards but some: (n_fine,) array that sums to 1."""
        log_density = self._log_density(without)
        shares = np.exp(log_density - log_density.max())
        return np.asarray(shares / shares.sum())

    def moments(self, without: Collection[int] = ()) -> tuple[Floats, Floats]:
        """Mean and covariance of the standard coordinates from all boards but some."""
        z, weights = self.space.z(self.space.fine), self.weights(without)
        mean = weights @ z
        return mean, (weights[:, None] * (z - mean)).T @ (z - mean)

    def rim(self, without: Collection[int] = ()) -> float:
        """Posterior probability of the outermost shell of the box: what lies beyond it is left out."""
        outer = np.abs(self.space.fine).max(axis=1) > 0.97 * self.space.axis[-1]
        return float(self.weights(without)[outer].sum())

    def draws(self, rng: np.random.Generator, n: int, without: Collection[int] = ()) -> Floats:
        """Standard coordinates drawn from the posterior of all boards but some: (n, n_shared) array."""
        picked = rng.choice(len(self.space.fine), size=n, p=self.weights(without))
        step = 2.0 * self.space.axis[-1] / (round(len(self.space.fine) ** (1.0 / self.space.n_shared)) - 1)
        within = rng.uniform(-0.5 * step, 0.5 * step, (n, self.space.n_shared))
        return self.space.z(np.clip(self.space.fine[picked] + within, -self.space.axis[-1], self.space.axis[-1]))

    def _log_density(self, without: Collection[int]) -> Floats:
        boards, prior = self._fine
        kept = [i for i in range(len(boards)) if i not in without]
        return np.asarray(boards[kept].sum(axis=0) + prior)

    def log_posterior(self, u: Floats) -> Floats:
        """ln of the posterior density from all boards, but for a constant: (n,) array."""
        inside = self.space.is_inside(u)
        total = np.full(len(u), -np.inf)
        if inside.any():
            total[inside] = self.log_likelihoods(u[inside]).sum(axis=0) + self.log_prior(u[inside])
        return total


def walk(
    together: Together, settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> tuple[Chains, Convergence]:
    """Sample the shared parameters from all boards.

    Returns
    -------
    chains : Chains
        Of standard coordinates.
    convergence : Convergence
    """
    space = together.space
    mean, covariance = together.moments()
    inverse = np.linalg.inv(space.factor)
    chains, convergence = sample(
        together.log_posterior,
        space.u(mean[None, :])[0],
        inverse @ covariance @ inverse.T,
        settings,
        names=[one.name for one in together.shared],
        progress=progress,
    )
    shape = chains.draws.shape
    z = space.z(chains.draws.reshape(-1, shape[-1])).reshape(shape)
    return Chains(z, chains.log_prob, chains.burn_in), convergence


def values_of(shared: Sequence[Shared], z: Floats) -> dict[str, Floats]:
    """The shared numbers by name, SI, from (..., n_shared) standard coordinates: (...) arrays."""
    return {one.name: np.asarray(one.prior.value(z[..., i])) for i, one in enumerate(shared)}


def _finite(values: Floats) -> Floats:
    finite = np.isfinite(values)
    if not finite.any():
        return np.zeros_like(values)
    lowest, highest = values[finite].min(), values[finite].max()
    return np.maximum(np.where(finite, values, lowest - _EXCLUDED), highest - _DEEPEST)
