"""Beam functions: the modes of one side alone, whose products name the modes of the plate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.setup import Ends
from bayesplate.plate.line import Line, line, rigid_degrees

Beams = tuple[int, int]
"""Order of the beam functions along x and y whose product a mode resembles; (0, 0) is the lowest."""

N_BEAMS = 16
_N_ELEMENTS = 40


@dataclass(frozen=True, eq=False)
class BeamFunctions:
    """The lowest modes of a side, lowest first, of unit mean square; rigid motions come first."""

    side: Line
    coefficients: Floats  # (n_functions, n_beams)

    def at(self, points: Floats) -> Floats:
        """Values at points of [0, 1]: (n_points, n_beams) array."""
        return np.asarray(self.side.shapes(points) @ self.coefficients)

    def integrals(self, first: int, second: int, factor: Floats | float = 1.0) -> Floats:
        """Integrals of products of two derivatives of each function, of these orders: (n_beams,) array.

        `factor` is of the Gauss points of the side: (n_points,).
        """
        both = self.side.derivatives[[first, second]] @ self.coefficients
        return np.asarray((self.side.weights * factor) @ (both[0] * both[1]))


@lru_cache(maxsize=16)
def beam_functions(ends: Ends) -> BeamFunctions:
    from scipy.linalg import eigh

    side = line(ends, _N_ELEMENTS, is_split=False)
    kept = np.flatnonzero(side.kept(0, is_sheared=False))
    value, _, bending = side.derivatives[:, :, kept]
    mass, stiffness = ((one.T * side.weights) @ one for one in (value, bending))
    found = np.zeros((side.n_functions, N_BEAMS))
    found[kept] = eigh(stiffness, mass, subset_by_index=[0, N_BEAMS - 1])[1]
    if len(rigid_degrees(ends)) == 2:  # of the two motions of a free side: the shift, and the turn about its middle
        found[0::2, 0], found[1::2, 0] = 1.0, 0.0
        found[0::2, 1], found[1::2, 1] = np.sqrt(12.0) * (side.nodes - 0.5), np.sqrt(12.0)
    return BeamFunctions(side, found)


def is_rigid(beams: Beams, ends_x: Ends, ends_y: Ends) -> bool:
    """Whether a product of beam functions is a motion without bending: a shift or a turn, but not the twist xy."""
    rigid_x, rigid_y = rigid_degrees(ends_x), rigid_degrees(ends_y)
    if beams[0] >= len(rigid_x) or beams[1] >= len(rigid_y):
        return False
    return rigid_x[beams[0]] + rigid_y[beams[1]] <= 1


def product_coefficients(ends_x: Ends, ends_y: Ends) -> Floats:
    """Energies of all products of beam functions in the thin plate's terms: (4, n_beams_x, n_beams_y) array.

    Rough, but they need no stiffness to be known: the start of every estimate.
    """
    along, across = (beam_functions(ends) for ends in (ends_x, ends_y))
    (bent_x, turned_x, mixed_x), (bent_y, turned_y, mixed_y) = (
        (one.integrals(2, 2), one.integrals(1, 1), one.integrals(0, 2)) for one in (along, across)
    )
    ones = np.ones(N_BEAMS)
    return np.stack(
        [np.outer(bent_x, ones), np.outer(ones, bent_y), 2.0 * np.outer(mixed_x, mixed_y), np.outer(turned_x, turned_y)]
    )
