"""The density of a number that is not known exactly: normal, log-normal, log-uniform, bounded."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import log_ndtr, ndtr, ndtri

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError

DensityKind = Literal["normal", "log-normal", "log-uniform"]
_OPEN_UNIT_INTERVAL = math.nextafter(0.0, 1.0), math.nextafter(1.0, 0.0)
_LOG_ROOT_TWO_PI = 0.5 * math.log(2.0 * math.pi)


@dataclass(frozen=True)
class ProbabilityDensity:
    """A number and its uncertainty as a density; an exact one, sd = 0, has one value at every coordinate."""

    mean: float
    sd: float = 0.0
    kind: DensityKind = "log-normal"
    lower: float = -math.inf
    upper: float = math.inf

    @property
    def is_exact(self) -> bool:
        """Whether the number has no uncertainty."""
        return self.sd == 0

    @property
    def log_sd(self) -> float:
        """Standard deviation of the logarithm, before truncation; 0 if exact."""
        if self.is_exact:
            return 0.0
        if self.kind == "normal":
            raise ValueError("log_sd: wanted the quantity of a positive thing, got a normal one")
        if self.kind == "log-uniform":
            return math.log(self.upper / self.lower) / math.sqrt(12.0)
        return math.sqrt(math.log1p((self.sd / self.mean) ** 2))

    @property
    def factor(self) -> float:
        """exp of the standard deviation of the logarithm: two thirds of a log-normal lie within it about the median."""
        return math.exp(self.log_sd)

    @property
    def median(self) -> float:
        """The value at z = 0, in the quantity's unit."""
        if self.is_exact or self.kind == "normal":
            return self.mean
        if self.kind == "log-uniform":
            return math.sqrt(self.lower * self.upper)
        return self.mean * math.exp(-(self.log_sd**2) / 2)

    def value(self, z: ArrayLike) -> Floats:
        """The number at the standard coordinate z.

        Parameters
        ----------
        z : array of any shape, no unit

        Returns
        -------
        array of the same shape, in the quantity's unit
        """
        coordinate = np.asarray(z, dtype=np.float64)
        if self.is_exact:
            return np.full(coordinate.shape, self.mean)[()]
        if self.kind == "normal":
            return np.asarray(self.mean + self.sd * coordinate)[()]
        if self.kind == "log-uniform":
            return np.asarray(self.lower * (self.upper / self.lower) ** ndtr(coordinate))[()]
        return np.asarray(self.median * np.exp(self.log_sd * coordinate))[()]

    def standard(self, value: ArrayLike) -> Floats:
        """The standard coordinate of a value; the inverse of `value`.

        Parameters
        ----------
        value : array of any shape, in the quantity's unit

        Returns
        -------
        array of the same shape, no unit
            0 if the quantity is exact; infinite beyond what a quantity can be: zero for a log-normal one, its bounds
            for a log-uniform one.
        """
        number = np.asarray(value, dtype=np.float64)
        if self.is_exact:
            return np.zeros(number.shape)[()]
        if self.kind == "normal":
            return np.asarray((number - self.mean) / self.sd)[()]
        if self.kind == "log-uniform":
            share = np.log(np.clip(number, self.lower, self.upper) / self.lower) / math.log(self.upper / self.lower)
            return np.asarray(ndtri(share))[()]
        is_positive = number > 0
        ratio = np.where(is_positive, number, self.median) / self.median
        return np.where(is_positive, np.log(ratio) / self.log_sd, -np.inf)[()]

    def log_prior(self, z: ArrayLike) -> Floats:
        """Logarithm of the density of z, normalised over the part within the bounds.

        Parameters
        ----------
        z : array of any shape, no unit

        Returns
        -------
        array of the same shape, no unit
            -inf outside the bounds. An exact quantity has no bounds to keep and returns the standard normal density.
        """
        coordinate = np.asarray(z, dtype=np.float64)
        density = -0.5 * coordinate**2 - _LOG_ROOT_TWO_PI
        if self.is_exact or (self.lower == -math.inf and self.upper == math.inf):
            return np.asarray(density)[()]
        low, high = self.standard_bounds
        is_inside = (coordinate >= low) & (coordinate <= high)
        return np.where(is_inside, density - _log_interval_probability(low, high), -np.inf)[()]

    @property
    def standard_bounds(self) -> tuple[float, float]:
        """The standard coordinates of the bounds; infinite where there are none."""
        low = float(self.standard(self.lower)) if math.isfinite(self.lower) else -math.inf
        high = float(self.standard(self.upper)) if math.isfinite(self.upper) else math.inf
        return low, high

    def log_density(self, value: ArrayLike) -> Floats:
        """Logarithm of the normalised density of the quantity itself.

        Parameters
        ----------
        value : array of any shape, in the quantity's unit

        Returns
        -------
        array of the same shape, per unit
            -inf outside the support.

        Raises
        ------
        ValueError
            If the quantity is exact, and so has no density.
        """
        if self.is_exact:
            raise ValueError("log_density: wanted an uncertain quantity, got an exact one")
        number = np.asarray(value, dtype=np.float64)
        if self.kind == "normal":
            return np.asarray(self.log_prior(self.standard(number)) - math.log(self.sd))[()]
        is_positive = number > 0
        logarithm = np.log(np.where(is_positive, number, self.median))
        return np.where(is_positive, self.log_density_of_log(logarithm) - logarithm, -np.inf)[()]

    def log_density_of_log(self, logarithm: ArrayLike) -> Floats:
        """Logarithm of the normalised density of the logarithm of a positive quantity.

        Parameters
        ----------
        logarithm : array of any shape, of the quantity in its unit

        Returns
        -------
        array of the same shape, no unit
            -inf outside the support.

        Raises
        ------
        ValueError
            If the quantity is exact or normal.
        """
        if self.is_exact or self.kind == "normal":
            raise ValueError("log_density_of_log: wanted the quantity of a positive thing, got an exact or normal one")
        log_value = np.asarray(logarithm, dtype=np.float64)
        if self.kind == "log-uniform":
            low, high = math.log(self.lower), math.log(self.upper)
            return np.where((log_value >= low) & (log_value <= high), -math.log(high - low), -np.inf)[()]
        log_sd = self.log_sd
        return np.asarray(self.log_prior((log_value - math.log(self.median)) / log_sd) - math.log(log_sd))[()]

    def standard_quantile(self, probability: ArrayLike) -> Floats:
        """The standard coordinate below which the quantity lies with a given probability.

        Parameters
        ----------
        probability : array of any shape, 0 to 1

        Returns
        -------
        array of the same shape, no unit
            Finite at 0 and 1 too, where it is that of the nearest number between them.
        """
        share = np.asarray(probability, dtype=np.float64)
        low, high = self.standard_bounds
        if low > 0:  # probabilities close to 1 lose digits: the same from the upper tail
            above_lower, above_upper = float(ndtr(-low)), float(ndtr(-high))
            return np.asarray(
                -ndtri(np.clip(above_upper + (above_lower - above_upper) * (1.0 - share), *_OPEN_UNIT_INTERVAL))
            )[()]
        below_lower, below_upper = float(ndtr(low)), float(ndtr(high))
        return np.asarray(ndtri(np.clip(below_lower + (below_upper - below_lower) * share, *_OPEN_UNIT_INTERVAL)))[()]

    def quantile(self, probability: ArrayLike) -> Floats:
        """The value below which the quantity lies with a given probability.

        Parameters
        ----------
        probability : array of any shape, 0 to 1

        Returns
        -------
        array of the same shape, in the quantity's unit

        Raises
        ------
        InputError
            If a probability is below 0 or above 1.
        """
        probabilities = np.asarray(probability, dtype=float)
        if not ((probabilities >= 0.0) & (probabilities <= 1.0)).all():
            raise InputError(Fault("probability", "numbers from 0 to 1", repr(probability)))
        return self.value(self.standard_quantile(probabilities))

    def sample(self, rng: np.random.Generator, n: int) -> Floats:
        """Draws of the quantity: (n,) array in its unit."""
        return np.asarray(self.quantile(rng.uniform(size=n)))


def _log_interval_probability(low: float, high: float) -> float:
    """Logarithm of the standard normal probability between two bounds, stable in both tails."""
    if low > 0:
        low, high = -high, -low
    log_high, log_low = float(log_ndtr(high)), float(log_ndtr(low))
    if log_low == -math.inf:
        return log_high
    return log_high + math.log(-math.expm1(log_low - log_high))
