"""A smooth course through readings at places on the board."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_BEYOND = 0.5
_FEWEST_FOR_CURVATURE = 9
_MEAN_POINTS = 200


@dataclass(frozen=True)
class Stations:
    """Readings at places, and a surface through them.

    Where the places form a grid (every x with every y; a row of places is one) the surface is bilinear between them and
    goes on as straight for half the distance of the outermost two, then stays. Scattered places are fitted by least
    squares with a plane, or from nine on with a quadratic, which stays beyond their range. Readings at one place are
    averaged.

    Attributes
    ----------
    x, y : tuple of float
        Places, in any unit.
    values : tuple of float
        Readings.
    """

    x: tuple[float, ...]
    y: tuple[float, ...]
    values: tuple[float, ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Values at points: arrays that broadcast."""
        if self._grid is None:
            return self._fitted(x, y)
        i, s = _between(x, self._axes[0])
        j, t = _between(y, self._axes[1])
        grid = self._grid
        low = grid[i, j] * (1.0 - t) + grid[i, j + 1] * t
        high = grid[i + 1, j] * (1.0 - t) + grid[i + 1, j + 1] * t
        return np.asarray(low * (1.0 - s) + high * s)

    @property
    def varies_along_y(self) -> bool:
        """Whether the surface is not the same across the board."""
        return len(set(self.y)) > 1

    @cached_property
    def _axes(self) -> tuple[Floats, Floats]:
        """The places along each side, increasing, each once."""
        return np.unique(self.x), np.unique(self.y)

    @cached_property
    def mean(self) -> float:
        """Mean over the unit square."""
        middle = (np.arange(_MEAN_POINTS) + 0.5) / _MEAN_POINTS
        return float(np.mean(self(middle[:, None], middle)))

    @cached_property
    def _grid(self) -> Floats | None:
        """Means of the readings at each place of the grid, with its last row and column twice; None: not a grid."""
        at_x, at_y = self._axes
        rows, columns = np.searchsorted(at_x, self.x), np.searchsorted(at_y, self.y)
        counts, sums = np.zeros((2, at_x.size, at_y.size))
        np.add.at(counts, (rows, columns), 1.0)
        np.add.at(sums, (rows, columns), self.values)
        if not counts.all():
            return None
        return np.pad(sums / counts, ((0, 1), (0, 1)), mode="edge")

    def _fitted(self, x: Floats, y: Floats) -> Floats:
        coefficients = np.linalg.lstsq(self._powers(np.array(self.x), np.array(self.y)), self.values, rcond=1e-9)[0]
        return np.asarray(self._powers(x, y) @ coefficients)

    def _powers(self, x: Floats, y: Floats) -> Floats:
        scaled = []
        for at, places in ((x, self.x), (y, self.y)):
            low, high = min(places), max(places)
            scaled.append((np.clip(at, low, high) - 0.5 * (low + high)) / max(high - low, 1e-300))
        s, t = np.broadcast_arrays(*scaled)
        columns = [np.ones_like(s), s, t]
        if len(self.values) >= _FEWEST_FOR_CURVATURE:
            columns += [s * s, s * t, t * t]
        return np.stack(columns, axis=-1)


def _between(at: Floats, stations: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Index of the station before each point, and the share of the way to the next one that lies behind the point."""
    if stations.size == 1:
        return np.zeros(np.shape(at), dtype=np.intp), np.zeros(np.shape(at))
    before = np.clip(np.searchsorted(stations, at, side="right") - 1, 0, stations.size - 2)
    share = (at - stations[before]) / (stations[before + 1] - stations[before])
    return before, np.clip(share, -_BEYOND, 1.0 + _BEYOND)
