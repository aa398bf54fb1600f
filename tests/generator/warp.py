"""Warp: a board that is not flat resists bending by stretching too, a shallow shell on the generator's polynomials.

The in-plane motion is a pair of polynomial fields, u along x and v along y; at every deflection they settle where the
membrane energy is least, and what is left of it is stiffness of the deflection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg

from generator.basis import Basis, Floats
from generator.effects import NoEffect
from generator.plate import Plate, in_plane_stiffness, points_of

MORE_POLYNOMIALS = 2
"""More in-plane polynomials than deflections along each side: strains of u then reach the degree of kappa w."""


@dataclass(frozen=True)
class Warp(NoEffect):
    """The shape that an unloaded board has, as a straightedge shows it; constant curvatures, signed.

    Attributes
    ----------
    cup : float, m
        Rise of the middle over the width of the whole board: curvature across, 8 cup / L_y^2.
    bow : float, m
        Rise of the middle over its length: curvature along, 8 bow / L_x^2.
    twist : float, m
        A corner's lift off the table on which the other three stand: w_xy = twist / (L_x L_y).
    more : int
        In-plane polynomials beyond those of the deflection along each side; the tests change it.
    """

    cup: float = 0.0
    bow: float = 0.0
    twist: float = 0.0
    more: int = MORE_POLYNOMIALS

    def curvatures(self, plate: Plate) -> Floats:
        """Second derivatives xx, yy and twice xy of the unloaded shape: (3,) array, m^-1."""
        length, width = plate.whole_length, plate.L_y
        return np.array([8.0 * self.bow / length**2, 8.0 * self.cup / width**2, 2.0 * self.twist / (length * width)])

    def added(self, plate: Plate, basis: Basis, stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
        return stiffness + membrane_stiffness(plate, basis, self.curvatures(plate), self.more), mass


def membrane_stiffness(plate: Plate, basis: Basis, curvatures: Floats, more: int = MORE_POLYNOMIALS) -> Floats:
    """Stretching stiffness of a warped plate on its deflections, in-plane motion eliminated: (size, size) array, N/m.

    Strains L (u, v) - kappa w. Clamped edges hold u and v, all others neither.
    """
    x, y, weights = points_of(plate, basis)
    local = in_plane_stiffness(plate, x, y) * weights  # (3, 3, n_points), N
    sides = _in_plane_basis(plate, basis, more)
    along, across = sides.deflection(x, y, 1, 0), sides.deflection(x, y, 0, 1)
    nothing = np.zeros_like(along)
    strains = np.stack([np.hstack(pair) for pair in ((along, nothing), (nothing, across), (across, along))])
    bent = curvatures[:, None, None] * basis.deflection(x, y)
    forces, bent_forces = (np.einsum("abp,bpi->api", local, rows) for rows in (strains, bent))
    own = _quadratic(strains, forces)
    coupling = _quadratic(strains, bent_forces)
    rigid = _rigid_motions(sides) * np.sqrt(np.trace(own) / len(own))
    settled = scipy.linalg.solve(own + rigid.T @ rigid, coupling, assume_a="pos", check_finite=False)
    left = _quadratic(bent, bent_forces) - coupling.T @ settled
    return 0.5 * (left + left.T)


def _in_plane_basis(plate: Plate, basis: Basis, more: int) -> Basis:
    """Polynomials of u, and of v, that vanish at clamped edges, whatever springs turn or lift them."""
    held = tuple((plate.edges[edge] == "clamped", False) for edge in ("x0", "x1", "y0", "y1"))
    return replace(basis, held=held, n=(basis.n[0] + more, basis.n[1] + more), shear=False)


def _rigid_motions(sides: Basis) -> Floats:
    """Coefficients of the shifts and the turn of a board that no edge holds in its plane: (3 or 0, 2 size) array.

    They strain nothing, so no deflection pushes them; held by springs of any stiffness they stay at rest.
    """
    if any(slides for slides, _ in sides.held):
        return np.zeros((0, 2 * sides.size))
    x, y, _ = sides.points
    one, (x, y) = np.ones_like(x), (x / sides.L_x - 0.5, y / sides.L_x - 0.5 * sides.L_y / sides.L_x)
    moved = sides.deflection(*sides.points[:2])
    shift, along, across = np.linalg.lstsq(moved, np.stack([one, x, y], axis=1), rcond=None)[0].T
    nothing = np.zeros_like(shift)
    motions = np.stack([np.hstack(pair) for pair in ((shift, nothing), (nothing, shift), (across, -along))])
    return motions / np.linalg.norm(motions, axis=1, keepdims=True)


def _quadratic(rows: Floats, forces: Floats) -> Floats:
    """The sum over components and points of a product: (n_rows, n_forces) array."""
    return rows.reshape(-1, rows.shape[-1]).T @ forces.reshape(-1, forces.shape[-1])
