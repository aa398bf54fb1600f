"""The exciter: a coil glued to the board, and a magnet that hangs from it on a spring and moves by itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from generator.basis import Basis, Floats
from generator.effects import NoEffect, Places
from generator.plate import Plate
from generator.rider import Rider

COIL = 1.6e-3
"""Mass of the coil of a small exciter, kg."""
SUSPENSION = 2700.0
"""Stiffness of its suspension, N m^-1."""


@dataclass(frozen=True)
class Exciter(NoEffect):
    """A coil and a magnet; several places: frequencies are averaged over them.

    Attributes
    ----------
    mass : float, kg
        Of the whole: coil and magnet.
    places : tuple of (float, float), m
        On the whole board.
    coil_mass : float, kg
    suspension : float, N m^-1
        Spring between the two.
    magnet : str
        "free", or "held" by something outside the board: then the suspension is a spring to ground.
    """

    mass: float
    places: Places
    coil_mass: float = COIL
    suspension: float = SUSPENSION
    magnet: str = "free"

    @classmethod
    def at_resonance(
        cls, hz: float, mass: float, places: Places, coil_mass: float = COIL, magnet: str = "free"
    ) -> Exciter:
        """One whose magnet rings at a frequency, Hz, while the coil stands still."""
        return cls(mass, places, coil_mass, (mass - coil_mass) * (2.0 * np.pi * hz) ** 2, magnet)

    def variants(self) -> tuple[NoEffect, ...]:
        return tuple(replace(self, places=(place,)) for place in self.places)

    def _moved(self, plate: Plate, basis: Basis) -> Floats:
        ((x, y),) = self.places
        return basis.deflection(np.array([x - plate.covered]), np.array([y]))[0]

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        moved = self._moved(plate, basis)
        together = np.outer(moved, moved)
        if self.magnet == "held":
            stiffness = stiffness + self.suspension * together
        return stiffness, mass + self.coil_mass * together

    def riders(self, plate: Plate, basis: Basis) -> tuple[Rider, ...]:
        if self.magnet == "held":
            return ()
        return (Rider(self.mass - self.coil_mass, self.suspension, self._moved(plate, basis)),)
