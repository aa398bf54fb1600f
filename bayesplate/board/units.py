"""Units of a card's keys: their size in SI, and numbers written so that reading them returns the same value."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

from bayesplate.board.quantity import Quantity

SI = {"mm": 1e-3, "g": 1e-3, "GPa": 1e9, "%": 1e-2}
"""Size in SI of the units that are not SI units."""
OTHER_UNITS = {
    "mm": {"in": 25.4, "inch": 25.4, "inches": 25.4, '"': 25.4, "thou": 0.0254, "mil": 0.0254, "cm": 10.0, "m": 1000.0},
    "g": {"kg": 1000.0, "oz": 28.3495, "lb": 453.592},
    "Hz": {"kHz": 1000.0},
}
"""Units that people write in place of a key's unit, with their size in that unit."""
_DIGITS = 12
"""Significant digits of a number as somebody wrote it; further digits come from the rounding of a change of units."""
_ROUNDING = 2e-15


def in_unit(value: float, scale: float = 1.0) -> float:
    """A value in SI in the unit of its key, which is `scale` in SI: times the scale it is the value again."""
    number = value / scale
    rounded = _rounded(number)
    if math.isclose(rounded * scale, value, rel_tol=_ROUNDING, abs_tol=0.0):
        return rounded
    return next((neighbour for neighbour in _neighbours(number) if neighbour * scale == value), number)


def median_and_factor(
    quantity: Quantity, scale: float, read: Callable[[float, float], Quantity] = Quantity.from_median
) -> tuple[float, float]:
    """Median and factor of a log-normal density in the unit of its key; `read` makes a density of two such numbers."""
    median, factor = quantity.median / scale, quantity.factor
    rounded = (_rounded(median), _rounded(factor))
    if rounded[1] > 1 and _are_close(read(*rounded), quantity):
        return rounded
    candidates = ((rounded[0], factor), *product(_neighbours(median), _neighbours(factor)))
    return next((pair for pair in candidates if pair[1] > 1 and read(*pair) == quantity), (median, factor))


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def _are_close(quantity: Quantity, other: Quantity) -> bool:
    """Whether two densities agree to the rounding of a change of units."""
    pairs = ((quantity.mean, other.mean), (quantity.sd, other.sd))
    return all(math.isclose(a, b, rel_tol=_ROUNDING, abs_tol=0.0) for a, b in pairs)


def _neighbours(value: float) -> tuple[float, ...]:
    """A number and the floating-point numbers next to it: a change of units rounds."""
    up, down = math.nextafter(value, math.inf), math.nextafter(value, -math.inf)
    return value, up, down, math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
