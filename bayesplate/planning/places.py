"""Where to put sensor and hammer so that the wanted modes are seen, and where to tap to tell their figures apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.residues import NODAL_LINE

Floats = NDArray[np.float64]
Place = tuple[float, float]

REFERENCES = (
    "D. J. Ewins: Modal Testing: Theory, Practice and Application. 2nd ed., Research Studies Press (2000). "
    "[the residue at the driving point, by which places are chosen]",
    "K. Manohar, B. W. Brunton, J. N. Kutz, S. L. Brunton: Data-driven sparse sensor placement for reconstruction. "
    "IEEE Control Syst. Mag. 38, 63-86 (2018), doi:10.1109/MCS.2018.2810460. [places by pivoted QR]",
)
_APART = 0.25
"""Least distance between sensor and hammer, as a fraction of a side."""
_MARGIN = 0.03
"""Of the sides that is left free at the rim: nobody hits an edge."""


@dataclass(frozen=True)
class Placing:
    """Where to put sensor and hammer on what vibrates, as fractions of its sides."""

    sensor: Place
    hammer: Place
    # residue of each mode between the two, over the largest that its figure could give: 0 on a nodal line
    seen: tuple[float, ...]
    # where to tap to tell the figures apart, as many as there are modes: the first pivots of a QR decomposition
    taps: tuple[Place, ...]


def placing(shapes: Floats, grid: Floats, sensor: Place | None = None) -> Placing:
    """Sensor and hammer for modes with these deflections, (n_modes, n, n), on a grid of fractions of a side, x first.

    The sensor stands where it does, or where the smallest residue at the driving point is largest, the hammer where the
    smallest residue between the two is, of the modes that the sensor can see.
    """
    from scipy.linalg import qr

    inner = (grid >= _MARGIN) & (grid <= 1.0 - _MARGIN)
    at = grid[inner]
    kept = shapes[:, inner][:, :, inner]
    relative = kept / np.abs(shapes).max(axis=(1, 2))[:, None, None]
    flat = relative.reshape(len(shapes), -1)
    places = [(float(x), float(y)) for x in at for y in at]
    if sensor is None:
        first = int(np.argmax((flat**2).min(axis=0)))
    else:
        first = int(np.argmin([np.hypot(x - sensor[0], y - sensor[1]) for x, y in places]))
    apart = np.array([max(abs(x - places[first][0]), abs(y - places[first][1])) >= _APART for x, y in places])
    residues = np.abs(flat * flat[:, [first]])
    can_be_seen = np.abs(flat[:, first]) >= NODAL_LINE
    weakest = residues[can_be_seen if can_be_seen.any() else slice(None)].min(axis=0)
    second = int(np.argmax(np.where(apart, weakest, -1.0)))
    taps = tuple(places[i] for i in qr(flat, mode="economic", pivoting=True)[2][: len(shapes)])
    seen = tuple(float(one) for one in residues[:, second])
    return Placing(places[first], places[second], seen, taps)
