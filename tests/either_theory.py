"""Plates of both theories from one set of constants, and their lowest modes, for the tests of the solver."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import ritz

from bayesplate.plate.mesh import ELEMENTS_PER_SIDE, mesh
from bayesplate.plate.shear import SHEAR_ELEMENTS_PER_SIDE, shear_flexible_plate
from bayesplate.plate.solve import solve
from bayesplate.plate.terms import Weights
from bayesplate.plate.thin import thin_plate

SQUARE = ritz.Plate.isotropic(0.3, ritz.ALL_FREE)
SUPPORTS = {
    "clamped": ritz.ALL_CLAMPED,
    "supported": ritz.ALL_SUPPORTED,
    "free": ritz.ALL_FREE,
    "cantilever": ritz.CANTILEVER,
    "mixed": {"x0": "clamped", "x1": "free", "y0": "supported", "y1": "free"},
    "hinged at one edge": {"x0": "supported", "x1": "free", "y0": "free", "y1": "free"},
}
G_SPRUCE = (0.62e9, 0.023e9)
"""G_xz and G_yz, Pa; a plate without shear moduli is thin."""


def weights_of(board, shear_moduli=None):
    """Those of a thin plate; with shear moduli kappa G / (rho L^2) and the rotary inertia of a layer as well."""
    if shear_moduli is None:
        return Weights(board.unit_weights, np.ones(1))
    sides = board.L_x, board.L_y
    shear = [5 / 6 * G / (board.rho * L**2) for G, L in zip(shear_moduli, sides, strict=True)]
    rotary = [board.h**2 / (12 * L**2) for L in sides]
    return Weights(np.array([*board.unit_weights, *shear]), np.array([1.0, *rotary]))


def assembled(board, shear_moduli=None, shape=None):
    """The plate on so many elements along x and y, those of the production mesh if none are given."""
    per_side = ELEMENTS_PER_SIDE if shear_moduli is None else SHEAR_ELEMENTS_PER_SIDE
    make = thin_plate if shear_moduli is None else shear_flexible_plate
    return make(*board.ends, *(shape or mesh(weights_of(board), per_side)))


def solved(board, n_modes, shear_moduli=None, shape=None):
    return solve(assembled(board, shear_moduli, shape), weights_of(board, shear_moduli), n_modes)


def with_thickness(board, thickness):
    """The same material at another thickness; rigidities go with its cube."""
    cube = (thickness / board.h) ** 3
    return replace(board, h=thickness, D_x=board.D_x * cube, D_y=board.D_y * cube, D_s=board.D_s * cube)


def cents(eigenvalues, expected):
    """Between frequencies, from eigenvalues, which are their squares."""
    return 600.0 * np.log2(np.asarray(eigenvalues) / expected)
