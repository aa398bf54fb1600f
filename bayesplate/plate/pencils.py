"""Eigenvalues of many small pencils K x = omega^2 M x at once: all of them, or the lowest by a step from near modes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats

_SINGULAR_SHARE = 1e-13
"""Share of the largest eigenvalue of a mass, below which the least is rounding: positive or not, it has no factor."""


def pencil_values(stiffness: Floats, mass: Floats) -> Floats:
    """All eigenvalues of pencils of (n, r, r) arrays, increasing: (n, r); not numbers where no mass is positive."""
    whitened, is_mass = _whitened(stiffness, mass)[:2]
    return np.where(is_mass[:, None], np.linalg.eigvalsh(whitened), np.nan)


def pencil_modes(stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
    """Eigenvalues as of `pencil_values`, and the mass-normalised vectors: (n, r) and (n, r, r) arrays."""
    whitened, is_mass, inverse = _whitened(stiffness, mass)
    values, rotations = np.linalg.eigh(whitened)
    return np.where(is_mass[:, None], values, np.nan), np.swapaxes(inverse, -1, -2) @ rotations


def _whitened(stiffness: Floats, mass: Floats) -> tuple[Floats, Bools, Floats]:
    """Stiffness in coordinates in which the mass is the identity; which masses are positive; inverses of their factors.

    Matrices that are not finite never reach the eigenvalue solver, which would raise an error for all draws.
    """
    eye = np.eye(mass.shape[-1])
    is_mass = np.asarray(np.isfinite(mass).all(axis=(1, 2)))
    try:
        factors = np.linalg.cholesky(np.where(is_mass[:, None, None], mass, eye))
    except np.linalg.LinAlgError:
        values = np.linalg.eigvalsh(np.where(is_mass[:, None, None], mass, eye))
        is_mass &= values[:, 0] > _SINGULAR_SHARE * values[:, -1]
        factors = np.linalg.cholesky(np.where(is_mass[:, None, None], mass, eye))
    inverse = np.linalg.inv(factors)
    with np.errstate(over="ignore", invalid="ignore"):
        whitened = inverse @ stiffness @ np.swapaxes(inverse, -1, -2)
    is_mass &= np.isfinite(whitened).all(axis=(1, 2))
    return np.where(is_mass[:, None, None], whitened, eye), np.asarray(is_mass), np.asarray(inverse, dtype=np.float64)


class InverseStep(NamedTuple):
    """Vectors after a step from the first ones, (n, r, n_kept); stiffness and mass on them; the shift, (n, 1), s^-2."""

    vectors: Floats
    stiffness: Floats
    mass: Floats
    shift: Floats


def inverse_step(stiffness: Floats, mass: Floats, n_kept: int, n_rigid: int) -> InverseStep:
    """One step of inverse iteration on pencils of (n, r, r) arrays.

    The shift lifts rigid motions off zero; it is the draw's own, so that eigenvalues are homogeneous in the stiffness,
    and not a number where nothing can be solved.
    """
    shift = (stiffness[:, n_rigid, n_rigid] / mass[:, n_rigid, n_rigid])[:, None, None]
    shifted = stiffness + shift * mass
    if stiffness.shape[-1] == n_kept:
        return InverseStep(np.eye(n_kept)[None], shifted, mass, shift[:, :, 0])
    loads = mass[:, :, :n_kept]
    try:
        vectors = np.linalg.solve(shifted, loads)
    except np.linalg.LinAlgError:
        is_singular = np.linalg.slogdet(shifted)[0][:, None, None] == 0.0
        vectors = np.linalg.solve(np.where(is_singular, np.eye(shifted.shape[-1]), shifted), loads)
        shift = np.where(is_singular, np.nan, shift)
    transposed = np.swapaxes(vectors, -1, -2)
    return InverseStep(
        np.asarray(vectors, dtype=np.float64), transposed @ loads, transposed @ (mass @ vectors), shift[:, :, 0]
    )
