"""Labels of modes: which product of beam functions each shape resembles, and how much."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache

import numpy as np
import ritz
from scipy.optimize import linear_sum_assignment

from generator.basis import Basis, Floats
from generator.effects import NoEffect
from generator.plate import EDGES, Modes, Plate, solve

Label = tuple[int, int]
LEAST_CORRELATION = 0.75
N_BEAMS = 8


@lru_cache(maxsize=64)
def _products(basis: Basis, words: tuple[str, ...]) -> Floats:
    """Beam products on the Gauss points, each of unit norm and weighted: (n_points, N_BEAMS^2) array."""
    x, y, weights = basis.points
    lines = []
    for ends, length, at in ((words[:2], basis.L_x, x), (words[2:], basis.L_y, y)):
        side = ritz.Side(ends, length, 14)
        once, back = np.unique(at, return_inverse=True)
        lines.append((side.values(once) @ side.beams[:, :N_BEAMS])[back])
    grid = (lines[0][:, :, None] * lines[1][:, None, :]).reshape(len(x), -1)
    return np.sqrt(weights)[:, None] * grid / np.linalg.norm(np.sqrt(weights)[:, None] * grid, axis=0)


def correlations(modes: Modes, words: tuple[str, ...]) -> Floats:
    """Size of the correlation of each mode with each beam product: (n_modes, N_BEAMS^2) array.

    A magnet that bounces on its spring bends the board a little, in a shape like that of the lowest mode: a correlation
    counts by the board's share of the motion, so that such a mode takes no label.
    """
    shapes = np.sqrt(modes.basis.points[2])[:, None] * modes.deflections
    shapes = shapes * np.sqrt(modes.shares) / np.linalg.norm(shapes, axis=0)
    return np.abs(shapes.T @ _products(modes.basis, words))


def named(modes: Modes, edges: Mapping[str, str]) -> dict[Label, tuple[float, float]]:
    """Beam orders -> frequency, Hz, and correlation, by the assignment that makes all correlations largest together.

    Beam functions are those of the nominal edges, whatever springs there are. Rigid motions take part and keep the
    labels (0,0), (0,1), (1,0) of a free plate.
    """
    table = correlations(modes, tuple(edges[edge] for edge in EDGES))
    rows, columns = linear_sum_assignment(-(table**2))
    return {
        (int(column) // N_BEAMS, int(column) % N_BEAMS): (float(modes.frequencies[row]), float(table[row, column]))
        for row, column in zip(rows, columns, strict=True)
    }


def frequencies(
    plate: Plate, effects: Sequence[NoEffect], labels: Sequence[Label], n: tuple[int, int] | None = None
) -> tuple[dict[Label, float], float]:
    """Frequencies (Hz) of labelled modes, averaged over the places of a roving mass, and the smallest correlation.

    The correlation is 0 if a label was not among the lowest modes; n: polynomials along x and along y.
    """
    runs: list[tuple[NoEffect, ...]] = [()]
    for effect in effects:
        runs = [(*run, variant) for run in runs for variant in effect.variants()]
    n_modes = len(labels) + 10
    found = [named(solve(plate, run, n_modes, n), plate.edges) for run in runs]
    if any(label not in names for names in found for label in labels):
        return {}, 0.0
    hertz = {label: float(np.mean([names[label][0] for names in found])) for label in labels}
    return hertz, min(names[label][1] for names in found for label in labels)
