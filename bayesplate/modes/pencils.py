"""Eigenvalues of many small pencils K x = omega^2 M x at once: all of them, or the lowest by condensation.

With several effects the basis of a block counts eighty vectors, of which a dozen modes are wanted. The modes at the
centre are near those of every draw already. Let each take along, of all the other vectors q, the share

    x_q = K_qq^-1 (omega_i^2 M_qi - K_qi)

with which these follow it at its own frequency, omega_i^2 = K_ii / M_ii of the draw; the Ritz values on the modes so
corrected are those of the whole basis, at a fifth of the cost of all its eigenvalues. Only the inertia of the others'
share is left out, and it is small where they lie well above.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def pencil_eigenvalues(stiffness: Floats, mass: Floats, shift: Floats | float) -> Floats:
    """All eigenvalues, increasing; not a number where the weights are those of no material.

    Parameters
    ----------
    stiffness, mass : (n_draws, r, r) arrays
    shift : float or (n_draws, 1, 1) array, s^-2
        Lifts rigid motions off zero.

    Returns
    -------
    (n_draws, r) array, s^-2
    """
    shifts = np.broadcast_to(shift, (len(stiffness), 1, 1))
    try:
        return _eigenvalues(stiffness, mass, shifts)
    except np.linalg.LinAlgError:
        return np.concatenate([_one_or_nan(*draw) for draw in zip(stiffness, mass, shifts, strict=True)])


def _flexibility(stiffness: Floats, mass: Floats, shift: Floats | float) -> tuple[Floats, Floats]:
    """Coordinates in which the shifted stiffness is one, and the mass in them, whose eigenvalues are flexibilities.

    The stiffness is factorised and not the mass, for shear strains have no mass.
    """
    inverse = np.linalg.inv(np.linalg.cholesky(stiffness + shift * mass))
    across = np.swapaxes(inverse, -1, -2)
    return across, inverse @ mass @ across


def _eigenvalues(stiffness: Floats, mass: Floats, shift: Floats) -> Floats:
    _, flexibility = _flexibility(stiffness, mass, shift)
    values = 1.0 / np.linalg.eigvalsh(flexibility) - shift[:, :, 0]
    return np.asarray(values[:, ::-1])


def _one_or_nan(stiffness: Floats, mass: Floats, shift: Floats) -> Floats:
    try:
        return _eigenvalues(stiffness[None], mass[None], shift[None])
    except np.linalg.LinAlgError:
        return np.full((1, len(stiffness)), np.nan)


def pencil_modes(stiffness: Floats, mass: Floats, shift: float, n_modes: int) -> tuple[Floats, Floats]:
    """Lowest eigenvalues, increasing, and their vectors.

    Parameters
    ----------
    stiffness, mass : (n_draws, r, r) arrays
    shift : float, s^-2
        Lifts rigid motions off zero.
    n_modes : int

    Returns
    -------
    values : (n_draws, n_modes) array, s^-2
    vectors : (n_draws, r, n_modes) array
        Mass-normalised.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the weights are those of no material.
    """
    across, flexibility = _flexibility(stiffness, mass, shift)
    flexibilities, turned = np.linalg.eigh(flexibility)
    highest = flexibilities[:, : -n_modes - 1 : -1]
    vectors = across @ turned[:, :, : -n_modes - 1 : -1] / np.sqrt(highest)[:, None, :]
    return 1.0 / highest - shift, vectors


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
    mass = np.broadcast_to(np.eye(stiffness.shape[-1]), stiffness.shape) if mass is None else mass
    kept, rest = slice(None, n_kept), slice(n_kept, None)
    quotients = (np.diagonal(stiffness, axis1=1, axis2=2) / np.diagonal(mass, axis1=1, axis2=2))[:, None, kept]
    pushes = quotients * mass[:, rest, kept] - stiffness[:, rest, kept]
    followed = np.linalg.solve(stiffness[:, rest, rest], pushes)
    across = np.swapaxes(followed, -1, -2)
    coupling = across @ (stiffness[:, rest, kept] + 0.5 * pushes)
    small_stiffness = stiffness[:, kept, kept] + coupling + np.swapaxes(coupling, -1, -2)
    coupling = across @ (mass[:, rest, kept] + 0.5 * (mass[:, rest, rest] @ followed))
    small_mass = mass[:, kept, kept] + coupling + np.swapaxes(coupling, -1, -2)
    # The shift is the draw's own, so that eigenvalues are homogeneous in the stiffness.
    return pencil_eigenvalues(small_stiffness, small_mass, quotients[:, :, n_rigid, None])
