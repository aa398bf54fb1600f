"""The error of a reading: the setup's noise, the reading's own uncertainty, and its rounding, in one model.

A reading scatters about the predicted ln f by s z, with s^2 the variance of the noise plus that of the reading itself,
and z normal, or Student's with four degrees of freedom. A plain number states only the interval that was rounded to it,
and has a probability in place of a density. Where only second moments matter, as in least squares, rounding adds
resolution^2 / 12 to the variance.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import log_ndtr

from bayesplate.arrays import Bools, Floats, Indices
from bayesplate.board.setup import Setup

_LOWEST_SHARE = 1e-3
"""Lower limit of a rounding interval, as a share of the reading: its logarithm needs a positive number."""
_DECIMALS = 9
"""Decimals of a rounded reading in Hz: more than anyone writes."""
_NEAR_MIDDLE = 1e-4
"""How near its middle, in its own scale, an interval's deviance takes the first-order term: good to 1e-8 there."""
DEGREES_OF_FREEDOM = 4
"""Of the Student distribution of `--robust`: finite variance, tails heavy enough to let one mode go."""


@dataclass(frozen=True)
class ErrorDensity:
    """A density of z, symmetric about zero and highest there: the normal one or Student's."""

    log_peak: float  # ln p(0)
    deviance: Callable[[Floats], Floats]  # 2 (ln p(0) - ln p(z)); z^2 for the normal density
    slope: Callable[[Floats], Floats]  # half the deviance's derivative, -d ln p / dz
    curvature: float  # derivative of `slope` at 0
    log_below: Callable[[Floats], Floats]  # ln of the probability below z
    draw: Callable[[np.random.Generator, tuple[int, ...]], Floats]

    def log(self, z: Floats) -> Floats:
        return np.asarray(self.log_peak - 0.5 * self.deviance(z))

    def log_between(self, low: Floats, high: Floats) -> Floats:
        """ln of the probability between two bounds, taken in the tail where differences do not cancel."""
        upper = low + high > 0
        low, high = np.where(upper, -high, low), np.where(upper, -low, high)
        top = self.log_below(high)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(top + np.log(-np.expm1(self.log_below(low) - top)))


def _log_student_below(t: Floats) -> Floats:
    """ln F(t) of four degrees of freedom: with u = t / sqrt(4 + t^2), F = (1 + u)^2 (2 - u) / 4, 1 + u without loss."""
    root = np.sqrt(4.0 + t**2)
    u = t / root
    one_plus = np.where(t < 0, 4.0 / (root * (root - t)), 1.0 + u)
    return np.asarray(2.0 * np.log(one_plus) + np.log(2.0 - u) - np.log(4.0))


NORMAL = ErrorDensity(
    log_peak=float(-0.5 * np.log(2.0 * np.pi)),
    deviance=np.square,
    slope=np.positive,
    curvature=1.0,
    log_below=log_ndtr,
    draw=lambda rng, shape: rng.normal(size=shape),
)
STUDENT = ErrorDensity(
    log_peak=float(np.log(3.0 / 8.0)),
    deviance=lambda z: 5.0 * np.log1p(z**2 / 4.0),
    slope=lambda z: 1.25 * z / (1.0 + z**2 / 4.0),
    curvature=1.25,
    log_below=_log_student_below,
    draw=lambda rng, shape: rng.standard_t(DEGREES_OF_FREEDOM, shape),
)


