"""Eigenvalues of many small pencils K x = omega^2 M x at once: all of them, or the lowest by a step from near modes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats

_SINGULAR = 1e-13
"""Share of the largest eigenvalue of a mass, below which the least is rounding: positive or not, it has no factor."""


def pencil_values(stiffness: Floats, mass: Floats) -> Floats:
    """All eigenvalues of pencils of (n, r, r) arrays, increasing: (n, r); not numbers where no mass is positive."""
    whitened, is_mass = _whitened(stiffness, mass)[:2]
    return np.where(is_mass[:, None], np.linalg.eigvalsh(whitened), np.nan)


def pencil_modes(stiffness: Floats, mass: Floats) -> tuple[Floats, Floats]:
    """The same, and the mass-normalised vectors: (n, r) and (n, r, r) arrays."""
    whitened, is_mass, inverse = _whitened(stiffness, mass)
    values, turned = np.linalg.eigh(whitened)
    return np.where(is_mass[:, None], values, np.nan), np.swapaxes(inverse, -1, -2) @ turned


def _whitened(stiffness: Floats, mass: Floats) -> tuple[Floats, Bools, Floats]:
    """Stiffness in coordinates in which the mass is one; which masses are positive; inverses of their factors.

    What is not finite never reaches a solver of eigenvalues, which would end everything at such a draw.
    """
    one = np.eye(mass.shape[-1])
    is_mass = np.asarray(np.isfinite(mass).all(axis=(1, 2)))
    try:
        factors = np.linalg.cholesky(np.where(is_mass[:, None, None], mass, one))
    except np.linalg.LinAlgError:
        values = np.linalg.eigvalsh(np.where(is_mass[:, None, None], mass, one))
        is_mass &= values[:, 0] > _SINGULAR * values[:, -1]
        factors = np.linalg.cholesky(np.where(is_mass[:, None, None], mass, one))
    inverse = np.linalg.inv(factors)
    with np.errstate(over="ignore", invalid="ignore"):
        whitened = inverse @ stiffness @ np.swapaxes(inverse, -1, -2)
    is_mass &= np.isfinite(whitened).all(axis=(1, 2))
    return np.where(is_mass[:, None, None], whitened, one), np.asarray(is_mass), np.asarray(inverse, dtype=np.float64)


class Step(NamedTuple):
    """Vectors after a step from the first ones, (n, r, n_kept); stiffness and mass on them; the shift, (n, 1), s^-2."""

    vectors: Floats
    stiffness: Floats
    mass: Floats
    shift: Floats


def stepped(stiffness: Floats, mass: Floats, n_kept: int, n_rigid: int) -> Step:
    """One step of inverse iteration on pencils of (n, r, r) arrays.

    The shift lifts rigid motions off zero; it is the draw's own, so that eigenvalues are homogeneous in the stiffness,
    and not a number where nothing can be solved.
    """
    shift = (stiffness[:, n_rigid, n_rigid] / mass[:, n_rigid, n_rigid])[:, None, None]
    shifted = stiffness + shift * mass
    if stiffness.shape[-1] == n_kept:
        return Step(np.eye(n_kept)[None], shifted, mass, shift[:, :, 0])
    loads = mass[:, :, :n_kept]
    try:
        vectors = np.linalg.solve(shifted, loads)
    except np.linalg.LinAlgError:
        is_singular = np.linalg.slogdet(shifted)[0][:, None, None] == 0.0
        vectors = np.linalg.solve(np.where(is_singular, np.eye(shifted.shape[-1]), shifted), loads)
        shift = np.where(is_singular, np.nan, shift)
    across = np.swapaxes(vectors, -1, -2)
    return Step(np.asarray(vectors, dtype=np.float64), across @ loads, across @ (mass @ vectors), shift[:, :, 0])
