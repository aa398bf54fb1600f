"""Eigenvalues of many small pencils K x = omega^2 M x at once: all of them, or the lowest by a step from near modes.

With several effects the basis of a block counts a hundred vectors, of which two dozen modes are wanted. The modes at
the centre are near those of every draw already. Let each take along, of every other vector q, the share

    x_q = (omega_i^2 M_qi - K_qi) / (K_qq - omega_i^2 M_qq)

that first-order perturbation gives, omega_i^2 = K_ii / M_ii of the draw; the Ritz values on the modes so corrected are
those of the whole basis to the fourth order of the perturbation, at a quarter of the cost of all its eigenvalues.

Where the draws lie too far from the centre for that, as with shear moduli that are known to a factor only, one or two
steps of inverse iteration from the same modes go further: x = K^-1 M x_centre, which asks for solutions of equations
instead of all eigenvalues, and spans those wanted the better, the more modes beyond them take part (Bathe and Wilson,
Numerical Methods in Finite Element Analysis, 1976, chapter 12).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.definite import definite_pencil_values, factorise, order, solutions

Floats = NDArray[np.float64]

_NEAREST = 0.1
"""Share of its own stiffness that a vector keeps against being pushed, where it lies at the same frequency."""


def pencil_eigenvalues(stiffness: Floats, mass: Floats, shift: Floats | float) -> Floats:
    """All eigenvalues, increasing; not a number where the weights are those of no material.

    They are one over those of the mass where the shifted stiffness is one, for shear strains have no mass.

    Parameters
    ----------
    stiffness, mass : (n_draws, r, r) arrays
    shift : float or (n_draws, 1, 1) array, s^-2
        Lifts rigid motions off zero.

    Returns
    -------
    (n_draws, r) array, s^-2
    """
    flexibilities = definite_pencil_values(mass, stiffness + shift * mass)
    return np.asarray(1.0 / flexibilities[:, ::-1] - np.reshape(shift, (-1, 1)))


def _flexibility(stiffness: Floats, mass: Floats, shift: Floats | float) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """Coordinates in which the shifted stiffness is one; the mass in them, whose eigenvalues are flexibilities.

    The stiffness is factorised and not the mass, for shear strains have no mass. Third, which draws are a material: of
    the others both matrices are one.
    """
    inverse, is_material = _inverse_factors(stiffness + shift * mass)
    across = np.swapaxes(inverse, -1, -2)
    flexibility = inverse @ mass @ across
    flexibility[~is_material] = np.eye(stiffness.shape[-1])
    return across, flexibility, is_material


def _inverse_factors(matrices: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Inverses of Cholesky factors, and of which draws: those of a matrix that is not positive definite are one.

    On their rows the matrix is one; each is a combination of the vectors up to its own.
    """
    factors, is_material = _factors(matrices)
    return np.asarray(np.linalg.inv(factors), dtype=np.float64), is_material


