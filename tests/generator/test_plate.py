"""The generator's plate against handbook values, closed forms, the paper's numbers, and its own limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz

from generator.designs import ALL_FREE
from generator.known_boards import FIEMME, FINNISH, FREE
from generator.plate import EDGES, Plate, rotated, solve
from generator.spring import Spring

ALL_SUPPORTED = dict.fromkeys(EDGES, "supported")
SHEAR = (0.62e9, 0.023e9)


def hertz(plate: Plate, n_modes: int = 8) -> np.ndarray:
    """Lowest elastic frequencies, Hz; three rigid motions of a free plate are left out."""
    n_rigid = 3 if dict(plate.edges) == ALL_FREE and not plate.springs else 0
    return solve(plate, n_modes=n_rigid + n_modes).frequencies[n_rigid:]


@pytest.mark.parametrize(("edges", "omega"), [("CCCC", 35.985), ("CFFF", 3.4711), ("FFFF", 13.468)])
def test_square_isotropic_plates_ring_as_in_the_handbooks(edges: str, omega: float) -> None:
    words = {"C": "clamped", "F": "free"}
    h, nu = 1e-2, 0.3
    plate = Plate(
        *(1.0, 1.0, 0.5 / (1.0 + nu), nu, 1.0, h, 1.0, 1.0),
        edges=dict(zip(EDGES, (words[e] for e in edges), strict=True)),
    )
    unit = np.sqrt(plate.D_x / h)

    assert 2.0 * np.pi * hertz(plate)[0] / unit == pytest.approx(omega, rel=1e-4)


@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_thin_plates_agree_with_the_other_ritz_solver(plate: Plate) -> None:
    moduli = {name: getattr(plate, name) for name in ("E_x", "E_y", "G_xy", "nu_xy", "rho", "h", "L_x", "L_y")}
    other = ritz.frequencies(ritz.Plate.from_moduli(**moduli, edges=plate.edges), 8)

    assert 1200.0 * np.log2(hertz(plate) / other) == pytest.approx(0.0, abs=0.02)


def test_supported_thin_plate_is_the_closed_form() -> None:
    plate = replace(FIEMME, edges=ALL_SUPPORTED)
    m, n = np.pi * np.arange(1, 8)[:, None] / plate.L_x, np.pi * np.arange(1, 8)[None, :] / plate.L_y
    twist = 4.0 * plate.G_xy * plate.h**3 / 12.0 + 2.0 * plate.nu_xy * plate.D_y
    exact = np.sort(
        np.sqrt((plate.D_x * m**4 + plate.D_y * n**4 + twist * m**2 * n**2) / (plate.rho * plate.h)).ravel()
    )

    assert hertz(plate) == pytest.approx(exact[:8] / (2.0 * np.pi), rel=1e-7)


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


@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_shear_flexible_plate_does_not_lock(plate: Plate) -> None:
    """Very stiff in shear it is thin, but for its rotary inertia, known to first order from the thin modes."""
    thin = solve(plate, n_modes=11)
    x, y, weights = thin.basis.points
    slopes = [thin.basis.deflection(x, y, *order) @ thin.vectors for order in ((1, 0), (0, 1))]
    rotary = plate.rho * plate.h**3 / 12.0 * sum(weights @ slope**2 for slope in slopes)  # modal masses are one
    stiff = solve(replace(plate, shear=(1e12, 1e12)), n_modes=11)
    elastic = thin.frequencies > 1.0
    shift = 1200.0 * np.log2(stiff.frequencies[elastic] / thin.frequencies[elastic])

    assert shift == pytest.approx(-600.0 / np.log(2.0) * rotary[elastic], abs=0.15)


def test_turned_stiffness_keeps_the_invariants_and_the_sign_of_the_angle() -> None:
    Q = FINNISH.in_plane
    turned, back = rotated(Q, 0.3), rotated(Q, -0.3)

    assert turned[0, 0] + turned[1, 1] + 2.0 * turned[0, 1] == pytest.approx(Q[0, 0] + Q[1, 1] + 2.0 * Q[0, 1])
    assert turned[2, 2] - turned[0, 1] == pytest.approx(Q[2, 2] - Q[0, 1])
    assert turned[0, 2] == pytest.approx(-back[0, 2])
    assert turned[0, 2] > 0.0


@pytest.mark.parametrize("shear", [None, SHEAR], ids=["thin", "shear-flexible"])
class TestSprings:
    """A released edge between its limits."""

    def released(self, shear: tuple[float, float] | None, **spring: float) -> np.ndarray:
        plate = replace(FIEMME, shear=shear, springs={edge: Spring(**spring) for edge in EDGES})
        return solve(plate, n_modes=12).frequencies

    def test_stiff_springs_clamp(self, shear: tuple[float, float] | None) -> None:
        """A layer that resists all rotations holds both; the soft tangential edge of the shear plate costs a little."""
        clamped = hertz(replace(FIEMME, shear=shear), 8)
        tolerance = 0.1 if shear is None else 1.0

        assert 1200.0 * np.log2(self.released(shear, rotation=1e7)[:8] / clamped) == pytest.approx(0.0, abs=0.1)
        stiff = self.released(shear, rotation=1e7, translation=1e12)[:8]
        assert 1200.0 * np.log2(stiff / clamped) == pytest.approx(0.0, abs=tolerance)

    def test_without_any_resistance_it_is_free(self, shear: tuple[float, float] | None) -> None:
        free = hertz(replace(FIEMME, shear=shear, edges=ALL_FREE))
        found = self.released(shear, rotation=0.0, translation=0.0)

        assert found[:3] == pytest.approx(0.0, abs=1e-2)
        assert found[3:11] == pytest.approx(free, rel=1e-6)
