"""What the terms of a setup weigh: from constants and sizes to the weights of stiffness and mass."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.modes.naming import product_coefficients
from bayesplate.modes.plate import Weights
from bayesplate.modes.thin import thin_plate
from bayesplate.plate.board import Values, density, vibrating_lengths
from bayesplate.plate.setup import Setup

_COARSE_MESH = 12


def term_weights(values: Values, setup: Setup) -> Weights:
    """Weights of the thin plate's terms on the unit square.

    Parameters
    ----------
    values : dict of array
        D_x, D_y, D_s (N m) and the board's inputs; numbers or (n_draws,) arrays.
    setup : Setup

    Returns
    -------
    Weights
        (n_draws, 4) stiffness weights in the order of `bayesplate.modes.thin.THIN_TERMS`, and 1 for the mass.

    References
    ----------
    Ducceschi et al., eq. (11): with A = L_x L_y and sigma = L_x / L_y these are D_x / sigma^2, D_y sigma^2, nu_xy D_y
    and D_s over rho h A^2.
    """
    length_x, length_y = vibrating_lengths(values, setup)
    mass = density(values) * values["thickness"] * length_x * length_y
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


def along_grain(base: Weights, values: Values, setup: Setup) -> Weights:
    """What the modulus along the grain alone gives to the weights: E_x h^3 / 12 = D_x - nu_xy^2 D_y in K_xx.

    Parameters
    ----------
    base : Weights
        Of the plate's own terms, those of `term_weights` first.
    values : dict of array
        As given to `term_weights`.
    setup : Setup

    Returns
    -------
    Weights
        Arrays of the shapes of `base`, zero in all other terms.
    """
    length_x, length_y = vibrating_lengths(values, setup)
    xx, _, mix, *_ = np.moveaxis(base.stiffness, -1, 0)
    along = np.zeros_like(base.stiffness)
    along[:, 0] = xx - values["poisson_xy"] * mix * (length_y / length_x) ** 2
    return Weights(along, np.zeros_like(base.mass))


def rayleigh_coefficients(setup: Setup) -> NDArray[np.float64]:
    """Rayleigh quotients of all products of a setup's beam functions, by term: (4, n_beams_x, n_beams_y) array.

    They need no constants, and weighted with `term_weights` they give omega^2 a few per cent too high.
    """
    return product_coefficients(thin_plate(setup.ends_x, setup.ends_y, _COARSE_MESH, _COARSE_MESH))


def rigidity_columns(values: Values, setup: Setup) -> NDArray[np.float64]:
    """The matrix that takes (D_x, D_y, D_s) to the stiffness weights, at given inputs: (4, 3) array."""
    unit = {name: np.zeros(3) for name in ("D_x", "D_y", "D_s")}
    for i, name in enumerate(unit):
        unit[name][i] = 1.0
    return term_weights({**values, **unit}, setup).stiffness.T


def paper_coefficients(coefficients: NDArray[np.float64], aspect_ratio: float, nu_xy: float) -> NDArray[np.float64]:
    """The paper's a, b, c from the coefficients of the four terms on the unit square.

    Parameters
    ----------
    coefficients : (n_modes, 4) array
    aspect_ratio : float
        L_x / L_y.
    nu_xy : float

    Returns
    -------
    (n_modes, 3) array
        Columns a, b, c of omega^2 = lambda (a D_x + b D_y + c D_s), lambda = 1 / (rho h A^2).

    References
    ----------
    Ducceschi et al., eq. (10) and (12).
    """
    xx, yy, mix, xy = coefficients.T
    return np.column_stack([xx / aspect_ratio**2, yy * aspect_ratio**2 + nu_xy * mix, xy])
