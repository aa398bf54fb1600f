"""What the terms of a shear-flexible plate weigh: the thin plate's weights, joined by shear and rotary inertia."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.terms import term_weights
from bayesplate.modes.plate import Weights
from bayesplate.modes.shear import SHEAR_CORRECTION
from bayesplate.plate.board import Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup


def shear_moduli(values: Values) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """G_xz and G_yz, Pa; one that is not there is G_xy, as in a plate that is alike in all directions."""
    of_plane = 3.0 * values["D_s"] / np.asarray(values["thickness"]) ** 3
    return np.asarray(values.get("G_xz", of_plane)), np.asarray(values.get("G_yz", of_plane))


def shear_term_weights(values: Values, setup: Setup) -> Weights:
    """Weights of the shear-flexible plate's terms on the unit square.

    Parameters
    ----------
    values : dict of array
        D_x, D_y, D_s (N m), G_xz and G_yz (Pa, positive) and the board's inputs; numbers or (n_draws,) arrays.
        G_xz and G_yz as of `shear_moduli`.
    setup : Setup

    Returns
    -------
    Weights
        (n_draws, 6) stiffness weights in the order of `bayesplate.modes.shear.SHEAR_TERMS`, and (n_draws, 3) mass
        weights in that of `SHEAR_MASSES`.

    References
    ----------
    Mindlin (1951); S_x = kappa h G_xz and S_y = kappa h G_yz with kappa = 5/6, rotary inertia rho h^3 / 12.
    """
    thin = term_weights(values, setup)
    length_x, length_y = vibrating_lengths(values, setup)
    thickness, (G_xz, G_yz) = np.asarray(values["thickness"]), shear_moduli(values)
    # Board mass and thickness cancel from S_x / m, up to density and the area.
    per_modulus = SHEAR_CORRECTION / density(values)
    columns = (
        per_modulus * G_xz / length_x**2,
        per_modulus * G_yz / length_y**2,
        thickness**2 / (12.0 * length_x**2),
        thickness**2 / (12.0 * length_y**2),
    )
    ones = np.ones(np.broadcast_shapes(thin.stiffness.shape[:1], *(np.shape(column) for column in columns)))
    shear_x, shear_y, rotary_x, rotary_y = (column * ones for column in columns)
    return Weights(
        np.column_stack([thin.stiffness * ones[:, None], shear_x, shear_y]),
        np.column_stack([thin.mass * ones[:, None], rotary_x, rotary_y]),
    )
