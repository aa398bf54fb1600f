"""Effects that no library knows: a glued rib, a crack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from generator.basis import Basis, Floats, gauss
from generator.effects import NoEffect
from generator.plate import Plate


@dataclass(frozen=True)
class Rib(NoEffect):
    """A beam glued across the whole width at x = place, m: bending stiffness, N m^2, and mass per length, kg m^-1."""

    place: float
    stiffness: float
    line_mass: float

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        t, weights = gauss(basis.n[1])
        y, weights = 0.5 * plate.L_y * (1.0 + t), 0.5 * plate.L_y * weights
        x = np.full_like(y, self.place - plate.covered)
        bent, moved = basis.rotation(1, x, y, 0, 1), basis.deflection(x, y)
        along = weights[:, None]
        return stiffness + self.stiffness * bent.T @ (along * bent), mass + self.line_mass * moved.T @ (along * moved)


@dataclass(frozen=True)
class Crack(NoEffect):
    """A strip along the grain in which the bending stiffness across it and the twisting stiffness are reduced.

    The loss falls from the middle line to the rims of the strip as a squared cosine, so that polynomials resolve it.

    Attributes
    ----------
    start, end : float, m
        Along x.
    place, width : float, m
        Middle line and width of the strip along y.
    loss : float
        Fraction lost on the middle line, 0 to 1.
    """

    start: float
    end: float
    place: float
    width: float
    loss: float

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        start, end = max(self.start - plate.covered, 0.0), self.end - plate.covered
        (s, along), (t, across) = gauss(basis.n[0]), gauss(12)
        x, y = np.meshgrid(
            0.5 * (start + end) + 0.5 * (end - start) * s, self.place + 0.5 * self.width * t, indexing="ij"
        )
        weights = 0.25 * (end - start) * self.width * np.outer(along, across * np.cos(0.5 * np.pi * t) ** 2).ravel()
        _, across_grain, twist = basis.strains(x.ravel(), y.ravel())[0]
        cubed = plate.h**3 / 12.0
        for row, modulus in ((across_grain, plate.E_y), (twist, plate.G_xy)):  # leaves E_x and stays positive
            stiffness = stiffness - self.loss * modulus * cubed * row.T @ (weights[:, None] * row)
        return stiffness, mass
