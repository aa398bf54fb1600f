"""Comparisons of draws with a known truth, at a tolerance computed from their Monte Carlo error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

QUANTILES = (0.05, 0.5, 0.95)
FALSE_ALARMS = 1e-4
"""Probability that draws of the right posterior fail a test. Some sixty tests of the suite compare so."""


def furthest(n_compared):
    """Standard errors that none of so many differences exceeds but in a share `FALSE_ALARMS` of tests."""
    return float(-ndtri(0.5 * FALSE_ALARMS / n_compared))


def differences_from_normal(draws, ess, mean, sd):
    """List in what the draws differ from exact normal distributions.

    Compared are the mean, the standard deviation and the 5, 50 and 95 % quantiles of every parameter.  A Monte Carlo
    standard error is computed for each from the effective sample size: sd / sqrt(ess) for the mean,
    sd / sqrt(2 ess) for the standard deviation, sqrt(p (1 - p) / ess) / density for the quantile of probability p.

    Parameters
    ----------
    draws : (n_draws, n_dim) array
    ess : (n_dim,) array
        Effective sample sizes of the means.
    mean, sd : (n_dim,) array
        The truth.

    Returns
    -------
    list of str
        One sentence a difference; empty if the draws agree.
    """
    return differences(draws, ess, normal_truth(mean, sd))


def normal_truth(mean, sd):
    """What is known of normal distributions of those means and standard deviations: (n_dim,) arrays to a `Truth`."""
    mean, sd = np.asarray(mean, dtype=float), np.asarray(sd, dtype=float)
    deviates = ndtri(np.array(QUANTILES))[:, None]
    densities = np.exp(-0.5 * deviates**2) / np.sqrt(2 * np.pi) / sd
    return Truth(mean, sd, np.full(mean.size, 3.0), mean + deviates * sd, densities)


@dataclass(frozen=True)
class Truth:
    """What is known of the marginal distributions of n_dim parameters.

    Attributes
    ----------
    mean, sd : (n_dim,) array
    kurtosis : (n_dim,) array
        Fourth central moment over sd**4: 3 for a normal distribution.
    quantiles, densities : (3, n_dim) array
        The quantiles of `QUANTILES`, and the probability densities there.
    """

    mean: np.ndarray
    sd: np.ndarray
    kurtosis: np.ndarray
    quantiles: np.ndarray
    densities: np.ndarray

    @classmethod
    def from_marginals(cls, grids, densities):
        """Truth from densities, normalised or not, on one fine even grid a parameter."""
        rows = []
        for x, density in zip(grids, densities, strict=True):
            p = density / density.sum()
            mean = p @ x
            sd = np.sqrt(p @ (x - mean) ** 2)
            below = np.cumsum(p) - 0.5 * p
            quantiles = np.interp(QUANTILES, below, x)
            rows.append((mean, sd, p @ (x - mean) ** 4 / sd**4, quantiles, np.interp(quantiles, x, p / (x[1] - x[0]))))
        mean, sd, kurtosis, quantiles, at_quantiles = (np.array(column) for column in zip(*rows, strict=True))
        return cls(mean, sd, kurtosis, quantiles.T, at_quantiles.T)


def differences(draws, ess, truth):
    """List in what the draws differ from known marginal distributions, see `differences_from_normal`.

    The tolerance is that of all comparisons together, see `furthest`.

    Parameters
    ----------
    draws : (n_draws, n_dim) array
    ess : (n_dim,) array
    truth : Truth

    Returns
    -------
    list of str
    """
    ess = np.asarray(ess, dtype=float)
    mean = truth.mean
    compared = {
        "mean": (draws.mean(axis=0), mean, truth.sd / np.sqrt(ess)),
        "standard deviation": (draws.std(axis=0), truth.sd, truth.sd * np.sqrt((truth.kurtosis - 1) / (4 * ess))),
    }
    drawn = np.quantile(draws, QUANTILES, axis=0)
    for probability, found, true, density in zip(QUANTILES, drawn, truth.quantiles, truth.densities, strict=True):
        error = np.sqrt(probability * (1 - probability) / ess) / density
        compared[f"{100 * probability:g} % quantile"] = (found, true, error)
    n_errors = furthest(len(compared) * mean.size)
    return [
        f"{what} of parameter {dim + 1}: {found[dim]:.6g} instead of {true[dim]:.6g}, "
        f"{abs(found[dim] - true[dim]) / error[dim]:.1f} standard errors"
        for what, (found, true, error) in compared.items()
        for dim in range(mean.size)
        if not abs(found[dim] - true[dim]) <= n_errors * error[dim]
    ]
