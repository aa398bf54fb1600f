"""Units of the keys of a card: what each is in SI, and numbers written so that reading them gives the same again."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import product

from bayesplate.board.quantity import Quantity

SI = {"mm": 1e-3, "g": 1e-3, "GPa": 1e9, "%": 1e-2}
"""Of units that are not themselves of SI."""
OTHER_UNITS = {
    "mm": {"in": 25.4, "inch": 25.4, "inches": 25.4, '"': 25.4, "thou": 0.0254, "mil": 0.0254, "cm": 10.0, "m": 1000.0},
    "g": {"kg": 1000.0, "oz": 28.3495, "lb": 453.592},
    "Hz": {"kHz": 1000.0},
}
"""What people write in place of the unit of a key, in that unit."""
_DIGITS = 12
"""Where they say a number but for the rounding of a change of units, they are the ones that somebody wrote."""
_ROUNDING = 2e-15


def in_unit(value: float, scale: float = 1.0) -> float:
    """A number in the unit of its key, which is `scale` in SI: times the scale it is the value again."""
    written = value / scale
    short = _short(written)
    if math.isclose(short * scale, value, rel_tol=_ROUNDING, abs_tol=0.0):
        return short
    return next((near for near in _near(written) if near * scale == value), written)


def median_and_factor(
    one: Quantity, scale: float, read: Callable[[float, float], Quantity] = Quantity.from_median
) -> tuple[float, float]:
    """Median and factor of a log-normal density as its key has them; `read` makes the density of two such numbers."""
    median, factor = one.median / scale, one.factor
    short = (_short(median), _short(factor))
    if short[1] > 1 and _is_alike(read(*short), one):
        return short
    near = ((short[0], factor), *product(_near(median), _near(factor)))
    return next((pair for pair in near if pair[1] > 1 and read(*pair) == one), (median, factor))


def _short(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}")


def _is_alike(found: Quantity, one: Quantity) -> bool:
    """Whether two densities are the same to the rounding of a change of units."""
    pairs = ((found.mean, one.mean), (found.sd, one.sd))
    return all(math.isclose(a, b, rel_tol=_ROUNDING, abs_tol=0.0) for a, b in pairs)


def _near(value: float) -> tuple[float, ...]:
    """The number and those next to it: a change of units rounds."""
    up, down = math.nextafter(value, math.inf), math.nextafter(value, -math.inf)
    return value, up, down, math.nextafter(up, math.inf), math.nextafter(down, -math.inf)
