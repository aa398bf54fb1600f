"""Comparisons of draws with a known truth, at a tolerance computed from their Monte Carlo error."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

QUANTILES = (0.05, 0.5, 0.95)


def differences_from_normal(draws, ess, mean, sd, n_errors=4.0):
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
    n_errors : float, optional
        Standard errors allowed.

    Returns
    -------
    list of str
        One sentence a difference; empty if the draws agree.
    """
    ess, mean, sd = (np.asarray(values, dtype=float) for values in (ess, mean, sd))
    compared = {
        "mean": (draws.mean(axis=0), mean, sd / np.sqrt(ess)),
        "standard deviation": (draws.std(axis=0), sd, sd / np.sqrt(2 * ess)),
    }
    for probability, found in zip(QUANTILES, np.quantile(draws, QUANTILES, axis=0), strict=True):
        deviate = ndtri(probability)
        density = np.exp(-0.5 * deviate**2) / np.sqrt(2 * np.pi)
        error = np.sqrt(probability * (1 - probability) / ess) / density * sd
        compared[f"{100 * probability:g} % quantile"] = (found, mean + deviate * sd, error)
    return [
        f"{what} of parameter {dim + 1}: {found[dim]:.6g} instead of {true[dim]:.6g}, "
        f"{abs(found[dim] - true[dim]) / error[dim]:.1f} standard errors"
        for what, (found, true, error) in compared.items()
        for dim in range(mean.size)
        if not abs(found[dim] - true[dim]) <= n_errors * error[dim]
    ]
