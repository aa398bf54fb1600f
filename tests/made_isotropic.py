"""Isotropic plates: a measured one of steel, and free sheets whose frequencies the independent solver gives."""

from __future__ import annotations

import ritz

from bayesplate import Board, Quantity, Setup
from bayesplate.board.material import isotropic_moduli

STEEL_HZ = {(2, 0): 641, (1, 1): 712, (2, 1): 1577, (3, 0): 1766, (0, 2): 2139}
"""Of a free steel plate in air: J. Sundqvist, Computers & Structures 17 (1983), 793-807, as given in table 1 of L. E.
Monterrubio and P. Krysl, J. Vib. Acoust. 141 (2019) 021008; the labels by the order of the plate's modes."""
STEEL = {"length_x": 0.270, "length_y": 0.1495, "thickness": 8.96e-3, "density": 7797.0, "poisson_xy": 0.3}

SHEET = {"length_x": 0.270, "length_y": 0.150, "thickness": 2e-3, "density": 2700.0}
"""A free sheet in the words of `Board.from_numbers`, of the same shape but thin."""
LABELS = ((2, 0), (1, 1), (2, 1), (3, 0), (0, 2), (3, 1))


def steel(**more):
    """The steel plate, isotropic unless told otherwise; further arguments as of `Board.from_numbers`."""
    free = Setup.from_frequencies(STEEL_HZ, edges="free", resolution=1)
    return Board.from_numbers("steel", **{**STEEL, "isotropic": True, "setups": free, **more})


def sheet_hz(E, nu, labels=LABELS):
    """Frequencies of the sheet by label, Hz, without noise, by the independent solver; E in Pa."""
    plate = ritz.Plate.from_moduli(
        *(float(one) for one in isotropic_moduli(E, nu)), nu, rho=SHEET["density"], h=SHEET["thickness"],
        L_x=SHEET["length_x"], L_y=SHEET["length_y"], edges=ritz.ALL_FREE,
    )  # fmt: skip
    return ritz.simulate(plate, labels, n=16)


def sheet(hz, noise=0.003, **more):
    """The sheet with readings by label, Hz, and what its noise is expected to be."""
    free = Setup.from_frequencies(hz, edges="free", noise=Quantity.from_median(noise, 1.3))
    return Board.from_numbers("sheet", **{**SHEET, "poisson_xy": 0.3, "isotropic": True, "setups": free, **more})
