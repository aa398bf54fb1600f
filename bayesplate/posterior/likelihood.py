"""How probable the readings are: relative noise, rounding intervals, and a heavy-tailed alternative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from bayesplate.plate.setup import Setup

Floats = NDArray[np.float64]

DEGREES_OF_FREEDOM = 4
"""Of the Student distribution of `--robust`: finite variance, tails heavy enough to let one mode go."""

_LOG_NORMAL_FACTOR = -0.5 * np.log(2.0 * np.pi)
_LOG_STUDENT_FACTOR = np.log(3.0 / 8.0)


@dataclass(frozen=True, eq=False)
class Readings:
    """The readings of one setup as the likelihood needs them.

    Attributes
    ----------
    log_frequency : (n_modes,) array
        ln of the measured frequencies, Hz.
    log_low, log_high : (n_modes,) array
        ln of the ends of the rounding interval; equal to `log_frequency` where a reading is not rounded.
    own_sd : (n_modes,) array
        Relative standard deviation of each reading itself.
    robust : bool
        Student's distribution with four degrees of freedom in place of the normal one.
    """

    log_frequency: Floats
    log_low: Floats
    log_high: Floats
    own_sd: Floats
    robust: bool = False

    @classmethod
    def of(cls, setup: Setup, robust: bool = False) -> Readings:
        """Readings of a setup; plain numbers count as rounded to its resolution, others carry their own sd."""
        measured, own = setup.measured, setup.relative_sd
        half = np.where(own == 0, setup.resolution / 2.0, 0.0)
        lowest = np.maximum(measured - half, 1e-3 * measured)
        return cls(np.log(measured), np.log(lowest), np.log(measured + half), own, robust)

    def log_likelihood(self, predicted: Floats, log_noise: Floats) -> Floats:
        """Logarithm of the probability of each reading.

        Parameters
        ----------
        predicted : (n_draws, n_modes) array
            ln f (Hz) of the model; not a number where it has none.
        log_noise : (n_draws,) array
            ln of the relative noise.

        Returns
        -------
        (n_draws, n_modes) array
            Of the rounding interval for rounded readings, otherwise the density of ln f; -inf where the model has no
            frequency.
        """
        scale = np.hypot(np.exp(log_noise)[:, None], self.own_sd)
        rounded = self.log_high > self.log_low
        density = _log_student if self.robust else _log_normal
        probability = _log_student_between if self.robust else _log_normal_between
        result = np.empty(predicted.shape)
        result[:, ~rounded] = (
            density(((self.log_frequency - predicted) / scale)[:, ~rounded]) - np.log(scale)[:, ~rounded]
        )
        result[:, rounded] = probability(
            ((self.log_low - predicted) / scale)[:, rounded], ((self.log_high - predicted) / scale)[:, rounded]
        )
        return np.where(np.isnan(predicted), -np.inf, result)

    def simulate(self, predicted: Floats, log_noise: Floats, rng: np.random.Generator) -> Floats:
        """Readings that the model would give, before rounding: (n_draws, n_modes) array of ln f."""
        scale = np.hypot(np.exp(log_noise)[:, None], self.own_sd)
        noise = rng.standard_t(DEGREES_OF_FREEDOM, predicted.shape) if self.robust else rng.normal(size=predicted.shape)
        return np.asarray(predicted + scale * noise)


def _log_normal(z: Floats) -> Floats:
    return _LOG_NORMAL_FACTOR - 0.5 * z**2


def _log_student(z: Floats) -> Floats:
    return _LOG_STUDENT_FACTOR - 2.5 * np.log1p(z**2 / 4.0)


def _log_normal_between(low: Floats, high: Floats) -> Floats:
    """ln(Phi(high) - Phi(low)), stable far out in either tail."""
    return _log_between(low, high, log_ndtr)


def _log_student_between(low: Floats, high: Floats) -> Floats:
    """The same for Student's distribution with four degrees of freedom."""
    return _log_between(low, high, _log_student_below)


def _log_between(low: Floats, high: Floats, log_below: object) -> Floats:
    """ln(F(high) - F(low)) of a symmetric distribution, taken in the tail where differences do not cancel."""
    assert callable(log_below)
    upper = low + high > 0
    low, high = np.where(upper, -high, low), np.where(upper, -low, high)
    top = log_below(high)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(top + np.log(-np.expm1(log_below(low) - top)))


def _log_student_below(t: Floats) -> Floats:
    """ln F(t) of four degrees of freedom: with u = t / sqrt(4 + t^2), F = (1 + u)^2 (2 - u) / 4, 1 + u without loss."""
    root = np.sqrt(4.0 + t**2)
    u = t / root
    one_plus = np.where(t < 0, 4.0 / (root * (root - t)), 1.0 + u)
    return np.asarray(2.0 * np.log(one_plus) + np.log(2.0 - u) - np.log(4.0))
