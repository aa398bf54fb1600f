"""Exact spectra of plates; like the independent solver this must not import the package."""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray
from ritz import Plate
from scipy.linalg import eigh


def navier(board: Plate, shear_moduli: tuple[float, float] | None, n_modes: int) -> NDArray[np.float64]:
    """Lowest omega^2 of the supported plate; with G_xz and G_yz, Pa, it is shear-flexible and has rotary inertia.

    Deflection and the two turnings are sines and cosines: a pencil of three for each pair of half-wave numbers.
    """
    twist, mixed = board.D_s / 4, board.nu_xy * board.D_y + board.D_s / 4
    areal = board.rho * board.h
    lowest = []
    for m, n in product(range(1, 12), repeat=2):
        a, b = m * np.pi / board.L_x, n * np.pi / board.L_y
        if shear_moduli is None:
            energy = board.D_x * a**4 + board.D_y * b**4 + 2 * (mixed + twist) * a**2 * b**2
            lowest.append(energy / areal)
            continue
        S_x, S_y = (5 / 6 * board.h * G for G in shear_moduli)
        stiffness = [
            [S_x * a**2 + S_y * b**2, -S_x * a, -S_y * b],
            [-S_x * a, board.D_x * a**2 + twist * b**2 + S_x, mixed * a * b],
            [-S_y * b, mixed * a * b, board.D_y * b**2 + twist * a**2 + S_y],
        ]
        mass = areal * np.diag([1.0, board.h**2 / 12, board.h**2 / 12])
        lowest.append(eigh(stiffness, mass, eigvals_only=True)[0])
    return np.sort(lowest)[:n_modes]
