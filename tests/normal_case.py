"""The linear normal case of a board: a tangent law, normal errors and a normal prior, whose posterior is known exactly.

A board's own posterior has no closed form: a frequency is the root of a sum of stiffnesses, the noise is unknown and a
reading may be rounded. With the logarithms of the frequencies linear in the fitted columns, errors of a reading that
are normal, and a prior of the same slope and curvature as the board's own at the same point, the columns given the
noise are normal: mean and covariance follow from the normal equations. The noise given the columns has a density of
one variable.

Draws of the posterior that are weighted by the ratio of the two densities are draws of that case, exactly, whatever
their distance; only how many of them count depends on it. So each constant and each noise, as weighted, has the mean,
the standard deviation and the quantiles of the closed form within Monte Carlo errors, or the draws are not of the
density that was asked for. Whether the density itself is right is for other tests.

References
----------
A. Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, section 14.2; A. B. Owen, Monte Carlo theory, methods and
examples, 2013, sections 9.2 and 9.3.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import arviz
import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri
from statistics_checks import QUANTILES

from bayesplate.estimates.least_squares import log_measured
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem

Floats = NDArray[np.float64]

ALLOWED_ERRORS = 4.0
"""Monte Carlo errors by which draws may differ from the closed form."""
FEWEST_EFFECTIVE = 400.0
"""Draws of equal weight that must be left: as many as the convergence gate asks for."""

_MOST_DRAWS = 10_000
_STEP = 1e-4
_PRIOR_STEP = 1e-3
_GRID_SDS, _N_GRID = 8.0, 201
_EDGE = 1e-12


@dataclass(frozen=True, eq=False)
class NormalCase:
    """The joint density of columns and noise of a board with a linear law, normal errors and a normal prior."""

    parameters: Parameters
    at: Floats  # (n_dim,), where the law is the tangent and the prior is expanded; nothing of it comes from draws
    slopes: Floats  # (n_modes, n_fitted), derivatives of ln f by the fitted columns there
    misfit: Floats  # (n_modes,), ln measured - ln predicted there
    own_variance: Floats  # (n_modes,), relative variance of a reading apart from the noise: its own, and its rounding's
    setup: NDArray[np.intp]  # (n_modes,), of which setup a reading is
    prior_slope: Floats  # (n_fitted,), derivatives of the log prior there
    prior_precision: Floats  # (n_fitted, n_fitted), less its second ones

    @classmethod
    def of(cls, problem: PosedProblem) -> NormalCase:
        """The case that touches a problem at its centre, the estimate before any sampling."""
        posterior, parameters, at = problem.posterior, problem.parameters, problem.centre
        columns = parameters.fitted_columns
        steps = _STEP * np.eye(columns.size)

        def moved(rows: Floats) -> Floats:
            theta = np.tile(at, (len(rows), 1))
            theta[:, columns] += rows
            return theta

        def predict(rows: Floats) -> Floats:
            return np.concatenate(posterior.log_frequencies(moved(rows)), axis=1)

        def log_prior(rows: Floats) -> Floats:
            factors = posterior.log_prior_factors(moved(rows))
            return np.asarray(factors["constants"] + factors.get("inputs", 0.0))

        slope, curvature = _derivatives(log_prior, columns.size)
        return cls(
            parameters=parameters,
            at=at,
            slopes=(predict(steps) - predict(-steps)).T / (2.0 * _STEP),
            misfit=log_measured(problem.board) - predict(np.zeros((1, columns.size)))[0],
            own_variance=np.concatenate([errors.own_variance for errors in posterior.readings]),
            setup=np.repeat(np.arange(parameters.n_setups), [one.frequency.size for one in posterior.readings]),
            prior_slope=slope,
            prior_precision=_without_negative(-curvature),
        )

    def log_density(self, theta: Floats) -> Floats:
        """Log density but for a constant: (n_draws,) array from (n_draws, n_dim)."""
        away = self._away(theta)
        variance = self._variances(self.parameters.log_noise(theta))
        residuals = self.misfit - away @ self.slopes.T
        readings = -0.5 * np.sum(residuals**2 / variance + np.log(variance), axis=1)
        prior = away @ self.prior_slope - 0.5 * np.einsum("ni,ij,nj->n", away, self.prior_precision, away)
        return np.asarray(readings + prior + self.parameters.log_prior_noise(theta))

    def given_noise(self, log_noise: Floats) -> tuple[Floats, Floats]:
        """Mean and covariance of the fitted columns given (n_draws, n_setups) noises, by the normal equations."""
        weights = 1.0 / self._variances(log_noise)
        squares = (self.slopes[:, :, None] * self.slopes[:, None, :]).reshape(len(self.misfit), -1)
        n_fitted = self.slopes.shape[1]
        precision = (weights @ squares).reshape(-1, n_fitted, n_fitted) + self.prior_precision
        covariance = np.linalg.inv(precision)
        pull = weights @ (self.slopes * self.misfit[:, None]) + self.prior_slope
        mean = self.at[self.parameters.fitted_columns] + np.einsum("nij,nj->ni", covariance, pull)
        return mean, np.asarray(covariance)

    def column_deviates(self, theta: Floats) -> Floats:
        """Each fitted column less its mean given the noise, over its standard deviation: (n_draws, n_fitted) array."""
        mean, covariance = self.given_noise(self.parameters.log_noise(theta))
        sd = np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))
        return np.asarray((theta[:, self.parameters.fitted_columns] - mean) / sd)

    def noise_deviates(self, theta: Floats) -> Floats:
        """The normal deviates of each noise given the columns: (n_draws, n_setups) array."""
        found = np.empty((len(theta), self.parameters.n_setups))
        log_noise = self.parameters.log_noise(theta)
        for i in range(self.parameters.n_setups):
            grid, below = self._noise_given_columns(theta, i)
            place = np.clip((log_noise[:, i] - grid[0]) / (grid[1] - grid[0]), 0.0, len(grid) - 1.0)
            left = np.minimum(place.astype(np.intp), len(grid) - 2)
            rows, share = np.arange(len(theta)), place - left
            probability = (1.0 - share) * below[rows, left] + share * below[rows, left + 1]
            found[:, i] = ndtri(np.clip(probability, _EDGE, 1.0 - _EDGE))
        return found

    def _away(self, theta: Floats) -> Floats:
        columns = self.parameters.fitted_columns
        return np.asarray(theta[:, columns] - self.at[columns])

    def _variances(self, log_noise: Floats) -> Floats:
        return np.asarray(np.exp(2.0 * log_noise)[:, self.setup] + self.own_variance)

    def _noise_given_columns(self, theta: Floats, setup: int) -> tuple[Floats, Floats]:
        """A grid of the log noise of a setup, and the probability below each point given the columns."""
        noise = self.parameters.noises[setup].prior
        reach = _GRID_SDS * noise.log_sd
        grid = np.log(noise.median) + np.linspace(-reach, reach, _N_GRID)
        own = self.setup == setup
        squares = (self.misfit[own] - self._away(theta) @ self.slopes[own].T) ** 2
        variance = np.exp(2.0 * grid)[:, None] + self.own_variance[own]
        density = squares @ (-0.5 / variance).T
        density += noise.log_density_of_log(grid) - 0.5 * np.log(variance).sum(axis=1)
        density -= density.max(axis=1, keepdims=True)
        np.exp(density, out=density)
        below = np.cumsum(density, axis=1)
        below -= 0.5 * (density + density[:, :1])  # trapezoids
        below /= below[:, -1:]
        return grid, below


def draws_of(inference: Inference) -> tuple[Floats, Floats]:
    """Draws after burn-in and their log posterior, every so many steps that there are not too many of them.

    (n_ensembles, n_steps, n_walkers, n_dim) and (n_ensembles, n_steps, n_walkers) arrays.
    """
    chains = inference.chains
    log_posterior = chains.log_prob[:, chains.burn_in :]
    every = max(1, -(-log_posterior.size // _MOST_DRAWS))
    return chains.after_burn_in[:, ::every], log_posterior[:, ::every]


def differences(case: NormalCase, theta: Floats, log_posterior: Floats) -> list[str]:
    """List in what draws, weighted to the normal case, differ from its closed form, a sentence each; empty if in none.

    Compared are the mean, the standard deviation and the 5, 50 and 95 % quantiles of every column and noise, which
    are standard normal as deviates. Draws and their log posterior, but for a constant, are as of `draws_of`.
    """
    flat = theta.reshape(-1, theta.shape[-1])
    log_weights = case.log_density(flat) - log_posterior.ravel()
    if not np.isfinite(log_weights).all():  # draws from where the posterior has nothing
        log_weights = np.where(np.isposinf(log_weights), 0.0, -np.inf)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.mean()
    names = [f"ln {name}" for name in case.parameters.board.symmetry.free]
    names += [*case.parameters.inputs, *(f"ln noise of {setup.name}" for setup in case.parameters.board.setups)]
    deviates = np.concatenate([case.column_deviates(flat), case.noise_deviates(flat)], axis=1)
    found = []
    for name, one in zip(names, deviates.T, strict=True):
        terms = {"mean": one, "standard deviation": one**2 - 1.0}
        terms |= {f"{100 * p:g} % quantile": (one < ndtri(p)) - p for p in QUANTILES}
        for what, term in terms.items():
            mean, error = _mean((weights * term).reshape(log_posterior.shape))
            if not abs(mean) <= ALLOWED_ERRORS * error:
                found.append(f"{what} of {name}: off by {mean:.3g}, allowed {ALLOWED_ERRORS:g} times {error:.2g}")
            if what == "mean" and not error <= FEWEST_EFFECTIVE**-0.5:
                found.append(f"{what} of {name}: {error**-2:.0f} draws count, wanted {FEWEST_EFFECTIVE:.0f}")
    return found


def _mean(series: Floats) -> tuple[float, float]:
    """Mean of an (n_ensembles, n_steps, n_walkers) array and its Monte Carlo error.

    The walkers of one ensemble depend on each other, so that their mean is one series.
    """
    return float(series.mean()), float(arviz.mcse(series.mean(axis=2), method="mean"))


def _derivatives(function: Callable[[Floats], Floats], n: int) -> tuple[Floats, Floats]:
    """First and second derivatives at zero of a function of rows, by differences: (n,) and (n, n) arrays."""
    steps = _PRIOR_STEP * np.eye(n)
    with np.errstate(invalid="ignore"):
        slope = (function(steps) - function(-steps)) / (2.0 * _PRIOR_STEP)
        pairs = np.array([steps[i] + steps[j] for i, j in product(range(n), repeat=2)])
        other = np.array([steps[i] - steps[j] for i, j in product(range(n), repeat=2)])
        second = function(pairs) - function(other) - function(-other) + function(-pairs)
    return np.asarray(slope), np.asarray(second.reshape(n, n) / (4.0 * _PRIOR_STEP**2))


def _without_negative(precision: Floats) -> Floats:
    """A symmetric matrix without its negative eigenvalues, which no normal density has."""
    values, vectors = np.linalg.eigh(precision)
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
