"""Posteriors in closed form: normal constants where the noise is known, Student's where it is not.

The model is a power law, ln f linear in ln D, so that normal errors with a normal prior of ln D, or one whose scale is
that of an inverse-gamma noise, are conjugate. The posterior is sampled by the whole of `infer`.

References
----------
A. Gelman et al., Bayesian Data Analysis, 3rd ed., 2013, sections 14.2 and 14.8.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import ritz
from made_boards import CANTILEVER_LABELS, NARROW, board_of, setup_of
from scipy import special, stats
from statistics_checks import QUANTILES, Truth

from bayesplate.board.board import Board
from bayesplate.board.prior import StatedPrior, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.target import Posterior

NOISE = 0.01
ESS = 2500.0
"""Makes a Monte Carlo error of a mean 2 % of the standard deviation."""

PRIOR_MEDIANS, PRIOR_FACTORS = np.array([25.0, 2.0, 5.0]), np.array([1.2, 1.5, 1.3])


@dataclass(frozen=True, eq=False)
class PowerLaw:
    """A model whose ln f is linear in ln D, so that normal noise and a log-normal prior give a normal posterior."""

    slopes: np.ndarray
    constant: np.ndarray
    setup: Setup

    @property
    def mode_places(self):
        return tuple(range(len(self.constant)))

    def mode_log_frequencies(self, values, law):
        logs = np.log(np.stack([values[name] for name in ("D_x", "D_y", "D_s")], axis=-1))
        return self.constant + logs @ self.slopes.T

    def discrepancies(self, values):
        return np.zeros((1, 1))


SLOPES = 0.5 * np.array(
    [[0.97, 0.0, 0.03], [0.1, 0.05, 0.85], [0.9, 0.05, 0.05], [0.05, 0.8, 0.15], [0.4, 0.1, 0.5], [0.1, 0.5, 0.4]]
)


def rigidity_prior():
    pairs = zip(PRIOR_MEDIANS, PRIOR_FACTORS, strict=True)
    densities = [StatedPrior(Quantity.from_median(median, factor), "") for median, factor in pairs]
    stated = dict(zip(("D_x", "D_y", "D_s"), densities, strict=True)) | dict.fromkeys(("E_x", "E_y", "G_xy"))
    return load_prior("weakly-informative").model_copy(update=stated)


def fixed_noise(value):
    return Quantity.from_median(value, NARROW)


def read_board(rng, truth, noise, believed):
    """A board with readings of a power law at this ln D, its law, and ln f less what the law has at D = 1."""
    constant = np.log([20.0, 40.0, 130.0, 300.0, 160.0, 330.0])
    log_f = constant + SLOPES @ truth + noise * rng.normal(size=6)
    hertz = dict(zip(CANTILEVER_LABELS, np.exp(log_f).tolist(), strict=True))
    board = board_of(ritz.FINNISH, [setup_of(ritz.CANTILEVER, hertz, noise=believed)])
    return board, PowerLaw(SLOPES, constant, board.setups[0]), log_f - constant


def conjugate(seed):
    """A board of known noise, its power law and data, and the mean and covariance of its posterior in ln D."""
    rng = np.random.default_rng(seed)
    truth = np.log(PRIOR_MEDIANS) + np.log(PRIOR_FACTORS) * rng.normal(size=3)
    board, law, data = read_board(rng, truth, NOISE, fixed_noise(NOISE))
    return board, law, data, *closed_form(data, np.full(6, NOISE))


def closed_form(data, scales):
    """Posterior of ln D: normal prior, normal noise, linear model; an infinite scale drops a mode."""
    prior_precision = np.diag(np.log(PRIOR_FACTORS) ** -2.0)
    precision = prior_precision + (SLOPES.T / scales**2) @ SLOPES
    covariance = np.linalg.inv(precision)
    mean = covariance @ (prior_precision @ np.log(PRIOR_MEDIANS) + (SLOPES.T / scales**2) @ data)
    return mean, covariance


def stated(board: Board, prior, model, mean, covariance):
    """A problem posed by hand, started off the truth by a standard deviation; only sampling is under test here."""
    posterior = Posterior(board, prior, (model,), "linear")
    centre = np.r_[mean + np.sqrt(np.diagonal(covariance)), np.log(board.setups[0].noise.median)]
    wide = np.zeros((4, 4))
    wide[:3, :3], wide[3, 3] = covariance, board.setups[0].noise.log_sd ** 2
    return PosedProblem(board, prior, None, None, posterior, centre, wide)


def sampled(problem, seed):
    inference = infer(problem, SamplerSettings(seed=seed, gate=Gate(ess_min=ESS)))
    assert inference.convergence.passed, inference.convergence.reasons
    return inference


SHAPE, SCALE = 4.0, 3.0 * NOISE**2
"""Of the inverse-gamma prior of the noise's variance, whose mean is NOISE**2."""
PRIOR_SDS = np.log(PRIOR_FACTORS) / NOISE
"""Prior standard deviations of ln D in units of the noise."""


