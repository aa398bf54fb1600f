"""Densities of standardised errors, normal and Student's, and probabilities between bounds, stable in the tails."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

Floats = NDArray[np.float64]

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
