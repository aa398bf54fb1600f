"""The generator's plate against another solver and a closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from closed_forms import navier

from generator.designs import ALL_FREE
from generator.known_boards import FIEMME, FINNISH, FREE
from generator.plate import EDGES, Plate, solve

ALL_SUPPORTED = dict.fromkeys(EDGES, "supported")
SHEAR = (0.62e9, 0.023e9)


def hertz(plate: Plate, n_modes: int = 8) -> np.ndarray:
    """Lowest elastic frequencies, Hz; three rigid motions of a free plate are left out."""
    n_rigid = 3 if dict(plate.edges) == ALL_FREE and not plate.springs else 0
    return solve(plate, n_modes=n_rigid + n_modes).frequencies[n_rigid:]


def other(plate: Plate) -> ritz.Plate:
    """The plate of the other solver, by the same constants."""
    moduli = {name: getattr(plate, name) for name in ("E_x", "E_y", "G_xy", "nu_xy", "rho", "h", "L_x", "L_y")}
    return ritz.Plate.from_moduli(**moduli, edges=plate.edges)


@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_thin_plates_agree_with_the_other_ritz_solver(plate: Plate) -> None:
    assert 1200.0 * np.log2(hertz(plate) / ritz.frequencies(other(plate), 8)) == pytest.approx(0.0, abs=0.02)


def test_supported_shear_flexible_plate_is_the_closed_form() -> None:
    plate = replace(FIEMME, edges=ALL_SUPPORTED, shear=SHEAR, h=6e-3)

    assert hertz(plate) == pytest.approx(np.sqrt(navier(other(plate), SHEAR, 8)) / (2.0 * np.pi), rel=1e-6)
