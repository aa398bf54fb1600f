"""Air moved by a rectangular plate, summed over panels: sources for a baffled plate, dipoles for an unbaffled one.

Low frequencies: the air is incompressible and only adds mass. Both matrices act on the normal velocities v of the
panels at their centres; twice the kinetic energy of the air is v' A v.

Baffled: each side of the plate is a sheet of sources in a rigid wall, A = (rho_0 / pi) sum of the integrals of 1/R over
pairs of panels (in closed form), both sides together.

Unbaffled: the plate is a sheet of dipoles, that is of the jump mu of the velocity potential across it. A panel of
constant mu is a ring vortex, and its velocity in the plane is elementary; v = H mu and A = rho_0 H^-1 x panel area. The
lattice ends a quarter of a panel short of each edge, which is what the square-root edge of the jump asks for
(Hough 1973).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import scipy.linalg

from generator.basis import Basis, Floats

PANELS = 640
"""Panels of the coarser of the two lattices; the finer has half as many again along each side."""


def _offsets(n: int, step: float) -> Floats:
    """Distances between the panels of a row of n, m: -n step .. n step, one further than needed on each side."""
    return step * np.arange(-n, n + 1)


def _by_offset(table: Floats, n_x: int, n_y: int) -> Floats:
    """A table over offsets (centre: no offset) as a matrix over pairs of panels."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(n_x), np.arange(n_y), indexing="ij"))
    centre_x, centre_y = (size // 2 for size in table.shape)
    return table[centre_x + i[:, None] - i[None, :], centre_y + j[:, None] - j[None, :]]


def source_pairs(n_x: int, n_y: int, step_x: float, step_y: float) -> Floats:
    """Integrals of 1/R over all pairs of panels of a lattice: (n, n) array, m^3.

    The second differences, along x and along y, of F = x^2 y ln(y + R) / 2 + x y^2 ln(x + R) / 2 - R^3 / 6, whose
    mixed fourth derivative is 1/R.
    """
    x, y = np.meshgrid(_offsets(n_x, step_x), _offsets(n_y, step_y), indexing="ij")
    distance = np.hypot(x, y)
    with np.errstate(divide="ignore", invalid="ignore"):
        # ln(y + R) is even but for ln |x|, which the second difference along y removes: asinh(y / |x|) is its odd part.
        first = np.where(x == 0.0, 0.0, 0.5 * x**2 * y * np.arcsinh(y / np.abs(x)))
        second = np.where(y == 0.0, 0.0, 0.5 * x * y**2 * np.arcsinh(x / np.abs(y)))
    return _by_offset(np.diff(np.diff(first + second - distance**3 / 6.0, 2, axis=0), 2, axis=1), n_x, n_y)


def dipole_velocities(n_x: int, n_y: int, step_x: float, step_y: float) -> Floats:
    """Normal velocity at each panel's centre from a unit jump on each panel: (n, n) array, m^-1; positive diagonal.

    The corner sum of sqrt(x^2 + y^2) / (x y) over 4 pi, from the corners of the panel to the point.
    """
    x, y = np.meshgrid(
        step_x * (np.arange(-n_x, n_x) + 0.5), step_y * (np.arange(-n_y, n_y) + 0.5), indexing="ij"
    )  # corners as seen from a centre
    corner = np.hypot(x, y) / (x * y) / (4.0 * np.pi)
    return _by_offset(np.diff(np.diff(corner, axis=0), axis=1), n_x, n_y)


def lattice(L_x: float, L_y: float, n_panels: int) -> tuple[int, int]:
    """Numbers of nearly square panels along x and along y."""
    n_y = max(6, round(np.sqrt(n_panels * L_y / L_x)))
    return max(6, round(n_panels / n_y)), n_y


def _centres(n: int, length: float, inset: float) -> tuple[Floats, float]:
    """Centres of a row of panels and their width, m, ending `inset` panels short of both ends."""
    step = length / (n + 2.0 * inset)
    return step * (np.arange(n) + 0.5 + inset), step


def _mass(basis: Basis, n_x: int, n_y: int, baffled: bool) -> Floats:
    """Air mass on the unknowns of a basis at unit density, from one lattice."""
    (x, step_x), (y, step_y) = (
        _centres(n, length, 0.0 if baffled else 0.25) for n, length in ((n_x, basis.L_x), (n_y, basis.L_y))
    )
    moved = basis.deflection(*(a.ravel() for a in np.meshgrid(x, y, indexing="ij")))
    if baffled:
        return moved.T @ (source_pairs(n_x, n_y, step_x, step_y) @ moved) / np.pi
    influence = dipole_velocities(n_x, n_y, step_x, step_y)
    jump = scipy.linalg.solve(influence, moved, assume_a="pos", check_finite=False)
    return step_x * step_y * (moved.T @ jump)


@lru_cache(maxsize=32)
def air_mass(basis: Basis, baffled: bool, n_panels: int = PANELS) -> Floats:
    """Mass of the air on both faces at unit density on the unknowns of a basis: (size, size) array, m^3.

    In a rigid wall, or in the open; two lattices, extrapolated to none by the second order of both methods.
    """
    n_x, n_y = (2 * ((n + 1) // 2) for n in lattice(basis.L_x, basis.L_y, n_panels))
    coarse, fine = _mass(basis, n_x, n_y, baffled), _mass(basis, 3 * n_x // 2, 3 * n_y // 2, baffled)
    mass = fine + (fine - coarse) / (1.5**2 - 1.0)
    return 0.5 * (mass + mass.T)
