"""How results name constants and print numbers, with digits according to their standard deviations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

GPA = 1e-9
"""GPa per Pa."""

MISSING = "–"
"""Printed in place of a missing number."""

MODULUS_WORDS = {"E_x": "along the grain", "E_y": "across the grain", "G_xy": "shear"}
_ANY_DIRECTION = "in any direction"
MODULUS_WORDS_OF_ISOTROPIC = {"E_x": _ANY_DIRECTION, "E_y": _ANY_DIRECTION, "G_xy": "shear"}
STIFFNESS_WORDS = {"E_x": "stiffness along the grain", "E_y": "stiffness across the grain", "G_xy": "shear stiffness"}
"""Name of each modulus without its symbol."""
STIFFNESS_WORDS_OF_ISOTROPIC = {
    "E_x": f"stiffness {_ANY_DIRECTION}",
    "E_y": f"stiffness {_ANY_DIRECTION}",
    "G_xy": "shear stiffness",
}

_EXACT_RATIO = 1e-12
_MOST_DECIMALS = 8


class UncertainNumber(Protocol):
    """A number with its standard deviation."""

    @property
    def mean(self) -> float: ...

    @property
    def sd(self) -> float: ...


class Interval(UncertainNumber, Protocol):
    """A number with its standard deviation and the ends of its 90 % interval."""

    @property
    def q05(self) -> float: ...

    @property
    def q95(self) -> float: ...


@dataclass(frozen=True)
class Value:
    """A number at full precision that prints with its significant digits."""

    mean: float | None = None  # None where there is no number
    sd: float | None = None  # standard deviation, which sets the digits; None for fixed decimals
    ends: tuple[float, float] | None = None  # of an interval, in place of a mean
    digits: int = 0  # fixed decimals
    signed: bool = False  # whether a positive number is printed with its sign
    unit: str = ""  # printed after the number
    factor: float = 1.0  # factor in print: 100 for a share in per cent

    def __str__(self) -> str:
        if self.ends is not None:
            return " to ".join(map(self._fixed, self.ends)) + self.unit
        if self.mean is None:
            return MISSING
        if self.sd is None:
            return self._fixed(self.mean) + self.unit
        return " ± ".join(text for text in rounded_texts(self.mean, self.sd) if text) + self.unit

    def _fixed(self, number: float) -> str:
        """Fixed decimals, zero without a sign."""
        return _unsigned_zero(f"{number * self.factor:{'+' if self.signed else ''}.{self.digits}f}")


def constant_name(name: str, *, isotropic: bool = False) -> str:
    """A modulus and its direction: "E_x, along the grain"; an isotropic plate has no grain."""
    return f"{name}, {(MODULUS_WORDS_OF_ISOTROPIC if isotropic else MODULUS_WORDS)[name]}"


def narrow_name(name: str, *, isotropic: bool = False) -> str:
    """`constant_name`, shortened for a table of 80 columns: "E_x, along grain", "E_x, any direction"."""
    return constant_name(name, isotropic=isotropic).replace(" the ", " ").replace(" in any ", " any ")


def is_isotropic(moduli: Mapping[str, object]) -> bool:
    """Whether the plate is isotropic: only then are E_x and E_y equal to the last digit."""
    return moduli["E_x"] == moduli["E_y"]


def decimals(sd: float) -> int:
    """Decimals that show two significant digits of a standard deviation, at most eight."""
    return min(max(_last_place(sd), 0), _MOST_DECIMALS)


_WHOLE_HZ = 100.0
"""Frequency from which one is given without a decimal."""


def hertz_text(frequency: float, width: float = float("inf")) -> str:
    """A frequency in Hz, with the decimals that an interval of that width needs."""
    places = max(0 if frequency >= _WHOLE_HZ else 1, decimals(width) - 1)
    return f"{frequency:.{places}f}"


def hertz_range(low: float, high: float) -> str:
    """An interval of frequencies, "65.0 to 65.4"."""
    return f"{hertz_text(low, high - low)} to {hertz_text(high, high - low)}"


def _last_place(sd: float) -> int:
    """Decimal place of the second significant digit; negative left of the point: -1 for 120, 1 for 3.4, 3 for 0.028."""
    return 1 - int(f"{sd:.1e}".partition("e")[2]) if 0 < sd < float("inf") else 0


def rounded_texts(mean: float, sd: float) -> tuple[str, str]:
    """A mean and its standard deviation as texts.

    The sd has two significant digits and the mean ends at the same decimal place, with spaces between thousands. An
    exact mean has five digits and no sd.
    """
    if sd <= _EXACT_RATIO * abs(mean):
        return f"{mean:.5g}", ""
    place, digits = _last_place(sd), decimals(sd)
    texts = (f"{round(value, place):,.{digits}f}" for value in (mean, sd))
    mean_text, sd_text = (_unsigned_zero(text).replace(",", "\N{NARROW NO-BREAK SPACE}") for text in texts)
    return mean_text, sd_text


def plus_minus(entry: UncertainNumber, factor: float = 1.0, unit: str = "") -> Value:
    """Mean ± sd as of `rounded_texts`; the mean alone where it is exact."""
    return Value(entry.mean * factor, entry.sd * factor, unit=unit)


def interval(entry: Interval, factor: float = 1.0, unit: str = "") -> Value:
    """The central 90 % interval, to the decimal place of the mean."""
    return Value(ends=(entry.q05 * factor, entry.q95 * factor), digits=decimals(entry.sd * factor), unit=unit)


def number(value: float | None, digits: int, *, signed: bool = False, factor: float = 1.0) -> Value:
    """A number with fixed decimals, zero without a sign, or a dash for None."""
    return Value(None if value is None else value * factor, digits=digits, signed=signed)


def cents_texts(*values: float) -> list[str]:
    """Errors in cents with equal decimals: none, or one where an error is below ten cents."""
    return [f"{value:.0f}" if min(values) >= 10.0 else f"{value:.1f}" for value in values]


def two_digits(value: float | None, factor: float = 1.0) -> Value:
    """A number with two significant digits, such as an error or a standard deviation in per cent: 0.028, 3.0, 17."""
    shown = abs((value or 0.0) * factor)
    return number(value, decimals(shown) if shown >= 0.5 * 10.0**-_MOST_DECIMALS else 0, factor=factor)


def _unsigned_zero(text: str) -> str:
    return text if text.strip("+-0.") else text.lstrip("+-")


def percent(share: float | None, digits: int = 0) -> Value:
    """A share in per cent."""
    return Value(share, digits=digits, unit=" %", factor=100.0)


def mode_name(label: str, setup: str, *, several: bool) -> str:
    """A mode by its label, with its setup where there are several."""
    return f"{label} {setup}" if several else label


def probabilities_text(probabilities: Mapping[str, float]) -> str:
    """Alternatives with their probabilities in per cent; a dash where there are none."""
    return ", ".join(f"{name} {percent(share)}" for name, share in probabilities.items()) or MISSING
