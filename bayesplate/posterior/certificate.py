"""Whether the draws of a fit agree with an answer in closed form, on the same readings: a check of every run.

A board's own posterior has no closed form: a frequency is the root of a sum of stiffnesses, the noise is unknown and a
reading may be rounded. Its linear normal case has one (`normal_case`). Draws of the posterior that are weighted by the
ratio of the two densities are draws of that case, exactly, whatever their distance; only how many of them count
depends on it. So each constant and each noise, as weighted, must have the mean, the standard deviation and the
quantiles of the closed form within Monte Carlo errors, or the draws are not of the density that was asked for.

Whether the check applies is decided by draws of the closed form alone, so that wrong draws cannot excuse themselves.
It cannot tell whether the density itself is right: other tests do.

References
----------
A. B. Owen, Monte Carlo theory, methods and examples, 2013, sections 9.2 and 9.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from bayesplate.posterior.convergence import autocorrelation_times
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.normal_case import NormalCase

Floats = NDArray[np.float64]

ALLOWED_ERRORS = 4.0
"""Monte Carlo errors by which draws may differ from the closed form."""
FEWEST_EFFECTIVE = 400.0
"""Draws of equal weight that must be left: as many as the convergence gate asks for."""

_MOST_ERRORS = 1000.0
_MOST_DRAWS = 10_000
_N_POINTS = 2000
_LARGEST_WEIGHT = 0.01
_MOST_UNREACHED = 0.002
_QUANTILES = {"5 % quantile": 0.05, "median": 0.5, "95 % quantile": 0.95}
_LINE_OF_SEEDS = 7


@dataclass(frozen=True)
class Certificate:
    """What the comparison of draws with the closed form found.

    Attributes
    ----------
    applies : bool
        Whether the closed form is near enough for draws to be weighted to it.
    passed : bool or None
        Whether all comparisons are within `ALLOWED_ERRORS`; None where it does not apply.
    reason : str
        Why it does not apply; empty where it does.
    comparisons : int
        Means, standard deviations and quantiles that were compared.
    worst : str
        Which of them differs most, in words; empty where it does not apply.
    worst_errors : float or None
        By how many Monte Carlo errors; 1000 stands for more than that.
    effective_draws : float or None
        How many draws of equal weight the comparison rests on; None where there is no closed form at all.
    """

    applies: bool
    passed: bool | None = None
    reason: str = ""
    comparisons: int = 0
    worst: str = ""
    worst_errors: float | None = None
    effective_draws: float | None = None


def does_not_apply(reason: str, effective_draws: float | None = None) -> Certificate:
    """The certificate of a fit that has no closed form near enough, and why."""
    return Certificate(False, reason=reason, effective_draws=effective_draws)


def certify(inference: Inference, seed: int) -> Certificate:
    """Compare the draws of a fit with the closed form of its linear normal case.

    Parameters
    ----------
    inference : Inference
    seed : int
        Of the draws of the closed form by which it is decided whether the check applies.

    Returns
    -------
    Certificate
    """
    problem = inference.problem
    if any(peaks is not None for peaks in problem.posterior.peaks):
        return does_not_apply("which mode a peak is of is not sure, and the sum over the ways has no normal case")
    case = NormalCase.of(problem)
    if not case.is_known:
        return does_not_apply("the prior ends next to the estimate, and has no normal case there")
    theta, log_posterior = _thinned(inference)
    try:
        effective, unreached = _overlap(inference, case, log_posterior.size, seed)
    except np.linalg.LinAlgError:
        return does_not_apply("its normal equations have no solution at some noises")
    if unreached > _MOST_UNREACHED:
        return does_not_apply(
            f"{100 * unreached:.1f} % of the normal case lies where the posterior has next to nothing", effective
        )
    if effective < FEWEST_EFFECTIVE:
        return does_not_apply(
            f"the posterior is too far from a normal one: {effective:.0f} draws would count, {FEWEST_EFFECTIVE:.0f} "
            "are needed",
            effective,
        )
    errors = differences(case, theta, log_posterior)
    worst = max(errors, key=lambda what: abs(errors[what]))
    size = float(abs(errors[worst]))
    return Certificate(True, size <= ALLOWED_ERRORS, "", len(errors), worst, size, effective)


def differences(case: NormalCase, theta: Floats, log_posterior: Floats) -> dict[str, float]:
    """By how many Monte Carlo errors weighted draws differ from the closed form.

    Parameters
    ----------
    case : NormalCase
    theta : (n_ensembles, n_steps, n_walkers, n_dim) array
    log_posterior : (n_ensembles, n_steps, n_walkers) array
        But for a constant.

    Returns
    -------
    dict of float
        Standardised differences by "mean of ln D_x" and the like, -1000 to 1000: where the draws are so wrong that all
        the weight is on one of them there is no Monte Carlo error to divide by.
    """
    flat = theta.reshape(-1, theta.shape[-1])
    log_weights = case.log_density(flat) - log_posterior.ravel()
    if not np.isfinite(log_weights).all():  # draws from where the posterior has nothing
        log_weights = np.where(np.isposinf(log_weights), 0.0, -np.inf)
    weights = np.exp(log_weights - log_weights.max())
    weights /= weights.mean()
    deviates = np.concatenate([case.column_deviates(flat), case.noise_deviates(flat)], axis=1)
    names = [f"ln {name}" for name in case.parameters.board.symmetry.free]
    names += [*case.parameters.inputs, *(f"ln noise of {setup.name}" for setup in case.parameters.board.setups)]
    terms: dict[str, Floats] = {}
    for name, one in zip(names, deviates.T, strict=True):
        terms[f"mean of {name}"] = one
        terms[f"standard deviation of {name}"] = one**2 - 1.0
        terms |= {f"{word} of {name}": (one < ndtri(p)) - p for word, p in _QUANTILES.items()}
    series = np.stack([weights * term for term in terms.values()], axis=1).reshape(*log_posterior.shape, -1)
    return dict(zip(terms, _standardised(series).tolist(), strict=True))


def _standardised(series: Floats) -> Floats:
    """Means of series over their Monte Carlo errors: (n_ensembles, n_steps, n_walkers, n) to (n,) array."""
    n_ensembles, n_steps, n_walkers, _ = series.shape
    with np.errstate(invalid="ignore"):  # a series that is zero almost everywhere
        variances = [each.var(axis=(0, 1)) * autocorrelation_times(each) / (n_steps * n_walkers) for each in series]
    error = np.sqrt(np.sum(variances, axis=0)) / n_ensembles
    mean = series.mean(axis=(0, 1, 2))
    found = np.divide(mean, error, out=np.full_like(mean, _MOST_ERRORS), where=error > 0)
    return np.asarray(np.clip(found, -_MOST_ERRORS, _MOST_ERRORS))


def _thinned(inference: Inference) -> tuple[Floats, Floats]:
    """Draws after burn-in and their log posterior, every so many steps that there are not too many of them."""
    chains = inference.chains
    log_posterior = chains.log_prob[:, chains.burn_in :]
    every = max(1, -(-log_posterior.size // _MOST_DRAWS))
    return chains.kept[:, ::every], log_posterior[:, ::every]


def _overlap(inference: Inference, case: NormalCase, n_draws: int, seed: int) -> tuple[float, float]:
    """How many draws count when weighted to the closed form, and the share of it that they can hardly reach.

    Both from draws of the closed form: under it the mean of the inverse ratio of the densities is the constant that
    normalises their ratio, and the mean of the ratio is one over the share of draws that counts.
    """
    points = case.draws(_N_POINTS, np.random.default_rng([seed, _LINE_OF_SEEDS]))
    log_posterior = inference.problem.posterior(points)
    if not np.isfinite(log_posterior).any():
        return 0.0, 1.0
    log_ratio = case.log_density(points) - log_posterior
    inverse = -log_ratio
    log_constant = inverse.max() + np.log(np.mean(np.exp(inverse - inverse.max())))
    ratio = np.exp(np.minimum(log_ratio + log_constant, 700.0))
    limit = _LARGEST_WEIGHT * n_draws
    share = 1.0 / np.mean(np.minimum(ratio, limit))
    return float(min(share, 1.0) * min(inference.convergence.ess_min, n_draws)), float(np.mean(ratio > limit))
