"""Gauss points of a plate whose width varies along it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from generator.basis import Basis, Floats, gauss

Outline = tuple[tuple[float, float], ...]
"""Stations x and widths, m, linear between them, centred on the middle line."""


def outline_points(basis: Basis, outline: Outline, covered: float) -> tuple[Floats, Floats, Floats]:
    """Gauss points x and y, m, and weights, m^2, of an outline, piece by piece between its stations.

    `covered`, m, lies before x = 0; the middle line is that of the basis.
    """
    stations, widths = (np.array(values) for values in zip(*outline, strict=True))
    inside = (stations > covered) & (stations < covered + basis.L_x)
    breaks = np.concatenate([[0.0], stations[inside] - covered, [basis.L_x]])
    s, ahead = gauss(basis.n[0])
    t, weights = gauss(basis.n[1])
    x = np.concatenate([0.5 * (a + b) + 0.5 * (b - a) * s for a, b in pairwise(breaks)])
    along = np.concatenate([0.5 * (b - a) * ahead for a, b in pairwise(breaks)])
    width = np.interp(x + covered, stations, widths)
    y = 0.5 * basis.L_y + 0.5 * width[:, None] * t
    area = along[:, None] * 0.5 * width[:, None] * weights
    return np.repeat(x, len(t)), y.ravel(), area.ravel()
