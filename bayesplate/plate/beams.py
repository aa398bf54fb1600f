"""Beam functions: the modes of one side alone, whose products name the modes of the plate."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.setup import EdgeConditions
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
        derivatives = self.side.derivatives[[first, second]] @ self.coefficients
        return np.asarray((self.side.weights * factor) @ (derivatives[0] * derivatives[1]))


@lru_cache(maxsize=16)
def beam_functions(ends: EdgeConditions) -> BeamFunctions:
    from scipy.linalg import eigh

    side = line(ends, _N_ELEMENTS, is_split=False)
    functions = np.flatnonzero(side.deflection_functions(0, is_sheared=False))
    value, _, bending = side.derivatives[:, :, functions]
    mass, stiffness = ((derivative.T * side.weights) @ derivative for derivative in (value, bending))
    coefficients = np.zeros((side.n_functions, N_BEAMS))
    coefficients[functions] = eigh(stiffness, mass, subset_by_index=[0, N_BEAMS - 1])[1]
    if len(rigid_degrees(ends)) == 2:  # of the two motions of a free side: the shift, and the turn about its middle
        coefficients[0::2, 0], coefficients[1::2, 0] = 1.0, 0.0
        coefficients[0::2, 1], coefficients[1::2, 1] = np.sqrt(12.0) * (side.nodes - 0.5), np.sqrt(12.0)
    return BeamFunctions(side, coefficients)


def is_rigid(beams: Beams, ends_x: EdgeConditions, ends_y: EdgeConditions) -> bool:
    """Whether a product of beam functions is a motion without bending: a shift or a turn, but not the twist xy."""
    rigid_x, rigid_y = rigid_degrees(ends_x), rigid_degrees(ends_y)
    if beams[0] >= len(rigid_x) or beams[1] >= len(rigid_y):
        return False
    return rigid_x[beams[0]] + rigid_y[beams[1]] <= 1


def product_coefficients(ends_x: EdgeConditions, ends_y: EdgeConditions) -> Floats:
    """Energies of all products of beam functions in the thin plate's terms: (4, n_beams_x, n_beams_y) array.

    Rough, but they need no stiffness to be known: the start of every estimate.
    """
    along, across = (beam_functions(ends) for ends in (ends_x, ends_y))
    (bent_x, turned_x, mixed_x), (bent_y, turned_y, mixed_y) = (
        (beams.integrals(2, 2), beams.integrals(1, 1), beams.integrals(0, 2)) for beams in (along, across)
    )
    ones = np.ones(N_BEAMS)
    return np.stack(
        [np.outer(bent_x, ones), np.outer(ones, bent_y), 2.0 * np.outer(mixed_x, mixed_y), np.outer(turned_x, turned_y)]
    )
