"""A body that hangs on a plate by a spring: one more unknown beside those of its deflection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.basis import Floats


@dataclass(frozen=True)
class Rider:
    """Mass (kg), spring (N/m), and the deflection of the board's unknowns where the spring is fixed, (size,)."""

    mass: float
    spring: float
    moved: Floats

    def joined(self, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        """Both matrices with this body's deflection as the last unknown."""
        stretch = np.zeros(len(stiffness) + 1)
        stretch[: len(self.moved)] = self.moved
        stretch[-1] = -1.0
        stiffness, mass = (np.pad(matrix, (0, 1)) for matrix in (stiffness, mass))
        mass[-1, -1] = self.mass
        return stiffness + self.spring * np.outer(stretch, stretch), mass
