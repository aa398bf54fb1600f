"""How results name constants and print numbers: as many digits as a standard deviation has meaning, units of people."""

from __future__ import annotations

from typing import Protocol

GPA = 1e-9
"""GPa in one Pa."""

MISSING = "–"
"""Stands where there is no number."""

CONSTANTS = {"E_x": "along the grain", "E_y": "across the grain", "G_xy": "shear"}
STIFFNESS = {
    "E_x": "stiffness along the grain",
    "E_y": "stiffness across the grain",
    "G_xy": "shear stiffness",
}
"""What each modulus is, to be read without its symbol."""

_ALIKE = 1e-12
_MOST_DECIMALS = 6


class Uncertain(Protocol):
    """A number with its standard deviation."""

    @property
    def mean(self) -> float:
        """The number."""

    @property
    def sd(self) -> float:
        """Its standard deviation."""


class Interval(Uncertain, Protocol):
    """The same with the ends of its 90 % interval."""

    @property
    def q05(self) -> float:
        """The lower end."""

    @property
    def q95(self) -> float:
        """The upper end."""


def constant_name(name: str) -> str:
    """A modulus with its words: "E_x, along the grain"."""
    return f"{name}, {CONSTANTS[name]}"


def narrow_name(name: str) -> str:
    """The same for a table of 80 columns: "E_x, along grain"."""
    return constant_name(name).replace(" the ", " ")


def decimals(sd: float) -> int:
    """Decimals that show two significant digits of a standard deviation, at most six."""
    digits = 0
    while sd < 9.95 and digits < _MOST_DECIMALS and sd > 0:
        sd *= 10
        digits += 1
    return digits


def plus_minus(entry: Uncertain, factor: float = 1.0) -> str:
    """Mean ± sd, two digits of the sd; the number alone where it is exact."""
    mean, sd = entry.mean * factor, entry.sd * factor
    if sd <= _ALIKE * abs(mean):
        return f"{mean:.4g}"
    digits = decimals(sd)
    return f"{mean:,.{digits}f} ± {sd:,.{digits}f}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def interval(entry: Interval, factor: float = 1.0) -> str:
    """The middle 90 %."""
    digits = decimals(entry.sd * factor)
    return f"{entry.q05 * factor:.{digits}f} to {entry.q95 * factor:.{digits}f}"


def number(value: float | None, digits: int, *, signed: bool = False, factor: float = 1.0) -> str:
    """A number with fixed decimals, or a dash where there is none."""
    if value is None:
        return MISSING
    return f"{value * factor:{'+' if signed else ''}.{digits}f}"


def percent(share: float | None, digits: int = 0) -> str:
    """A share of one in per cent."""
    return MISSING if share is None else f"{100 * share:.{digits}f} %"


def mode_name(label: str, setup: str, *, several: bool) -> str:
    """A mode by its label, and by its setup where there are several."""
    return f"{label} {setup}" if several else label
