"""A number with its uncertainty, used as a prior: from readings, a standard deviation, a median or a range."""

from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from numbers import Real
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from bayesplate.board.density import DensityKind, ProbabilityDensity
from bayesplate.errors import Fault, InputError


@dataclass(frozen=True)
class Quantity(ProbabilityDensity):
    """A number and its uncertainty.

    It is sampled in a standard coordinate z, normal with mean 0 and standard deviation 1: `value` leads from z to the
    number, `standard` back, `log_prior` is the density of z. An exact quantity has one value whatever z is.

    Attributes
    ----------
    mean, sd : float
        Mean and standard deviation, in the quantity's unit, before truncation; sd = 0 says that the number is exact.
    kind : {"normal", "log-normal", "log-uniform"}
        A positive physical quantity is log-normal with exactly this mean and sd; a Poisson ratio is normal; a constant
        of which only the range is known is log-uniform between its bounds.
    lower, upper : float
        Bounds; a normal or log-normal density is truncated there and normalised again.
    readings : tuple of float
        What was read, in the quantity's unit; empty if only a mean was given.
    resolution : float
        Step to which the readings were rounded, in the quantity's unit.
    at_x, at_y : tuple of float
        Places of the readings on the plate, in the unit of the place; one per reading, or empty.
    place_sd : float
        Standard deviation of each coordinate of these places, in their unit; 0 if they are as stated.
    """

    readings: tuple[float, ...] = ()
    resolution: float = 0.0
    at_x: tuple[float, ...] = ()
    at_y: tuple[float, ...] = ()
    place_sd: float = 0.0

    def __post_init__(self) -> None:
        faults = tuple(self._faults())
        if faults:
            raise InputError(faults)

    def _faults(self) -> Iterator[Fault]:
        """Faults of values that make no quantity."""
        no_numbers = [
            Fault(name, "a number", repr(value))
            for name, values in self._numbers().items()
            for value in values
            if not is_number(value)
        ]
        if no_numbers:
            yield from no_numbers
            return
        if self.kind not in get_args(DensityKind):
            yield Fault("kind", ", ".join(get_args(DensityKind)), repr(self.kind))
        if not math.isfinite(self.mean):
            yield Fault("mean", "a finite number", f"{self.mean}")
        for name, size in (("sd", self.sd), ("resolution", self.resolution), ("place_sd", self.place_sd)):
            if not 0 <= size < math.inf:
                yield Fault(name, "a finite number, zero or positive", f"{size}")
        if self.kind == "log-normal" and self.sd > 0 and self.mean <= 0:
            yield Fault("mean", "a positive number for a log-normal quantity", f"{self.mean}")
        is_range = self.kind == "log-uniform"
        if not self.lower < self.upper or (is_range and not 0 < self.lower < self.upper < math.inf):
            wanted = "0 < lower < upper" if is_range else "lower < upper"
            yield Fault("bounds", wanted, f"{self.lower} and {self.upper}")
        for places in (self.at_x, self.at_y):
            if places and len(places) != len(self.readings):
                yield Fault("places", f"one per reading ({len(self.readings)})", f"{len(places)}")

    def _numbers(self) -> dict[str, tuple[object, ...]]:
        """Everything in it that must be a number, by the name of its attribute."""
        single_names = ("mean", "sd", "lower", "upper", "resolution", "place_sd")
        return {name: (getattr(self, name),) for name in single_names} | {
            "readings": self.readings, "at_x": self.at_x, "at_y": self.at_y
        }  # fmt: skip

    @classmethod
    def exact(cls, value: float) -> Quantity:
        """A number without uncertainty."""
        number = _number("value", value)
        return cls(number, kind="log-normal" if number > 0 else "normal")

    @classmethod
    def from_mean(
        cls, mean: float, sd: float, kind: DensityKind = "log-normal", lower: float = -math.inf, upper: float = math.inf
    ) -> Quantity:
        """A number with a standard deviation, both in the quantity's unit; log-normal by default."""
        return cls(_number("mean", mean), _number("sd", sd), kind, _number("lower", lower), _number("upper", upper))

    @classmethod
    def from_median(cls, median: float, factor: float) -> Quantity:
        """A log-normal quantity whose logarithm has the standard deviation ln(factor).

        Parameters
        ----------
        median : float
            Positive, in the quantity's unit.
        factor : float
            Above 1: about two thirds of the probability lies between median / factor and median * factor.
        """
        median, factor = _number("median", median), _number("factor", factor)
        if not (0 < median < math.inf and 1 < factor < math.inf):
            raise InputError(Fault("median and factor", "median > 0 and factor > 1", f"{median} and {factor}"))
        variance = math.log(factor) ** 2
        mean = median * math.exp(variance / 2)
        return cls(mean, mean * math.sqrt(math.expm1(variance)))

    @classmethod
    def from_range(cls, lower: float, upper: float) -> Quantity:
        """A quantity whose logarithm is uniform between two positive bounds, in the quantity's unit."""
        lower, upper = _number("lower", lower), _number("upper", upper)
        if not 0 < lower < upper < math.inf:
            raise InputError(Fault("bounds", "0 < lower < upper", f"{lower} and {upper}"))
        width = math.log1p((upper - lower) / lower)
        mean, half = (upper - lower) / width, 0.5 * width
        # x coth(x) - 1, by its series where all digits would cancel
        squares = half / math.tanh(half) - 1.0 if half > 1e-3 else half**2 / 3.0
        return cls(mean, mean * math.sqrt(squares), "log-uniform", lower, upper)

    @classmethod
    def from_readings(
        cls,
        readings: Sequence[float],
        resolution: float = 0.0,
        at_x: Sequence[float] = (),
        at_y: Sequence[float] = (),
        kind: DensityKind = "log-normal",
        place_sd: float = 0.0,
    ) -> Quantity:
        """The mean of readings, with sd**2 = s**2 / n + resolution**2 / 12.

        The first term is the squared standard error; the second, the rounding error, is not averaged away, because
        readings of one thing are rounded alike. With one reading only the rounding remains. Readings at different
        places are rounded each on its own, and the second term is resolution**2 / (12 n).

        Parameters
        ----------
        readings : sequence of float
            At least one, in the quantity's unit.
        resolution : float
            Step to which they were rounded; 0 if they were not.
        at_x, at_y : sequence of float
            Places of the readings, one each; empty if they have none.
        kind : {"normal", "log-normal"}
        place_sd : float
            See the class.
        """
        stated_lists: dict[str, object] = {"readings": readings, "at_x": at_x, "at_y": at_y}
        faults = [
            Fault(name, "a list or an array of numbers", repr(stated))
            for name, stated in stated_lists.items()
            if isinstance(stated, str) or not isinstance(stated, Iterable) or np.ma.is_masked(stated)
        ]
        if faults:
            raise InputError(faults)
        values = tuple(_number("readings", value) for value in readings)
        if not values:
            raise InputError(Fault("readings", "at least one", "none"))
        if not all(map(math.isfinite, values)):
            raise InputError(Fault("readings", "finite numbers", f"{list(values)}"))
        resolution = _number("resolution", resolution)
        # statistics computes with fractions: equal readings have a variance of exactly zero
        scatter = statistics.variance(values) / len(values) if len(values) > 1 else 0.0
        places_x, places_y = (tuple(_number("places", value) for value in places) for places in (at_x, at_y))
        n_places = len(set(zip_longest(places_x, places_y)))
        sd = math.sqrt(scatter + resolution**2 / 12 / (len(values) if n_places > 1 else 1))
        return cls(statistics.mean(values), sd, kind, readings=values, resolution=resolution,
                   at_x=places_x, at_y=places_y, place_sd=_number("place_sd", place_sd))  # fmt: skip

    @classmethod
    def of(cls, stated: Quantity | ArrayLike | None, kind: DensityKind = "log-normal") -> Quantity:
        """A stated value as a quantity: a number is exact, an array holds readings, a quantity stays.

        Parameters
        ----------
        stated : Quantity, number or array of any shape, in the quantity's unit
        kind : {"normal", "log-normal"}
            Of readings; see the class.

        Returns
        -------
        Quantity

        Raises
        ------
        InputError
            If it is none of these, or not finite.
        """
        if isinstance(stated, Quantity):
            return stated
        try:
            values = np.asarray(stated)
        except ValueError:  # rows of different lengths
            values = np.asarray(None)
        if values.dtype.kind not in "iuf" or np.ma.is_masked(stated):
            raise InputError(Fault("quantity", "a number, an array of readings or a Quantity", repr(stated)))
        if not np.isfinite(values).all():
            raise InputError(Fault("quantity", "finite numbers", repr(stated)))
        if values.ndim:
            return cls.from_readings(values.astype(np.float64).ravel().tolist(), kind=kind)
        return cls.exact(float(values))

    @property
    def has_profile(self) -> bool:
        """Whether the readings have places, so that they describe how the quantity varies over the plate."""
        return bool(self.at_x or self.at_y)

    def scaled(self, factor: float, place_factor: float = 1.0) -> Quantity:
        """The same quantity in another unit.

        Parameters
        ----------
        factor : float
            Positive. It multiplies mean, sd, bounds, readings and resolution.
        place_factor : float
            The same for the places of the readings.
        """
        if not factor > 0:
            raise ValueError(f"factor: wanted a positive number, got {factor}")
        return replace(
            self,
            mean=self.mean * factor,
            sd=self.sd * factor,
            lower=self.lower * factor,
            upper=self.upper * factor,
            readings=tuple(value * factor for value in self.readings),
            resolution=self.resolution * factor,
            at_x=tuple(place * place_factor for place in self.at_x),
            at_y=tuple(place * place_factor for place in self.at_y),
            place_sd=self.place_sd * place_factor,
        )


def is_number(value: object) -> bool:
    """Whether a value is a number: no text, no truth value, no array of several."""
    is_scalar = isinstance(value, np.ndarray) and not value.ndim and value.dtype.kind in "iuf"
    return not isinstance(value, bool) and (is_scalar or isinstance(value, Real))


def _number(place: str, value: object) -> float:
    """A number as such; raises InputError for anything else."""
    if not is_number(value):
        raise InputError(Fault(place, "a number", repr(value)))
    return float(value)  # type: ignore[arg-type]
