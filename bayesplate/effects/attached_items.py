"""Items that may be fixed to a board: their mass, their rotary inertia, and their places."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import Board, Values, nominal_mass, vibrating_lengths
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import Setup
from bayesplate.effects.base import Floats

Fractions = tuple[tuple[float, float], ...]
"""Places as fractions of the vibrating sides."""
Places = tuple[tuple[float, float], ...]
"""Places on the whole board, m from the corner of x0 and y0."""

_PRIORS = {
    "accelerometer": (Quantity.from_median(1.4e-3, 2.7), "log-normal: accelerometers for light boards weigh 0.2-10 g"),
    "shaker": (Quantity.from_median(10e-3, 2.0), "log-normal: force sensor, stinger and armature move 3-40 g"),
    "weight": (Quantity.from_median(5e-3, 3.0), "log-normal: a weight of 0.5-50 g"),
}
_UNKNOWN_SHARE = 0.02
_UNKNOWN_SOURCE = "half-normal: something small that was forgotten, two percent of the board"

_SOLID_DENSITY = 5000.0
_GYRATION = 1.0 / 16.0 + 1.0 / 3.0
"""Of a cylinder as high as wide, about a diameter of its base, over the square of that diameter."""

_GRID = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class PlacedItem:
    mass: Quantity
    source: str  # of the mass; empty if the card states it
    places: Fractions  # several are those over which it roved
    # of its base, over the two sides; 0 if it does not turn with the board, as on a stinger
    radius: tuple[float, float] = (0.0, 0.0)
    base: float = 0.0  # radius of its base, m
    # where the plate begins and ends along y at each place; empty: the whole rectangle
    reach: tuple[tuple[float, float], ...] = ()


def base_diameter(mass: Floats | float) -> Floats:
    """Diameter, m, of a compact solid of that mass."""
    return np.asarray(np.cbrt(4.0 * mass / (np.pi * _SOLID_DENSITY)))


def rotary_inertia(mass: Floats) -> Floats:
    """Rotary inertia, kg m^2, of a compact solid of that mass about a line in its base."""
    return np.asarray(mass * _GYRATION * base_diameter(mass) ** 2)


def item_on_board(board: Board, setup: Setup, item: AttachedItem) -> PlacedItem:
    """An item of the card: its mass, or the prior of its kind, and its places on the vibrating part."""
    mass, source = (item.mass, "") if item.mass is not None else _PRIORS[item.kind]
    base = 0.0 if item.kind == "shaker" else 0.5 * float(base_diameter(mass.median))
    return PlacedItem(mass, source, fractions_on(board, setup, item.places), radius_on(board, setup, base), base)


def items_on_board(board: Board, setup: Setup, item: AttachedItem) -> list[PlacedItem]:
    """An item of the card at its places, or at each of the likely places where the card states none."""
    placed = item_on_board(board, setup, item)
    return [placed] if item.places else [replace(placed, places=(place,)) for place in _likely_places(setup)]


def fractions_on(board: Board, setup: Setup, places: Places) -> Fractions:
    """Places as fractions of the sides that vibrate in a setup, at nominal sizes; clamped places are at the rim."""
    return tuple(fractions_of(setup, place, board.nominal()) for place in places)


def fractions_of(setup: Setup, place: tuple[float, float], values: Values) -> tuple[float, float]:
    """One place as fractions of the sides that vibrate in a setup, at given sizes."""
    starts, sides = _vibrating_range(values, setup)
    x, y = ((at - start) / side for at, start, side in zip(place, starts, sides, strict=True))
    return float(np.clip(x, 0.0, 1.0)), float(np.clip(y, 0.0, 1.0))


def places_on(board: Board, setup: Setup, fractions: Fractions) -> Places:
    """Places on the whole board from fractions of the sides that vibrate in a setup; the inverse of `fractions_on`."""
    starts, sides = _vibrating_range(board.nominal(), setup)
    return tuple((starts[0] + s * sides[0], starts[1] + t * sides[1]) for s, t in fractions)


def radius_on(board: Board, setup: Setup, base: float) -> tuple[float, float]:
    """The radius of a base over the two sides that vibrate in a setup."""
    _, sides = _vibrating_range(board.nominal(), setup)
    return base / sides[0], base / sides[1]


def are_mirrored(places: Fractions, axis: int) -> bool:
    """Whether places are their own mirror images along x (0) or y (1)."""
    rounded = Counter((round(x, 6), round(y, 6)) for x, y in places)
    mirrored = [(1.0 - x, y) if axis == 0 else (x, 1.0 - y) for x, y in places]
    return rounded == Counter((round(x, 6), round(y, 6)) for x, y in mirrored)


def _vibrating_range(values: Values, setup: Setup) -> tuple[tuple[float, float], tuple[float, float]]:
    """Start and length of the vibrating part along x and y, m."""
    length_x, length_y = vibrating_lengths(values, setup)
    x, y = (float(values[setup.input_name(edge)]) if edge in setup.clamped else 0.0 for edge in ("x0", "y0"))
    return (x, y), (float(length_x), float(length_y))


def forgotten_items(board: Board, setup: Setup) -> list[PlacedItem]:
    """One small item at each of the places where a forgotten item might be."""
    mass = Quantity.from_mean(0.0, _UNKNOWN_SHARE * nominal_mass(board), "normal", lower=0.0)
    return [PlacedItem(mass, _UNKNOWN_SOURCE, (place,)) for place in _likely_places(setup)]


def _likely_places(setup: Setup) -> Fractions:
    """Places on a coarse grid, without those beside held edges and the mirror images of others."""
    coordinates = []
    for low, high in (setup.ends_x, setup.ends_y):
        inside = [p for p in _GRID if (p > 0.1 or low == "free") and (p < 0.9 or high == "free")]
        coordinates.append([p for p in inside if p <= 0.5] if low == high else inside)
    return tuple((x, y) for x in coordinates[0] for y in coordinates[1])
