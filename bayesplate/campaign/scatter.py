"""Numbers that scatter between boards: what a board says of their middle and of how much they scatter.

A board's own numbers are normal about the middle in standard coordinates, z_i = z + t e_i with e_i of unit spread, so
that its readings have under z and t the probability

    integral of  L_i(z + t e) N(e; 0, 1)  over e,

L_i being its likelihood of its own numbers. The normal likelihood that L_i amounts to says where the integrand is and
how wide; Gauss and Hermite's nodes are laid there, and what is not normal about L_i is summed over them.

References
----------
J. C. Naylor and A. F. M. Smith, Applications of a method for the efficient computation of posterior distributions,
Applied Statistics 31 (1982).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial.hermite_e import hermegauss

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.campaign.likelihood import Likelihood
from bayesplate.campaign.pulls import Pull
from bayesplate.campaign.shared import Shared
from bayesplate.diagnosis.terms import log_sum

_NODES = {1: 9, 2: 7, 3: 5}
"""Along each direction, by the number of directions."""
_ROWS_AT_ONCE = 4096


@dataclass(frozen=True)
class Scatter:
    """How much a shared number differs between boards: the standard deviation of its logarithm, half-normal before."""

    of: Shared

    @property
    def name(self) -> str:
        """The name in results: "transverse_shear.G_xz / E_x scatter"."""
        return f"{self.of.name} scatter"

    @property
    def prior(self) -> Quantity:
        """The prior of the standard deviation of the logarithm; its standard coordinate is what is sampled."""
        return Quantity.from_mean(0.0, self.of.scatter, "normal", lower=0.0)

    @property
    def unit(self) -> str:
        return "1"

    def width(self, u: Floats) -> Floats:
        """Standard deviation of the number's own standard coordinate: (n,) array; zero below the bound."""
        return np.asarray(np.maximum(self.prior.value(u), 0.0) / self.of.prior.log_sd)


def scatters_of(shared: Sequence[Shared]) -> tuple[Scatter, ...]:
    """Scatters of the numbers that differ between boards, in their order."""
    return tuple(Scatter(one) for one in shared if one.scatter)


def widths(shared: Sequence[Shared], hyper: Floats) -> Floats:
    """How much each number scatters, in its standard coordinate: (n, n_shared) array, zero where it does not.

    `hyper` are standard coordinates of the numbers, then of their scatters: (n, n_shared + n_scatters) array.
    """
    found = np.zeros((len(hyper), len(shared)))
    columns = [i for i, one in enumerate(shared) if one.scatter]
    for i, column in enumerate(columns):
        found[:, column] = Scatter(shared[column]).width(hyper[:, len(shared) + i])
    return found


def expected_width(shared: Sequence[Shared]) -> Floats:
    """What `widths` gives at the median of each scatter before any board: (n_shared,) array."""
    medians = np.array([[*np.zeros(len(shared)), *(one.prior.standard_quantile(0.5) for one in scatters_of(shared))]])
    return np.asarray(widths(shared, medians)[0])


@dataclass(frozen=True, eq=False)
class ScatteredLikelihood:
    """ln of the probability of a board's readings as a function of the numbers' middle and of their scatter."""

    shared: tuple[Shared, ...]
    own: Likelihood  # the board's, of its own numbers
    pull: Pull  # the normal one that it amounts to

    def at(self, hyper: Floats) -> Floats:
        """ln L at standard coordinates of numbers and scatters: (n,) array from (n, n_shared + n_scatters)."""
        n_parts = -(-len(hyper) // _ROWS_AT_ONCE)
        return np.concatenate([self._at(part) for part in np.array_split(hyper, max(n_parts, 1))])

    def _at(self, hyper: Floats) -> Floats:
        middle, width = hyper[:, : len(self.shared)], widths(self.shared, hyper)
        moving = np.flatnonzero([bool(one.scatter) for one in self.shared])
        n, k = len(hyper), moving.size
        t = width[:, moving]
        precision = np.eye(k) + t[:, :, None] * self.pull.precision[np.ix_(moving, moving)] * t[:, None, :]
        slope = t * (self.pull.lean - middle @ self.pull.precision)[:, moving]
        factor = np.linalg.cholesky(precision)
        back = np.linalg.inv(factor)  # precision = factor factor', so that e = peak + back' x has it where x has unity
        peak = np.einsum("nji,nj->ni", back, np.einsum("nij,nj->ni", back, slope))
        x, log_weights = _nodes(k)
        e = peak[:, None, :] + np.einsum("nji,qj->nqi", back, x)
        at = np.repeat(middle[:, None, :], len(x), axis=1)
        at[:, :, moving] += t[:, None, :] * e
        log_likelihood = self.own.at(at.reshape(-1, middle.shape[1])).reshape(n, len(x)).T
        change = (log_weights + 0.5 * (x**2).sum(axis=1))[:, None] - 0.5 * (e**2).sum(axis=2).T
        log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        return log_sum(log_likelihood + change) - log_det


def _nodes(k: int) -> tuple[Floats, Floats]:
    """Nodes of a standard normal in k directions and ln of their weights: (n, k) and (n,) arrays."""
    places, weights = hermegauss(_NODES[k])
    x = np.stack(np.meshgrid(*[places] * k, indexing="ij"), axis=-1).reshape(-1, k)
    log_weights = np.stack(np.meshgrid(*[np.log(weights / weights.sum())] * k, indexing="ij"), axis=-1)
    return x, log_weights.reshape(-1, k).sum(axis=1)
