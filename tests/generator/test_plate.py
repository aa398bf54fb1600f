"""The generator's plate against another solver and a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz

from generator.designs import ALL_FREE
from generator.known_boards import FIEMME, FINNISH, FREE
from generator.plate import EDGES, Plate, solve

ALL_SUPPORTED = dict.fromkeys(EDGES, "supported")
SHEAR = (0.62e9, 0.023e9)


def hertz(plate: Plate, n_modes: int = 8) -> np.ndarray:
    """Lowest elastic frequencies, Hz; three rigid motions of a free plate are left out."""
    n_rigid = 3 if dict(plate.edges) == ALL_FREE and not plate.springs else 0
    return solve(plate, n_modes=n_rigid + n_modes).frequencies[n_rigid:]


@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_thin_plates_agree_with_the_other_ritz_solver(plate: Plate) -> None:
    moduli = {name: getattr(plate, name) for name in ("E_x", "E_y", "G_xy", "nu_xy", "rho", "h", "L_x", "L_y")}
    other = ritz.frequencies(ritz.Plate.from_moduli(**moduli, edges=plate.edges), 8)

    assert 1200.0 * np.log2(hertz(plate) / other) == pytest.approx(0.0, abs=0.02)


def test_supported_shear_flexible_plate_is_the_closed_form() -> None:
    """Fields W sin sin, A cos sin, B sin cos: a pencil of three for each pair of half-wave numbers."""
    plate = replace(FIEMME, edges=ALL_SUPPORTED, shear=SHEAR, h=6e-3)
    h, (Q, cubed) = plate.h, (plate.in_plane, plate.h**3 / 12.0)
    S_x, S_y = (5.0 / 6.0 * h * G for G in SHEAR)
    squares = []
    for i in range(1, 7):
        for j in range(1, 7):
            m, n = i * np.pi / plate.L_x, j * np.pi / plate.L_y
            stiffness = np.array(
                [
                    [S_x * m**2 + S_y * n**2, -S_x * m, -S_y * n],
                    [-S_x * m, cubed * (Q[0, 0] * m**2 + Q[2, 2] * n**2) + S_x, cubed * (Q[0, 1] + Q[2, 2]) * m * n],
                    [-S_y * n, cubed * (Q[0, 1] + Q[2, 2]) * m * n, cubed * (Q[1, 1] * n**2 + Q[2, 2] * m**2) + S_y],
                ]
            )
            mass = plate.rho * h * np.array([1.0, h**2 / 12.0, h**2 / 12.0])
            squares.append(np.linalg.eigvalsh(stiffness / np.sqrt(np.outer(mass, mass)))[0])

    assert hertz(plate) == pytest.approx(np.sqrt(np.sort(squares)[:8]) / (2.0 * np.pi), rel=1e-6)
