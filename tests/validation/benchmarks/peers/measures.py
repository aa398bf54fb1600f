"""How many draws a run is worth, by one rule for all, and how far its posterior is from that of quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from validation.benchmarks.peers.density import Density

from bayesplate.posterior.convergence import autocorrelation_times

N_SCALED, N_SHEAR, N_NOISE = 41, 161, 41


@dataclass(frozen=True, eq=False)
class Truth:
    """Means and standard deviations of theta: (4,) arrays."""

    mean: np.ndarray
    sd: np.ndarray


def quadrature(density: Density) -> Truth:
    """Moments by a sum over a grid: noise by noise, D_x and D_y as wide as that noise lets them be.

    A grid of half as many points more each way changes no moment by 1e-8.
    """
    sd = np.sqrt(np.diagonal(density.covariance))
    log_noise = density.centre[3] + np.linspace(-2.6, 4.5, N_NOISE)
    # Evenly in sinh: dense where the readings tell D_s, sparse far below, where the prior alone holds it.
    steps = np.linspace(-4.1, 2.6, N_SHEAR)
    log_shear = density.centre[2] + 0.4 * np.sinh(steps)
    shear_weight = 0.4 * np.cosh(steps)
    sums, means, squares = [], [], []
    for one in log_noise:
        wide = max(1.0, 1.2 * np.exp(one - density.centre[3]))
        sides = [density.centre[i] + sd[i] * wide * np.linspace(-7.0, 8.0, N_SCALED) for i in (0, 1)]
        cell = (sides[0][1] - sides[0][0]) * (sides[1][1] - sides[1][0])
        grid = np.stack(np.meshgrid(*sides, log_shear, [one], indexing="ij"), axis=-1).reshape(-1, 4)
        found = np.tile(shear_weight, len(sides[0]) * len(sides[1])) * np.exp(density.log_posterior(grid)) * cell
        sums.append(found.sum())
        means.append(found @ grid)
        squares.append(found @ grid**2)
    total = np.sum(sums)
    mean = np.sum(means, axis=0) / total
    return Truth(mean, np.sqrt(np.sum(squares, axis=0) / total - mean**2))


def effective_draws(draws: np.ndarray, weights: np.ndarray | None) -> np.ndarray:
    """Effective sample size of each column.

    Of chains by the package's autocorrelation time, at least one draw, the chains taken together; of weighted or
    independent draws the size of Kish.

    Parameters
    ----------
    draws : (n_steps, n_chains, n_dim) or (n_draws, n_dim) array
    weights : (n_draws,) array or None
        Of draws that are no chains; None where all count alike.
    """
    if draws.ndim == 3:
        return np.asarray(draws.shape[0] * draws.shape[1] / autocorrelation_times(draws))
    each = np.ones(len(draws)) if weights is None else weights
    return np.full(draws.shape[-1], each.sum() ** 2 / np.sum(each**2))


@dataclass(frozen=True)
class Difference:
    """Between a run's moments and the truth's.

    Attributes
    ----------
    mean, sd : float
        The largest of the parameters, in Monte Carlo standard errors of the run.
    mean_share, sd_share : float
        The same parameters' largest differences in posterior standard deviations.
    """

    mean: float
    sd: float
    mean_share: float
    sd_share: float


def difference(draws: np.ndarray, weights: np.ndarray | None, truth: Truth) -> Difference:
    """How far a run's means and standard deviations are from the truth."""
    flat = draws.reshape(-1, draws.shape[-1])
    each = np.ones(len(flat)) if weights is None else weights
    each = each / each.sum()
    mean = each @ flat
    squared = (draws - truth.mean) ** 2
    flat_squared = squared.reshape(flat.shape)
    variance = each @ flat_squared
    sd_of_squared = np.sqrt(each @ (flat_squared - variance) ** 2)
    mean_share = (mean - truth.mean) / truth.sd
    sd_share = (variance / truth.sd**2 - 1.0) / 2.0
    mean_error = 1.0 / np.sqrt(effective_draws(draws, weights))
    sd_error = sd_of_squared / truth.sd**2 / 2.0 / np.sqrt(effective_draws(squared, weights))
    return Difference(
        mean=float(np.abs(mean_share / mean_error).max()),
        sd=float(np.abs(sd_share / sd_error).max()),
        mean_share=float(np.abs(mean_share).max()),
        sd_share=float(np.abs(sd_share).max()),
    )