@dataclass(frozen=True, eq=False, kw_only=True)
class NormalInverseGamma(Posterior):
    """The production likelihood, and the conjugate prior: an inverse-gamma variance, ln D normal in units of it."""

    def log_prior(self, theta, values=None):
        log_noise = theta[:, 3]
        z = (theta[:, :3] - np.log(PRIOR_MEDIANS)) / PRIOR_SDS * np.exp(-log_noise)[:, None]
        return -(2.0 * SHAPE + 3.0) * log_noise - SCALE * np.exp(-2.0 * log_noise) - 0.5 * np.sum(z**2, axis=1)


def unknown_noise(seed):
    """A problem of unknown noise with the conjugate prior, and what is known of ln D and of ln noise: 4 marginals."""
    rng = np.random.default_rng(seed)
    noise = np.sqrt(SCALE / rng.gamma(SHAPE))
    truth = np.log(PRIOR_MEDIANS) + noise * PRIOR_SDS * rng.normal(size=3)
    board, model, data = read_board(rng, truth, noise, Quantity.from_median(NOISE, 1.5))
    location, scale, shape, rate = student_form(data)
    problem = stated(board, rigidity_prior(), model, location, scale * rate / shape)
    posterior = NormalInverseGamma(board, problem.prior, (model,), "linear")
    return replace(problem, posterior=posterior), student_truth(location, scale, shape, rate)


def student_form(data):
    """Location and scale of ln D in units of the noise, shape and rate of the noise's variance: the closed form."""
    prior_precision = np.diag(PRIOR_SDS**-2.0)
    prior_mean = np.log(PRIOR_MEDIANS)
    precision = prior_precision + SLOPES.T @ SLOPES
    location = np.linalg.solve(precision, prior_precision @ prior_mean + SLOPES.T @ data)
    misfit = data @ data + prior_mean @ prior_precision @ prior_mean - location @ precision @ location
    return location, np.linalg.inv(precision), SHAPE + data.size / 2.0, SCALE + misfit / 2.0


def student_truth(location, scale, shape, rate):
    """Marginals: Student's for ln D, and half the logarithm of an inverse-gamma variable for ln noise."""
    n = 2.0 * shape
    widths = np.sqrt(np.diagonal(scale) * rate / shape)
    t = stats.t(n)
    deviates = t.ppf(QUANTILES)[:, None]
    trigamma = special.polygamma(1, shape)
    log_noise = 0.5 * (np.log(rate) - np.log(stats.gamma(shape).ppf(1.0 - np.array(QUANTILES))))
    precisions = rate * np.exp(-2.0 * log_noise)  # gamma variables: their density, times |d gamma / d ln noise|
    return Truth(
        np.r_[location, 0.5 * (np.log(rate) - special.digamma(shape))],
        np.r_[widths * np.sqrt(n / (n - 2.0)), 0.5 * np.sqrt(trigamma)],
        np.r_[np.full(3, 3.0 + 6.0 / (n - 4.0)), 3.0 + special.polygamma(3, shape) / trigamma**2],
        np.column_stack([location + deviates * widths, log_noise]),
        np.column_stack([t.pdf(deviates) / widths, stats.gamma(shape).pdf(precisions) * 2.0 * precisions]),
    )
