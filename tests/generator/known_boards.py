"""The paper's two boards and others of physics.md as plates of the generator; fields and shifts that tests ask for."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from generator.basis import Basis, Floats
from generator.designs import ALL_CLAMPED, ALL_FREE, CANTILEVER
from generator.effects import NoEffect
from generator.naming import Label, frequencies
from generator.plate import Plate

FINNISH = Plate(13.0e9, 0.702e9, 0.668e9, 0.51, 473.9, 3e-3, 0.223, 0.114, CANTILEVER)
FIEMME = Plate(10.4e9, 1.003e9, 0.53e9, 0.51, 399.0, 3e-3, 0.600, 0.412, ALL_CLAMPED)
FREE = Plate(12.0e9, 0.9e9, 0.75e9, 0.4, 429.0, 4.7e-3, 0.580, 0.217, ALL_FREE)
HALF_TOP = Plate(12.0e9, 1.0e9, 0.9e9, 0.4, 450.0, 4.15e-3, 0.580, 0.2172, ALL_FREE)
"""A guitar's half-top, on which physics.md tells what warp does."""
DRIVEN = replace(FIEMME, nu_xy=0.4)
"""The paper's clamped board, on which it tells what an exciter does."""
STEEL = Plate.isotropic(200.0e9, 0.3, 7797.0, 8.96e-3, 0.270, 0.1495, ALL_FREE)
"""A free steel plate, measured in air and in water."""
BEAMS: dict[str, list[Label]] = {
    "cantilever": [(0, 0), (0, 1), (1, 0), (0, 2), (1, 1), (1, 2)],
    "clamped": [(0, 0), (0, 1), (1, 0), (1, 1), (0, 2), (1, 2)],
    "half-top": [(1, 1), (2, 0), (2, 1), (0, 2), (1, 2), (3, 0), (3, 1), (2, 2), (4, 0)],
    "steel": [(2, 0), (1, 1), (2, 1), (3, 0), (0, 2)],
}


def cents(plate: Plate, effects: Sequence[NoEffect], beams: Sequence[Label]) -> Floats:
    """Shift of each mode by effects, cents."""
    bare, changed = frequencies(plate, (), beams)[0], frequencies(plate, effects, beams)[0]
    return np.array([1200.0 * np.log2(changed[mode] / bare[mode]) for mode in beams])


def field(basis: Basis, w: Callable[[Floats, Floats], Floats]) -> Floats:
    """Unknowns of a deflection that the thin basis holds exactly: (size,) array."""
    x, y, _ = basis.points
    return np.linalg.lstsq(basis.deflection(x, y), w(x, y), rcond=None)[0]
