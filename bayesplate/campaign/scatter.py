"""Shared numbers that scatter between boards: a board's likelihood of their middle and of their scatter.

A board's own numbers are normal about the middle in standard coordinates, z_i = z + t e_i with e_i of unit spread, so
that the probability of its readings given z and t is

    integral of  L_i(z + t e) N(e; 0, 1)  over e,

with L_i the likelihood of its own numbers. The normal likelihood that approximates L_i gives the place and the width of
the integrand; Gauss-Hermite nodes are placed there, and the deviation of L_i from the normal is summed over them.

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
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.campaign.shared import SharedParameter
from bayesplate.diagnosis.terms import log_sum

_N_NODES = {1: 9, 2: 7, 3: 5}
"""Nodes along each direction, by the number of directions."""
_ROWS_AT_ONCE = 4096


@dataclass(frozen=True)
class Scatter:
    """Scatter of a shared number between boards: the standard deviation of its logarithm, with a half-normal prior."""

    of: SharedParameter

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


def scatters_of(shared: Sequence[SharedParameter]) -> tuple[Scatter, ...]:
    """Scatters of the numbers that differ between boards, in their order."""
    return tuple(Scatter(parameter) for parameter in shared if parameter.scatter)


def scatter_widths(shared: Sequence[SharedParameter], hyper: Floats) -> Floats:
    """Standard deviation of each number between boards, in its standard coordinate: (n, n_shared) array, zero where it
    does not scatter.

    `hyper` are standard coordinates of the numbers, then of their scatters: (n, n_shared + n_scatters) array.
    """
    width = np.zeros((len(hyper), len(shared)))
    columns = [i for i, parameter in enumerate(shared) if parameter.scatter]
    for i, column in enumerate(columns):
        width[:, column] = Scatter(shared[column]).width(hyper[:, len(shared) + i])
    return width


def expected_width(shared: Sequence[SharedParameter]) -> Floats:
    """`scatter_widths` at the prior median of each scatter: (n_shared,) array."""
    medians = np.array(
        [[*np.zeros(len(shared)), *(scatter.prior.standard_quantile(0.5) for scatter in scatters_of(shared))]]
    )
    return np.asarray(scatter_widths(shared, medians)[0])


@dataclass(frozen=True, eq=False)
class ScatteredLikelihood:
    """ln of the probability of a board's readings as a function of the numbers' middle and of their scatter."""

    shared: tuple[SharedParameter, ...]
    board_likelihood: Likelihood  # the board's likelihood of its own numbers
    normal_likelihood: NormalLikelihood  # its normal approximation

    def at(self, hyper: Floats) -> Floats:
        """ln L at standard coordinates of numbers and scatters: (n,) array from (n, n_shared + n_scatters)."""
        n_parts = -(-len(hyper) // _ROWS_AT_ONCE)
        return np.concatenate([self._at(part) for part in np.array_split(hyper, max(n_parts, 1))])

    def _at(self, hyper: Floats) -> Floats:
        middle, width = hyper[:, : len(self.shared)], scatter_widths(self.shared, hyper)
        scatter_columns = np.flatnonzero([bool(parameter.scatter) for parameter in self.shared])
        n, k = len(hyper), scatter_columns.size
        t = width[:, scatter_columns]
        precision = (
            np.eye(k)
            + t[:, :, None] * self.normal_likelihood.precision[np.ix_(scatter_columns, scatter_columns)] * t[:, None, :]
        )
        slope = (
            t
            * (self.normal_likelihood.precision_times_mode - middle @ self.normal_likelihood.precision)[
                :, scatter_columns
            ]
        )
        factor = np.linalg.cholesky(precision)
        back = np.linalg.inv(factor)  # precision = factor factor', so that e = peak + back' x has it with unit x
        peak = np.einsum("nji,nj->ni", back, np.einsum("nij,nj->ni", back, slope))
        x, log_weights = _quadrature_nodes(k)
        e = peak[:, None, :] + np.einsum("nji,qj->nqi", back, x)
        z = np.repeat(middle[:, None, :], len(x), axis=1)
        z[:, :, scatter_columns] += t[:, None, :] * e
        log_likelihood = self.board_likelihood.at(z.reshape(-1, middle.shape[1])).reshape(n, len(x)).T
        change = (log_weights + 0.5 * (x**2).sum(axis=1))[:, None] - 0.5 * (e**2).sum(axis=2).T
        log_det = np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1)
        return log_sum(log_likelihood + change) - log_det


def _quadrature_nodes(k: int) -> tuple[Floats, Floats]:
    """Nodes of a standard normal in k directions and ln of their weights: (n, k) and (n,) arrays."""
    nodes, weights = hermegauss(_N_NODES[k])
    x = np.stack(np.meshgrid(*[nodes] * k, indexing="ij"), axis=-1).reshape(-1, k)
    log_weights = np.stack(np.meshgrid(*[np.log(weights / weights.sum())] * k, indexing="ij"), axis=-1)
    return x, log_weights.reshape(-1, k).sum(axis=1)