@dataclass(frozen=True, eq=False)
class ReadingErrors:
    """Errors of a setup's readings about the frequencies that a model predicts.

    Predictions are ln f (Hz), (n_modes,) or (n_draws, n_modes) arrays. The noise is relative, a number or an (n_draws,)
    array; under Student's density it is the scale.
    """

    frequency: Floats  # (n_modes,), Hz: as read
    own_sd: Floats  # (n_modes,): relative standard deviation that a reading states itself; 0: none
    resolution: Floats  # (n_modes,), Hz: step of the rounding; 0: none, or `own_sd` holds its error
    robust: bool = False  # Student's density with four degrees of freedom in place of the normal one

    @classmethod
    def of(cls, setup: Setup, robust: bool = False) -> ReadingErrors:
        """Errors of a setup's readings; plain numbers are rounded to its resolution, others state their own sd."""
        own_sd = setup.relative_sd
        return cls(setup.measured, own_sd, np.where(own_sd == 0, setup.resolution, 0.0), robust)

    @classmethod
    def of_peaks(cls, setup: Setup, readings: Iterable[int], robust: bool = False) -> ReadingErrors:
        """Errors of a setup's peaks without a label, then of some of its labelled readings, by their indices."""
        frequencies = [peak.frequency for peak in setup.peaks] + [setup.readings[i].frequency for i in readings]
        own_sd = np.array([f.sd / f.mean for f in frequencies])
        return cls(
            np.array([f.mean for f in frequencies]), own_sd, np.where(own_sd == 0, setup.resolution, 0.0), robust
        )

    def select(self, indices: NDArray[Any]) -> ReadingErrors:
        return replace(
            self, frequency=self.frequency[indices], own_sd=self.own_sd[indices], resolution=self.resolution[indices]
        )

    @cached_property
    def log_frequency(self) -> Floats:
        """ln of the measured frequencies, Hz: (n_modes,) array."""
        return np.log(self.frequency)

    @cached_property
    def log_low(self) -> Floats:
        """ln of the lower ends of the rounding intervals; `log_frequency` where there is no rounding."""
        return np.log(np.maximum(self.frequency - self.resolution / 2.0, _LOWEST_SHARE * self.frequency))

    @cached_property
    def log_high(self) -> Floats:
        """ln of the upper ends of the rounding intervals; `log_frequency` where there is no rounding."""
        return np.log(self.frequency + self.resolution / 2.0)

    @cached_property
    def rounded(self) -> Bools:
        """Which readings are rounding intervals: (n_modes,) array."""
        return self.resolution > 0

    @cached_property
    def own_variance(self) -> Floats:
        """Relative variance of each reading without the noise, from its own sd and rounding: (n_modes,) array."""
        return np.asarray(self.own_sd**2 + (self.resolution / self.frequency) ** 2 / 12.0)

    def sd(self, noise: ArrayLike) -> Floats:
        """Relative standard deviation of each reading: noise, own uncertainty and rounding together."""
        return _total_sd(noise, np.sqrt(self.own_variance))

    def log_likelihood(self, predicted: Floats, noise: ArrayLike) -> Floats:
        """ln of the probability of each reading: of its rounding interval, or else of the density of ln f.

        Minus infinity where the model has no frequency, which is not a number.
        """
        rounded = self.rounded
        z, low, high, scale = self._standardised(predicted, noise)
        result = np.empty(z.shape)
        result[..., ~rounded] = self._density.log(z[..., ~rounded]) - np.log(scale[..., ~rounded])
        result[..., rounded] = self._density.log_between(low[..., rounded], high[..., rounded])
        return np.where(np.isnan(predicted), -np.inf, result)

    def log_likelihood_of_pairs(self, readings: Indices, predicted: Floats, noise: Floats) -> Floats:
        """ln of the probability of (n_pairs,) readings, each paired with a mode: (n_pairs, n_draws), as its ln f."""
        if self.rounded.any():
            return np.ascontiguousarray(self.select(readings).log_likelihood(predicted.T, noise).T)
        scale = np.ascontiguousarray(_total_sd(noise, self.own_sd).T)
        z = self.log_frequency[readings, None] - predicted
        z /= scale[readings]
        return np.asarray(self._density.log(z) - np.log(scale)[readings])

    def log_upper_bound(self, lowest: Floats, highest: Floats, least_noise: float, most_noise: float) -> Floats:
        """Upper bound of `log_likelihood_of_pairs` for ln f and noise within ranges: (n_readings, n_modes)."""
        distance = np.maximum(lowest - self.log_high[:, None], self.log_low[:, None] - highest)
        z = np.maximum(distance, 0.0) / _total_sd(most_noise, self.own_sd)[:, None]
        result = self._density.log(z) - np.log(_total_sd(least_noise, self.own_sd))[:, None]
        if self.rounded.any():  # at most the probability beyond the nearer end of the interval, on either side
            result[self.rounded] = np.log(2.0) + self._density.log_below(-z[self.rounded])
        return np.asarray(result)

    def deviance_residuals(self, predicted: Floats, noise: ArrayLike) -> tuple[Floats, Floats]:
        """Signed roots of the deviances 2 (max ln p - ln p), and their derivatives by the prediction.

        The sum of their squares is twice the negative log likelihood up to a constant. They are positive where a
        reading, or the middle of its interval, lies above the prediction; without rounding and with normal errors they
        are standardised residuals. Derivatives are negative, and almost zero within an interval wider than the noise.
        (McCullagh and Nelder, Generalized Linear Models, 2nd ed., 1989, section 2.4.3.)
        """
        z, low, high, scale = self._standardised(predicted, noise)
        residuals, slopes = np.empty(z.shape), np.empty(z.shape)
        exact, rounded = (..., ~self.rounded), (..., self.rounded)
        residuals[exact], slopes[exact] = self._density_residuals(z[exact])
        residuals[rounded], slopes[rounded] = self._interval_residuals(low[rounded], high[rounded])
        return residuals, -slopes / scale

    def simulate(self, predicted: Floats, noise: ArrayLike, rng: np.random.Generator) -> Floats:
        """Simulated readings in Hz, (n_draws, n_modes), rounded where the measured readings are."""
        hertz = np.exp(predicted + _total_sd(noise, self.own_sd) * self._density.draw(rng, predicted.shape))
        steps = self.resolution[self.rounded]
        n_steps = np.round(hertz[..., self.rounded] / steps)
        hertz[..., self.rounded] = np.round(n_steps * steps, _DECIMALS)  # 483 * 0.1 lies just above the reading 48.3
        return np.asarray(hertz)

    @property
    def _density(self) -> ErrorDensity:
        return STUDENT if self.robust else NORMAL

    def _standardised(self, predicted: Floats, noise: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Reading, lower and upper end of its interval, each less the prediction over the scale; and the scale."""
        scale = np.broadcast_to(_total_sd(noise, self.own_sd), predicted.shape)
        z, low, high = ((log - predicted) / scale for log in (self.log_frequency, self.log_low, self.log_high))
        return z, low, high, scale

    def _density_residuals(self, z: Floats) -> tuple[Floats, Floats]:
        """Signed root of a density's deviance, and its derivative by z."""
        root = np.sqrt(self._density.deviance(z))
        at_peak = root == 0
        slopes = np.abs(self._density.slope(z)) / np.where(at_peak, 1.0, root)
        return np.sign(z) * root, np.where(at_peak, np.sqrt(self._density.curvature), slopes)

    def _interval_residuals(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Signed root of the deviance of an interval, and its derivative when both bounds move together."""
        density = self._density
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        highest, log_probability = density.log_between(-half, half), density.log_between(low, high)
        root = np.sqrt(np.maximum(2.0 * (highest - log_probability), 0.0))
        pull = np.abs(np.exp(density.log(low) - log_probability) - np.exp(density.log(high) - log_probability))
        stiffness = np.sqrt(2.0 * density.slope(half) * np.exp(density.log(half) - highest))
        is_near = (np.abs(middle) * (1.0 + half) < _NEAR_MIDDLE) | (root == 0)
        slopes = np.where(is_near, stiffness, pull / np.where(is_near, 1.0, root))
        return np.where(is_near, stiffness * middle, np.sign(middle) * root), slopes


def reading_sd(setups: Sequence[Setup], noise: Iterable[float]) -> Floats:
    """Relative standard deviation of all readings, setup after setup, at one noise per setup: (n_modes,) array."""
    return np.concatenate([ReadingErrors.of(setup).sd(level) for setup, level in zip(setups, noise, strict=True)])


def _total_sd(noise: ArrayLike, own_sd: Floats) -> Floats:
    """Root sum of squares of the noise and each reading's own sd: (n_modes,) or (n_draws, n_modes) array."""
    level = np.asarray(noise, dtype=np.float64)
    if (level < 0).any():
        raise ValueError("noise: wanted a relative standard deviation, got a negative number; is it a logarithm?")
    return np.asarray(np.hypot(level[..., None], own_sd))
