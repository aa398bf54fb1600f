"""Air that a vibrating rectangle moves with it: panels of sources for a baffled plate, of dipoles for an open one.

Far below coincidence the air is incompressible and only adds mass. With all edges in a rigid wall each face is a sheet
of sources, twice whose kinetic energy at unit density is

    (1 / pi) int int w(r) w(r') / |r - r'| dA dA'                                       (both faces)

In the open the plate is a sheet of dipoles, whose strength m is the jump of the velocity potential across it: the
normal velocity that m induces on the plate, (k / 2) m in terms of the wavenumber k, is w there, and the energy is
int w m dA.

Within an outline the air is that of a rectangle of the mean width, whose deflection follows the outline and goes with
the width there over the mean: right for a long strip, of which each length carries air with the square of its width.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.plate.fields import Outline
from bayesplate.plate.terms import Deflections

_PANELS = 20
"""Panels along each side of a square, on the coarser of two lattices; the finer has half as many again."""
_REFINED = 1.5
_MOST_ELONGATED = 4.0
_EDGE_SHARE = 0.25


def air_mass(deflections: Deflections, aspect_ratio: float, is_baffled: bool, outline: Outline | None = None) -> Floats:
    """Mass of the air on given deflections, both faces wet: (n_vectors, n_vectors) array.

    For a rectangle of unit area and ratio L_x / L_y (of the mean width) in air of unit density; it goes with the area
    to the power 3/2. Both methods are of second order in the panels, so two lattices are extrapolated to none.
    (Korotkin, Added Masses of Ship Structures, 6.3, for the kernel 1/R; the limit of a strip of width b in the open is
    pi rho b^2 / 4 per length.)
    """
    coarse, fine = (_on_lattice(deflections, aspect_ratio, is_baffled, outline, n) for n in (1.0, _REFINED))
    mass = fine + (fine - coarse) / (_REFINED**2 - 1.0)
    return 0.5 * (mass + mass.T)


def _on_lattice(
    deflections: Deflections, aspect_ratio: float, is_baffled: bool, outline: Outline | None, refinement: float
) -> Floats:
    shape = _lattice(aspect_ratio, refinement)
    sides = np.sqrt(aspect_ratio), 1.0 / np.sqrt(aspect_ratio)
    # A lattice of dipoles ends a quarter of a panel short of the edges, where the jump falls with a square root.
    margin = 0.0 if is_baffled else _EDGE_SHARE
    steps = tuple(side / (n + 2.0 * margin) for side, n in zip(sides, shape, strict=True))
    if outline is None:
        moved = deflections.on(*(_middles(n, margin) for n in shape)).reshape(-1, shape[0] * shape[1]).T
    else:
        moved = _following(deflections, shape, margin, outline)
    if is_baffled:
        return moved.T @ (_sources(shape, steps) @ moved) / np.pi
    # Whitened by the triangular factor of the induced velocities: w' H^-1 w.
    from scipy.linalg import solve_triangular

    white = solve_triangular(_dipoles(shape, steps), moved, lower=True, check_finite=False)
    return steps[0] * steps[1] * white.T @ white


def _middles(n: int, margin: float) -> Floats:
    return np.asarray((np.arange(n) + 0.5 + margin) / (n + 2.0 * margin), dtype=np.float64)


def _following(deflections: Deflections, shape: tuple[int, int], margin: float, outline: Outline) -> Floats:
    """Deflections at the middles of panels that follow an outline, for the rectangle of its mean width."""
    at_x, share = (_middles(n, margin) for n in shape)
    low, high = outline(at_x)
    width = (high - low)[:, None]
    mean = float(width.mean())
    moved = deflections.across(at_x, low[:, None] + width * share) * (width / mean)
    # Of the unit area of the whole rectangle the mean width leaves its share, and air goes with the area to 3/2.
    return np.asarray(mean**0.75 * moved.reshape(len(moved), -1).T)


def _lattice(aspect_ratio: float, refinement: float) -> tuple[int, int]:
    """Panels along x and y, nearly square; both even, so that the middle lines lie between panels."""
    stretch = np.sqrt(np.clip(aspect_ratio, 1.0 / _MOST_ELONGATED, _MOST_ELONGATED))
    n_x, n_y = (max(4, 4 * round(_PANELS * s / 4)) for s in (stretch, 1.0 / stretch))
    return int(n_x * refinement), int(n_y * refinement)


@lru_cache(maxsize=16)
def _sources(shape: tuple[int, int], steps: tuple[float, float]) -> Floats:
    """Integrals of 1/R over pairs of panels: (n, n) array, from the function whose mixed fourth derivative is 1/R."""
    x, y = np.meshgrid(*(step * np.arange(-n, n + 1) for n, step in zip(shape, steps, strict=True)), indexing="ij")
    far_x, far_y = (np.where(c == 0.0, 1.0, np.abs(c)) for c in (x, y))  # x^2 y asinh(y / |x|) vanishes with x
    table = 0.5 * x * y * (x * np.arcsinh(y / far_x) + y * np.arcsinh(x / far_y)) - np.hypot(x, y) ** 3 / 6.0
    return _between_panels(np.diff(np.diff(table, 2, axis=0), 2, axis=1), shape)


@lru_cache(maxsize=16)
def _dipoles(shape: tuple[int, int], steps: tuple[float, float]) -> Floats:
    """Velocities at panels' middles from unit jumps on panels, each the ring vortex around it: its Cholesky factor."""
    from scipy.linalg import cholesky

    x, y = np.meshgrid(*(step * (np.arange(-n, n) + 0.5) for n, step in zip(shape, steps, strict=True)), indexing="ij")
    table = np.hypot(x, y) / (4.0 * np.pi * x * y)
    induced = _between_panels(np.diff(np.diff(table, axis=0), axis=1), shape)
    return np.asarray(cholesky(induced, lower=True, overwrite_a=True, check_finite=False))


def _between_panels(by_offset: Floats, shape: tuple[int, int]) -> Floats:
    """Matrix over pairs of panels from a table over offsets, which has no offset in its middle."""
    i, j = (index.ravel() for index in np.indices(shape))
    return by_offset[shape[0] - 1 + i[:, None] - i, shape[1] - 1 + j[:, None] - j]