def _factors(matrices: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Cholesky factors, and of which draws: those of a matrix that is not positive definite are one."""
    try:
        factors = np.asarray(np.linalg.cholesky(matrices))
    except np.linalg.LinAlgError:
        factors = np.stack([_factor_or_nan(one) for one in matrices])
    is_material = np.isfinite(factors[:, -1, -1])  # what is no number in a row is none in those below
    factors[~is_material] = np.eye(matrices.shape[-1])
    return factors, is_material


def _factor_or_nan(matrix: Floats) -> Floats:
    try:
        return np.asarray(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.nan)


def pencil_modes(stiffness: Floats, mass: Floats, shift: Floats | float, n_modes: int) -> tuple[Floats, Floats]:
    """Lowest eigenvalues, increasing, and their vectors; not numbers where the weights are those of no material.

    Parameters
    ----------
    stiffness, mass : (n_draws, r, r) arrays
    shift : float or (n_draws, 1, 1) array, s^-2
        Lifts rigid motions off zero.
    n_modes : int

    Returns
    -------
    values : (n_draws, n_modes) array, s^-2
    vectors : (n_draws, r, n_modes) array
        Mass-normalised.
    """
    across, flexibility, is_material = _flexibility(stiffness, mass, shift)
    flexibilities, turned = np.linalg.eigh(flexibility)
    highest = flexibilities[:, : -n_modes - 1 : -1]
    vectors = across @ turned[:, :, : -n_modes - 1 : -1] / np.sqrt(highest)[:, None, :]
    values = 1.0 / highest - np.reshape(shift, (-1, 1))
    return np.where(is_material[:, None], values, np.nan), np.where(is_material[:, None, None], vectors, np.nan)


def condensed_eigenvalues(stiffness: Floats, mass: Floats | None, n_kept: int, n_rigid: int) -> Floats:
    """The lowest eigenvalues with all vectors but the first condensed, increasing.

    Parameters
    ----------
    stiffness : (n_draws, r, r) array
        On a basis whose first vectors are near the modes, rigid motions before all others.
    mass : (n_draws, r, r) array or None
        None where the basis is orthonormal in the mass.
    n_kept : int
        How many of the first vectors are kept.
    n_rigid : int
        Rigid motions among them.

    Returns
    -------
    (n_draws, n_kept) array, s^-2
        Never below the eigenvalues on the whole basis; not a number where the weights are those of no material.
    """
    kept, rest = slice(None, n_kept), slice(n_kept, None)
    own_stiffness = np.diagonal(stiffness, axis1=1, axis2=2)
    own_mass = np.ones_like(own_stiffness) if mass is None else np.diagonal(mass, axis1=1, axis2=2)
    quotients = (own_stiffness / own_mass)[:, None, kept]
    pushes = -stiffness[:, rest, kept]
    if mass is not None:
        pushes = pushes + quotients * mass[:, rest, kept]
    others = own_stiffness[:, rest, None]
    # The highest of the kept vectors may lie above some of the others; they are kept for the sake of the lower ones.
    followed = pushes / np.maximum(others - quotients * own_mass[:, rest, None], _NEAREST * others)
    small_stiffness = _with_followers(stiffness, followed, n_kept)
    if mass is None:
        small_mass = np.eye(n_kept) + np.swapaxes(followed, -1, -2) @ followed
    else:
        small_mass = _with_followers(mass, followed, n_kept)
    # The shift is the draw's own, so that eigenvalues are homogeneous in the stiffness.
    return pencil_eigenvalues(small_stiffness, small_mass, quotients[:, :, n_rigid, None])


def stepped_eigenvalues(triangles: Floats, mass: Floats | None, n_kept: int, n_steps: int) -> Floats:
    """Eigenvalues on the first vectors after steps of inverse iteration, increasing.

    Parameters
    ----------
    triangles : (n_draws, r (r + 1) / 2) array
        Stiffness that no motion leaves at zero, packed (`bayesplate.modes.definite`), on a basis whose first vectors
        are near the modes; factors are written over it.
    mass : (n_draws, r, r) array or None
        None where the basis is orthonormal in the mass.
    n_kept : int
        How many of the first vectors are kept.
    n_steps : int
        At least one.

    Returns
    -------
    (n_draws, n_kept) array, s^-2
        Never below the eigenvalues on the whole basis; not a number where the weights are those of no material.
    """
    step = _stepped(triangles, mass, n_kept, n_steps)
    return pencil_eigenvalues(step.stiffness, step.mass, 0.0)


def stepped_modes(
    triangles: Floats, mass: Floats | None, n_kept: int, n_steps: int, n_modes: int
) -> tuple[Floats, Floats]:
    """The lowest modes from the first vectors after steps of inverse iteration.

    Parameters
    ----------
    triangles, mass, n_kept, n_steps
        As of `stepped_eigenvalues`.
    n_modes : int
        Not more than are kept.

    Returns
    -------
    values, vectors
        As of `pencil_modes`.
    """
    step = _stepped(triangles, mass, n_kept, n_steps)
    values, turned = pencil_modes(step.stiffness, step.mass, 0.0, n_modes)
    return values, np.swapaxes(step.rows, -1, -2) @ turned


class _Stepped(NamedTuple):
    """Vectors after steps, each a row of (n_draws, n_kept, r); stiffness and mass on them."""

    rows: Floats
    stiffness: Floats
    mass: Floats


def _stepped(triangles: Floats, mass: Floats | None, n_kept: int, n_steps: int) -> _Stepped:
    r = order(triangles)
    loads = np.broadcast_to(np.eye(n_kept, r), (len(triangles), n_kept, r)) if mass is None else mass[:, :n_kept]
    factorise(triangles)
    rows = solutions(triangles, loads)
    for _ in range(n_steps - 1):
        # Each vector is freed of those before it; otherwise all of them would turn to the lowest modes.
        inverse, _ = _inverse_factors(rows @ np.swapaxes(loads, -1, -2))
        loads = inverse @ (rows if mass is None else rows @ mass)
        rows = solutions(triangles, loads)
    moved = rows if mass is None else rows @ mass
    return _Stepped(rows, rows @ np.swapaxes(loads, -1, -2), moved @ np.swapaxes(rows, -1, -2))


def _with_followers(matrix: Floats, followed: Floats, n_kept: int) -> Floats:
    """A form on the first vectors, each with its share of all the others: (n_draws, n_kept, n_kept) array."""
    kept, rest = slice(None, n_kept), slice(n_kept, None)
    coupling = np.swapaxes(followed, -1, -2) @ (matrix[:, rest, kept] + 0.5 * (matrix[:, rest, rest] @ followed))
    return np.asarray(matrix[:, kept, kept] + coupling + np.swapaxes(coupling, -1, -2))
