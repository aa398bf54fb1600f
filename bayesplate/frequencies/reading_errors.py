"""The error of a reading: the setup's noise, the reading's own uncertainty, and its rounding, in one model.

About the predicted ln f a reading scatters by s z, with s the noise joined with the reading's own standard deviation
and z normal, or Student's with four degrees of freedom. A plain number tells only the interval that was rounded to it,
and has a probability in place of a density. Where second moments alone count, as in a weight of least squares, rounding
adds resolution^2 / 12 to the variance.
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

_LOWEST = 1e-3
"""Share of a reading that its rounding interval stays above: the logarithm needs a positive end."""
_DECIMALS = 9
"""Of a rounded reading in Hz: more than anyone writes."""
_NEAR = 1e-4
"""Share of an interval's scale about its middle where the first-order term is good to 1e-8 and a difference is not."""
DEGREES_OF_FREEDOM = 4
"""Of the Student distribution of `--robust`: finite variance, tails heavy enough to let one mode go."""


@dataclass(frozen=True)
class Density:
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


NORMAL = Density(
    log_peak=float(-0.5 * np.log(2.0 * np.pi)),
    deviance=np.square,
    slope=np.positive,
    curvature=1.0,
    log_below=log_ndtr,
    draw=lambda rng, shape: rng.normal(size=shape),
)
STUDENT = Density(
    log_peak=float(np.log(3.0 / 8.0)),
    deviance=lambda z: 5.0 * np.log1p(z**2 / 4.0),
    slope=lambda z: 1.25 * z / (1.0 + z**2 / 4.0),
    curvature=1.25,
    log_below=_log_student_below,
    draw=lambda rng, shape: rng.standard_t(DEGREES_OF_FREEDOM, shape),
)


