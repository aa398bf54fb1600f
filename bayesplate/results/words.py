"""How results name constants and print numbers: as many digits as a standard deviation has meaning, units of people."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

GPA = 1e-9
"""GPa in one Pa."""

MISSING = "–"
"""Stands where there is no number."""

CONSTANTS = {"E_x": "along the grain", "E_y": "across the grain", "G_xy": "shear"}
_ANY = "in any direction"
CONSTANTS_OF_ISOTROPIC = {"E_x": _ANY, "E_y": _ANY, "G_xy": "shear"}
STIFFNESS = {"E_x": "stiffness along the grain", "E_y": "stiffness across the grain", "G_xy": "shear stiffness"}
"""What each modulus is, to be read without its symbol."""
STIFFNESS_OF_ISOTROPIC = {"E_x": f"stiffness {_ANY}", "E_y": f"stiffness {_ANY}", "G_xy": "shear stiffness"}

_ALIKE = 1e-12
_MOST_DECIMALS = 8


class Uncertain(Protocol):
    """A number with its standard deviation."""

    @property
    def mean(self) -> float: ...

    @property
    def sd(self) -> float: ...


class Interval(Uncertain, Protocol):
    """The same with the ends of its 90 % interval."""

    @property
    def q05(self) -> float: ...

    @property
    def q95(self) -> float: ...


@dataclass(frozen=True)
class Value:
    """A number at full precision that prints with the digits that have meaning for people."""

    mean: float | None = None  # None where there is no number
    # its standard deviation, which decides on the digits; None where it is printed with fixed decimals
    sd: float | None = None
    ends: tuple[float, float] | None = None  # of an interval, in place of a mean
    digits: int = 0  # fixed decimals
    signed: bool = False  # whether a positive number has its sign
    unit: str = ""  # printed after it
    times: float = 1.0  # what it is multiplied by in print: 100 for a share in per cent

    def __str__(self) -> str:
        if self.ends is not None:
            return " to ".join(map(self._fixed, self.ends)) + self.unit
        if self.mean is None:
            return MISSING
        if self.sd is None:
            return self._fixed(self.mean) + self.unit
        return " ± ".join(text for text in rounded(self.mean, self.sd) if text) + self.unit

    def _fixed(self, number: float) -> str:
        """Fixed decimals, zero without a sign."""
        return _unsigned_zero(f"{number * self.times:{'+' if self.signed else ''}.{self.digits}f}")


def constant_name(name: str, *, isotropic: bool = False) -> str:
    """A modulus with its words: "E_x, along the grain"; an isotropic plate has no grain."""
    return f"{name}, {(CONSTANTS_OF_ISOTROPIC if isotropic else CONSTANTS)[name]}"


def narrow_name(name: str, *, isotropic: bool = False) -> str:
    """The same for a table of 80 columns: "E_x, along grain", "E_x, any direction"."""
    return constant_name(name, isotropic=isotropic).replace(" the ", " ").replace(" in any ", " any ")


def is_isotropic(moduli: Mapping[str, object]) -> bool:
    """Whether E_x and E_y are one modulus: to the last digit they agree of isotropic plates alone."""
    return moduli["E_x"] == moduli["E_y"]


def decimals(sd: float) -> int:
    """Decimals that show two significant digits of a standard deviation, at most eight."""
    return min(max(_place(sd), 0), _MOST_DECIMALS)


def _place(sd: float) -> int:
    """Decimal place of the second significant digit; negative left of the point: -1 for 120, 1 for 3.4, 3 for 0.028."""
    return 1 - int(f"{sd:.1e}".partition("e")[2]) if 0 < sd < float("inf") else 0


def rounded(mean: float, sd: float) -> tuple[str, str]:
    """A mean and its standard deviation as they are printed everywhere.

    The sd has two significant digits and the mean ends at the same decimal place, thousands stand apart. A mean that is
    exact has five digits, and no sd.
    """
    if sd <= _ALIKE * abs(mean):
        return f"{mean:.5g}", ""
    place, digits = _place(sd), decimals(sd)
    texts = (f"{round(value, place):,.{digits}f}" for value in (mean, sd))
    mean_text, sd_text = (_unsigned_zero(text).replace(",", "\N{NARROW NO-BREAK SPACE}") for text in texts)
    return mean_text, sd_text


def plus_minus(entry: Uncertain, factor: float = 1.0, unit: str = "") -> Value:
    """Mean ± sd as of `rounded`; the number alone where it is exact."""
    return Value(entry.mean * factor, entry.sd * factor, unit=unit)


def interval(entry: Interval, factor: float = 1.0, unit: str = "") -> Value:
    """The middle 90 %, to the decimal place of the mean."""
    return Value(ends=(entry.q05 * factor, entry.q95 * factor), digits=decimals(entry.sd * factor), unit=unit)


def number(value: float | None, digits: int, *, signed: bool = False, factor: float = 1.0) -> Value:
    """A number with fixed decimals, zero without a sign, or a dash where there is none."""
    return Value(None if value is None else value * factor, digits=digits, signed=signed)


def cents_alike(*values: float) -> list[str]:
    """Errors that stand beside each other, cents: whole ones, with a decimal where one is below ten."""
    return [f"{value:.0f}" if min(values) >= 10.0 else f"{value:.1f}" for value in values]


def two_digits(value: float | None, factor: float = 1.0) -> Value:
    """A number of which only the size matters, as an error or a standard deviation in per cent: 0.028, 3.0, 17."""
    return number(value, 0 if value is None else decimals(abs(value * factor)), factor=factor)


def _unsigned_zero(text: str) -> str:
    return text if text.strip("+-0.") else text.lstrip("+-")


def percent(share: float | None, digits: int = 0) -> Value:
    """A share of one in per cent."""
    return Value(share, digits=digits, unit=" %", times=100.0)


def mode_name(label: str, setup: str, *, several: bool) -> str:
    """A mode by its label, and by its setup where there are several."""
    return f"{label} {setup}" if several else label


def chances(found: Mapping[str, float]) -> str:
    """What something may be, each with its probability; the sign of a missing value where there is nothing."""
    return ", ".join(f"{name} {percent(share)}" for name, share in found.items()) or MISSING
