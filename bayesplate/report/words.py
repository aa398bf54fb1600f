"""Numbers as a page shows them: a mean with as many digits as its standard deviation has meaning, intervals, shares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesplate.effects import EFFECTS
from bayesplate.results.tables import decimals

GPA = 1e-9
MISSING = "–"


def plus_minus(entry: Mapping[str, Any], factor: float = 1.0) -> str:
    """Mean ± sd, two digits of the sd; the number alone where it is exact."""
    mean, sd = entry["mean"] * factor, entry["sd"] * factor
    if sd <= 1e-12 * abs(mean):
        return f"{mean:.4g}"
    digits = decimals(sd)
    return f"{mean:,.{digits}f} ± {sd:,.{digits}f}".replace(",", "\N{NARROW NO-BREAK SPACE}")


def interval(entry: Mapping[str, Any], factor: float = 1.0) -> str:
    """The middle 90 %."""
    digits = decimals(entry["sd"] * factor)
    return f"{entry['q05'] * factor:.{digits}f} to {entry['q95'] * factor:.{digits}f}"


def number(value: float | None, digits: int, *, signed: bool = False, factor: float = 1.0) -> str:
    """A number with fixed decimals, or a dash where there is none."""
    if value is None:
        return MISSING
    return f"{value * factor:{'+' if signed else ''}.{digits}f}"


def percent(share: float | None, digits: int = 0) -> str:
    """A share of one in per cent."""
    return MISSING if share is None else f"{100 * share:.{digits}f} %"


def effect_sentence(name: str) -> str:
    """What an effect is, in one plain sentence; empty for a name that the library does not know."""
    return EFFECTS[name].sentence if name in EFFECTS else ""
