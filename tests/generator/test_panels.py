"""The air of the panels against squares, and the wavenumber integrals of physics.md."""

from __future__ import annotations

import numpy as np
import pytest

from generator.designs import ALL_FREE
from generator.known_boards import FIEMME, field
from generator.panels import air_mass
from generator.plate import Plate, solve


def piston(L_x: float, L_y: float, baffled: bool, n_panels: int = 400) -> float:
    """Air moved by a rigid rectangle, both faces, m^3 per unit density."""
    basis = Plate(1.0, 1.0, 1.0, 0.0, 1.0, 1.0, L_x, L_y, ALL_FREE).basis((4, 4))
    moved = field(basis, lambda x, y: np.ones_like(x))
    return float(moved @ air_mass(basis, baffled, n_panels) @ moved)


def test_rigid_squares() -> None:
    """In a wall: the self-potential of a square; in the open: 0.579 of pi a^3 / 4, the coefficient of the handbooks."""
    assert piston(1.0, 1.0, True) == pytest.approx(2.97321 / np.pi, rel=1e-4)
    assert piston(1.0, 1.0, False) == pytest.approx(0.579 * np.pi / 4.0, rel=2e-3)


@pytest.mark.parametrize(
    ("baffled", "printed"),
    [(True, [0.34, 0.14, 0.18, 0.12, 0.12, 0.09]), (False, [0.25, 0.13, 0.16, 0.11, 0.09, 0.08])],
)
def test_added_mass_of_the_clamped_board(baffled: bool, printed: list[float]) -> None:
    """1.2 kg m^-3, modes in the order of BEAMS; half a unit of the last printed digit and the 15 % of the brief."""
    bare = solve(FIEMME, (), 6)
    ratios = 1.2 * np.einsum("ik,ij,jk->k", bare.vectors, air_mass(bare.basis, baffled), bare.vectors)

    assert ratios == pytest.approx(printed, rel=0.03, abs=0.005)
