"""Weights of a setup's stiffness and mass terms, from constants and sizes."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values, board_density, vibrating_lengths
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.setup import Setup
from bayesplate.plate.shear import SHEAR_CORRECTION
from bayesplate.plate.terms import Weights


def term_weights(values: Values, setup: Setup) -> Weights:
    """Weights of the thin plate's terms on the unit square, (n_draws, 4) as `THIN_TERMS`, and 1 for the mass.

    With A = L_x L_y and sigma = L_x / L_y these are D_x / sigma^2, D_y sigma^2, nu_xy D_y and D_s over rho h A^2
    (Ducceschi et al., eq. (11)). Values are numbers or (n_draws,) arrays, D_x, D_y, D_s in N m.
    """
    length_x, length_y = vibrating_lengths(values, setup)
    mass = board_density(values) * values["thickness"] * length_x * length_y
    area = length_x * length_y
    stiffness = np.stack(
        np.broadcast_arrays(
            np.atleast_1d(values["D_x"] * length_y / (length_x**3 * mass)),
            values["D_y"] * length_x / (length_y**3 * mass),
            values["poisson_xy"] * values["D_y"] / (area * mass),
            values["D_s"] / (area * mass),
        ),
        axis=-1,
    )
    return Weights(stiffness, np.ones((stiffness.shape[0], 1)))


def shear_moduli(values: Values) -> tuple[Floats, Floats]:
    """G_xz and G_yz, Pa; a missing one is taken as G_xy, as in an isotropic plate."""
    in_plane = 3.0 * values["D_s"] / np.asarray(values["thickness"]) ** 3
    return np.asarray(values.get("G_xz", in_plane)), np.asarray(values.get("G_yz", in_plane))


def shear_term_weights(values: Values, setup: Setup) -> Weights:
    """Weights of the shear-flexible plate, (n_draws, 6) as `SHEAR_TERMS`, and (n_draws, 3) masses as `SHEAR_MASSES`.

    S_x = kappa h G_xz and S_y = kappa h G_yz with kappa = 5/6, rotary inertia rho h^3 / 12 (Mindlin, 1951).
    """
    thin = term_weights(values, setup)
    length_x, length_y = vibrating_lengths(values, setup)
    thickness, (G_xz, G_yz) = np.asarray(values["thickness"]), shear_moduli(values)
    # Mass and thickness of the board cancel in S_x / m, up to density and area.
    per_modulus = SHEAR_CORRECTION / board_density(values)
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


def along_grain(base: Weights, values: Values, setup: Setup) -> Weights:
    """The part of the weights `base` due to the modulus along the grain: E_x h^3 / 12 = D_x - nu_xy^2 D_y in K_xx.

    The plate's own terms come first in `base`; all others are zero in the result.
    """
    length_x, length_y = vibrating_lengths(values, setup)
    xx, _, mix, *_ = np.moveaxis(base.stiffness, -1, 0)
    along = np.zeros_like(base.stiffness)
    along[:, 0] = xx - values["poisson_xy"] * mix * (length_y / length_x) ** 2
    return Weights(along, np.zeros_like(base.mass))


def rigidity_columns(values: Values, setup: Setup) -> Floats:
    """The matrix that takes (D_x, D_y, D_s) to the stiffness weights, at given inputs: (4, 3) array."""
    unit = dict(zip(RIGIDITIES, np.eye(3), strict=True))
    return term_weights({**values, **unit}, setup).stiffness.T
