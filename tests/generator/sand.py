"""Pictures of sand on a ringing board: uneven, partial, noisy, turned, seen from the side, as people take them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

Floats = NDArray[np.float64]

_WIDTH = 360
"""Pixels along x."""


def photograph(
    rng: np.random.Generator,
    shape: Callable[[Floats, Floats], Floats],
    sides: tuple[float, float],
    *,
    turn: float = 5.0,
    slant: float = 0.08,
    missing: float = 0.3,
    grain: float = 0.25,
) -> Floats:
    """A picture of the sand on a board that rings in one shape, cropped to the board: shades, rows downward.

    shape: deflection on the grid that x and y (m) span; turned by up to so many degrees, one end smaller by up to the
    share slant; missing: share of the board that has lost its sand; grain: noise over the contrast of the sand.
    """
    L_x, L_y = sides
    columns, rows = _WIDTH, max(round(_WIDTH * L_y / L_x), 40)
    level = np.abs(shape(np.linspace(0.0, L_x, columns), np.linspace(0.0, L_y, rows)))
    level = level / level.max()
    sand = np.exp(-((level / rng.uniform(0.05, 0.18)) ** 2))
    blots = gaussian_filter(rng.standard_normal((columns, rows)), columns / 12.0)
    sand = sand * np.clip(1.0 + 0.6 * blots / blots.std(), 0.1, None)
    holes = gaussian_filter(rng.standard_normal((columns, rows)), columns / 7.0)
    sand[holes < np.quantile(holes, rng.uniform(0.0, missing))] = 0.0
    angle = np.radians(rng.uniform(-turn, turn))
    along, across = rng.uniform(-slant, slant, 2)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, columns), np.linspace(-0.5, 0.5, rows), indexing="ij")
    u, v = x * columns, y * rows
    depth = 1.0 + along * x + across * y
    there = (np.cos(angle) * u - np.sin(angle) * v) / depth + 0.5 * columns
    upward = (np.sin(angle) * u + np.cos(angle) * v) / depth + 0.5 * rows
    seen = _looked_up(sand, there, upward)
    ground = 0.25 + 0.2 * x * rng.uniform(-1.0, 1.0) + 0.2 * y * rng.uniform(-1.0, 1.0)
    picture = ground + 0.5 * seen + 0.5 * grain * rng.standard_normal(seen.shape)
    picture = picture if rng.random() < 0.7 else 1.0 - picture  # dark tea leaves on a light board
    return np.clip(picture, 0.0, 1.0).T[::-1]


def _looked_up(values: Floats, i: Floats, j: Floats) -> Floats:
    """Nearest values at places in pixels; nothing beyond the board."""
    rows, columns = np.rint(i).astype(int), np.rint(j).astype(int)
    inside = (rows >= 0) & (rows < values.shape[0]) & (columns >= 0) & (columns < values.shape[1])
    found = np.zeros(i.shape)
    found[inside] = values[rows[inside], columns[inside]]
    return found