@dataclass(frozen=True, eq=False)
class ReadingErrors:
    """How the readings of a setup err about the frequencies that a model predicts.

    Predictions are ln f (Hz), (n_modes,) or (n_draws, n_modes) arrays, at a relative noise: one, or (n_draws,). Under
    Student's density the noise is its scale.
    """

    frequency: Floats  # (n_modes,), Hz: as read
    own_sd: Floats  # (n_modes,): relative standard deviation that a reading states itself; 0: none
    resolution: Floats  # (n_modes,), Hz: step of the rounding; 0: none, or `own_sd` holds its error
    robust: bool = False  # Student's density with four degrees of freedom in place of the normal one

    @classmethod
    def of(cls, setup: Setup, robust: bool = False) -> ReadingErrors:
        """Errors of a setup's readings; plain numbers are rounded to its resolution, others state their own sd."""
        own = setup.relative_sd
        return cls(setup.measured, own, np.where(own == 0, setup.resolution, 0.0), robust)

    @classmethod
    def of_peaks(cls, setup: Setup, readings: Iterable[int], robust: bool = False) -> ReadingErrors:
        """Errors of a setup's peaks without a label, then of some of its labelled readings, by their indices."""
        every = [peak.frequency for peak in setup.peaks] + [setup.readings[i].frequency for i in readings]
        own = np.array([one.sd / one.mean for one in every])
        return cls(np.array([one.mean for one in every]), own, np.where(own == 0, setup.resolution, 0.0), robust)

    def at(self, kept: NDArray[Any]) -> ReadingErrors:
        return replace(self, frequency=self.frequency[kept], own_sd=self.own_sd[kept], resolution=self.resolution[kept])

    @cached_property
    def log_frequency(self) -> Floats:
        """ln of the measured frequencies, Hz: (n_modes,) array."""
        return np.log(self.frequency)

    @cached_property
    def log_low(self) -> Floats:
        """ln of the lower ends of the rounding intervals; `log_frequency` where there is no rounding."""
        return np.log(np.maximum(self.frequency - self.resolution / 2.0, _LOWEST * self.frequency))

    @cached_property
    def log_high(self) -> Floats:
        """ln of the upper ends of the rounding intervals; `log_frequency` where there is no rounding."""
        return np.log(self.frequency + self.resolution / 2.0)

    @cached_property
    def rounded(self) -> Bools:
        """Which readings are known as an interval: (n_modes,) array."""
        return self.resolution > 0

    @cached_property
    def own_variance(self) -> Floats:
        """Relative variance of each reading apart from the noise, its own and its rounding's: (n_modes,) array."""
        return np.asarray(self.own_sd**2 + (self.resolution / self.frequency) ** 2 / 12.0)

    def sd(self, noise: ArrayLike) -> Floats:
        """Relative standard deviation of each reading: noise, own uncertainty and rounding together."""
        return _join(noise, np.sqrt(self.own_variance))

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
        """ln of the probability of (n_pairs,) readings if each were of the mode of the (n_pairs, n_draws) ln f."""
        if self.rounded.any():
            return np.ascontiguousarray(self.at(readings).log_likelihood(predicted.T, noise).T)
        scale = np.ascontiguousarray(_join(noise, self.own_sd).T)
        z = self.log_frequency[readings, None] - predicted
        z /= scale[readings]
        return np.asarray(self._density.log(z) - np.log(scale)[readings])

    def log_most(self, lowest: Floats, highest: Floats, least_noise: float, most_noise: float) -> Floats:
        """The most that `log_likelihood_of_pairs` is within ranges of ln f, or more: (n_readings, n_modes)."""
        away = np.maximum(lowest - self.log_high[:, None], self.log_low[:, None] - highest)
        z = np.maximum(away, 0.0) / _join(most_noise, self.own_sd)[:, None]
        result = self._density.log(z) - np.log(_join(least_noise, self.own_sd))[:, None]
        if self.rounded.any():  # the interval is a part of what lies beyond its nearer end, on either side
            result[self.rounded] = np.log(2.0) + self._density.log_below(-z[self.rounded])
        return np.asarray(result)

    def deviance_residuals(self, predicted: Floats, noise: ArrayLike) -> tuple[Floats, Floats]:
        """Signed roots of the deviances 2 (max ln p - ln p), and how they change with the prediction.

        The sum of their squares is twice the negative log likelihood but for a constant. They are positive where a
        reading, or the middle of its interval, lies above the prediction; without rounding and with normal errors they
        are standardised residuals. Slopes are negative, and next to zero within an interval wider than the noise.
        (McCullagh and Nelder, Generalized Linear Models, 2nd ed., 1989, section 2.4.3.)
        """
        z, low, high, scale = self._standardised(predicted, noise)
        residuals, slopes = np.empty(z.shape), np.empty(z.shape)
        exact, rounded = (..., ~self.rounded), (..., self.rounded)
        residuals[exact], slopes[exact] = self._of_density(z[exact])
        residuals[rounded], slopes[rounded] = self._of_interval(low[rounded], high[rounded])
        return residuals, -slopes / scale

    def simulate(self, predicted: Floats, noise: ArrayLike, rng: np.random.Generator) -> Floats:
        """Readings in Hz, (n_draws, n_modes), that a model would give, rounded where the measured ones are."""
        hertz = np.exp(predicted + _join(noise, self.own_sd) * self._density.draw(rng, predicted.shape))
        steps = self.resolution[self.rounded]
        whole = np.round(hertz[..., self.rounded] / steps)
        hertz[..., self.rounded] = np.round(whole * steps, _DECIMALS)  # 483 * 0.1 lies just above the reading 48.3
        return np.asarray(hertz)

    @property
    def _density(self) -> Density:
        return STUDENT if self.robust else NORMAL

    def _standardised(self, predicted: Floats, noise: ArrayLike) -> tuple[Floats, Floats, Floats, Floats]:
        """Reading and ends of its interval less the prediction, in units of the scale; and the scale."""
        scale = np.broadcast_to(_join(noise, self.own_sd), predicted.shape)
        z, low, high = ((log - predicted) / scale for log in (self.log_frequency, self.log_low, self.log_high))
        return z, low, high, scale

    def _of_density(self, z: Floats) -> tuple[Floats, Floats]:
        """Signed root of a density's deviance, and its derivative by z."""
        root = np.sqrt(self._density.deviance(z))
        at_peak = root == 0
        slopes = np.abs(self._density.slope(z)) / np.where(at_peak, 1.0, root)
        return np.sign(z) * root, np.where(at_peak, np.sqrt(self._density.curvature), slopes)

    def _of_interval(self, low: Floats, high: Floats) -> tuple[Floats, Floats]:
        """Signed root of the deviance of an interval, and its derivative by both bounds moving together."""
        density = self._density
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        highest, found = density.log_between(-half, half), density.log_between(low, high)
        root = np.sqrt(np.maximum(2.0 * (highest - found), 0.0))
        pull = np.abs(np.exp(density.log(low) - found) - np.exp(density.log(high) - found))
        stiffness = np.sqrt(2.0 * density.slope(half) * np.exp(density.log(half) - highest))
        near = (np.abs(middle) * (1.0 + half) < _NEAR) | (root == 0)
        slopes = np.where(near, stiffness, pull / np.where(near, 1.0, root))
        return np.where(near, stiffness * middle, np.sign(middle) * root), slopes


def reading_sd(setups: Sequence[Setup], noise: Iterable[float]) -> Floats:
    """Relative standard deviation of all readings, setup after setup, at one noise per setup: (n_modes,) array."""
    return np.concatenate([ReadingErrors.of(setup).sd(one) for setup, one in zip(setups, noise, strict=True)])


def _join(noise: ArrayLike, own: Floats) -> Floats:
    """Noise and another standard deviation of each reading: (n_modes,) or (n_draws, n_modes) array."""
    level = np.asarray(noise, dtype=np.float64)
    if (level < 0).any():
        raise ValueError("noise: wanted a relative standard deviation, got a negative number; is it a logarithm?")
    return np.asarray(np.hypot(level[..., None], own))
