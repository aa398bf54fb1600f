"""Air that a vibrating rectangle moves with it: panels of sources for a baffled plate, of dipoles for an open one.

Far below coincidence the air is incompressible and only adds mass. With all edges in a rigid wall each face is a sheet
of sources, twice whose kinetic energy at unit density is

    (1 / pi) int int w(r) w(r') / |r - r'| dA dA'                                       (both faces)

In the open the plate is a sheet of dipoles, whose strength m is the jump of the velocity potential across it: the
normal velocity that m induces on the plate, (k / 2) m in terms of the wavenumber k, is w there, and the energy is
int w m dA.

Within an outline the air is that of a rectangle of the mean width. Its deflection is the plate's at the same share of
the local width, times that width over the mean: right for a long strip, whose air per length goes with the square of
its width.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import Deflections

_PANELS = 20
"""Panels along each side of a square, on the coarser of two lattices; the finer has half as many again."""
_REFINEMENT = 1.5
_MOST_ELONGATED = 4.0
_EDGE_SHARE = 0.25


def air_mass(deflections: Deflections, aspect_ratio: float, is_baffled: bool, outline: Outline | None = None) -> Floats:
    """Mass of the air on given deflections, both faces wet: (n_vectors, n_vectors) array.

    For a rectangle of unit area and ratio L_x / L_y (of the mean width) in air of unit density; it goes with the area
    to the power 3/2. Both methods are of second order in the panels, so two lattices are extrapolated to none.
    (Korotkin, Added Masses of Ship Structures, 6.3, for the kernel 1/R; the limit of a strip of width b in the open is
    pi rho b^2 / 4 per length.)
    """
    coarse, fine = (_lattice_mass(deflections, aspect_ratio, is_baffled, outline, n) for n in (1.0, _REFINEMENT))
    mass = fine + (fine - coarse) / (_REFINEMENT**2 - 1.0)
    return 0.5 * (mass + mass.T)


def _lattice_mass(
    deflections: Deflections, aspect_ratio: float, is_baffled: bool, outline: Outline | None, refinement: float
) -> Floats:
    shape = _lattice_shape(aspect_ratio, refinement)
    sides = np.sqrt(aspect_ratio), 1.0 / np.sqrt(aspect_ratio)
    # A lattice of dipoles ends a quarter of a panel short of the edges, where the jump falls with a square root.
    margin = 0.0 if is_baffled else _EDGE_SHARE
    steps = tuple(side / (n + 2.0 * margin) for side, n in zip(sides, shape, strict=True))
    if outline is None:
        motion = deflections.on(*(_panel_middles(n, margin) for n in shape)).reshape(-1, shape[0] * shape[1]).T
    else:
        motion = _motion_within_outline(deflections, shape, margin, outline)
    if is_baffled:
        return motion.T @ (_source_integrals(shape, steps) @ motion) / np.pi
    # Whitened by the triangular factor of the induced velocities: w' H^-1 w.
    from scipy.linalg import solve_triangular

    whitened = solve_triangular(_dipole_factor(shape, steps), motion, lower=True, check_finite=False)
    return steps[0] * steps[1] * whitened.T @ whitened


def _panel_middles(n: int, margin: float) -> Floats:
    return np.asarray((np.arange(n) + 0.5 + margin) / (n + 2.0 * margin), dtype=np.float64)


def _motion_within_outline(deflections: Deflections, shape: tuple[int, int], margin: float, outline: Outline) -> Floats:
    """Deflections at the middles of panels that follow an outline, as those of the rectangle of its mean width."""
    at_x, share = (_panel_middles(n, margin) for n in shape)
    low, high = outline(at_x)
    width = (high - low)[:, None]
    mean_width = float(width.mean())
    motion = deflections.across(at_x, low[:, None] + width * share) * (width / mean_width)
    # The rectangle of the mean width has that share of the unit area; the mass of air goes with the area to 3/2.
    return np.asarray(mean_width**0.75 * motion.reshape(len(motion), -1).T)


def _lattice_shape(aspect_ratio: float, refinement: float) -> tuple[int, int]:
    """Panels along x and y, nearly square; both even, so that the middle lines lie between panels."""
    stretch = np.sqrt(np.clip(aspect_ratio, 1.0 / _MOST_ELONGATED, _MOST_ELONGATED))
    n_x, n_y = (max(4, 4 * round(_PANELS * s / 4)) for s in (stretch, 1.0 / stretch))
    return int(n_x * refinement), int(n_y * refinement)


@lru_cache(maxsize=16)
def _source_integrals(shape: tuple[int, int], steps: tuple[float, float]) -> Floats:
    """Integrals of 1/R over pairs of panels: (n, n) array, from the function whose mixed fourth derivative is 1/R."""
    x, y = np.meshgrid(*(step * np.arange(-n, n + 1) for n, step in zip(shape, steps, strict=True)), indexing="ij")
    nonzero_x, nonzero_y = (np.where(c == 0.0, 1.0, np.abs(c)) for c in (x, y))  # x^2 y asinh(y / |x|) vanishes with x
    table = 0.5 * x * y * (x * np.arcsinh(y / nonzero_x) + y * np.arcsinh(x / nonzero_y)) - np.hypot(x, y) ** 3 / 6.0
    return _panel_matrix(np.diff(np.diff(table, 2, axis=0), 2, axis=1), shape)


@lru_cache(maxsize=16)
def _dipole_factor(shape: tuple[int, int], steps: tuple[float, float]) -> Floats:
    """Cholesky factor of the velocities at panels' middles from unit jumps on panels, ring vortices around each."""
    from scipy.linalg import cholesky

    x, y = np.meshgrid(*(step * (np.arange(-n, n) + 0.5) for n, step in zip(shape, steps, strict=True)), indexing="ij")
    table = np.hypot(x, y) / (4.0 * np.pi * x * y)
    induced = _panel_matrix(np.diff(np.diff(table, axis=0), axis=1), shape)
    return np.asarray(cholesky(induced, lower=True, overwrite_a=True, check_finite=False))


def _panel_matrix(by_offset: Floats, shape: tuple[int, int]) -> Floats:
    """Matrix over pairs of panels from a table over their offsets, the zero offset in its middle."""
    i, j = (index.ravel() for index in np.indices(shape))
    return by_offset[shape[0] - 1 + i[:, None] - i, shape[1] - 1 + j[:, None] - j]
