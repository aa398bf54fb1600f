"""An isotropic plate, in air and in water, against numbers measured on free steel.

Measured: J. Sundqvist, Computers & Structures 17 (1983) 793-807, as tabulated by L. E. Monterrubio and P. Krysl,
J. Vib. Acoust. 141 (2019) 021008, tables 1 and 2, whole Hz. Labels (2,0), (1,1), (2,1), (3,0), (0,2).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from generator.effects import FluidLoading, NoEffect, TransverseShear
from generator.known_boards import BEAMS, STEEL
from generator.naming import frequencies
from generator.panels import air_mass
from generator.plate import Plate, solve

AIR = np.array([641.0, 712.0, 1577.0, 1766.0, 2139.0])
WATER = np.array([497.0, 575.0, 1293.0, 1408.0, 1758.0])
TANK = FluidLoading(997.0, baffle=0.0)
SHEAR = TransverseShear()


def apart(measured: np.ndarray, *effects: NoEffect, nu: float = 0.3) -> np.ndarray:
    """Computed against measured, cents, at the modulus of `STEEL`."""
    plate = Plate.isotropic(STEEL.E_x, nu, STEEL.rho, STEEL.h, STEEL.L_x, STEEL.L_y, STEEL.edges)
    found = frequencies(plate, effects, BEAMS["steel"])[0]
    return 1200.0 * np.log2(np.array(list(found.values())) / measured)


def refitted(cents: np.ndarray) -> tuple[float, float]:
    """Modulus, GPa, that makes the mean zero (all frequencies go with its root), and what is left, rms, cents."""
    return 200.0 * 2.0 ** (-np.mean(cents) / 600.0), float(np.std(cents))


@pytest.mark.parametrize(
    ("effects", "nu", "modulus", "left"),
    [
        ((), 0.3, 195.5, 10.2),
        ((SHEAR,), 0.3, 202.0, 5.0),
        ((), 0.317, None, 8.0),
        ((SHEAR,), 0.289, None, 3.3),
    ],
    ids=["thin", "shear-flexible", "thin, nu free", "shear-flexible, nu free"],
)
def test_in_air(effects: tuple[NoEffect, ...], nu: float, modulus: float | None, left: float) -> None:
    """Printed to 0.1 cents: half of that; the modulus with shear is printed as 202 and as 201.7 GPa."""
    found, rms = refitted(apart(AIR, *effects, nu=nu))

    assert rms == pytest.approx(left, abs=0.051)
    assert modulus is None or found == pytest.approx(modulus, abs=0.5)


@pytest.mark.parametrize(
    ("effects", "modulus", "left"),
    [((), 126.0, 30.2), ((SHEAR,), 131.0, 40.1), ((TANK,), 189.0, 12.0), ((SHEAR, TANK), 194.6, 4.7)],
    ids=["no fluid", "shear", "fluid", "fluid and shear"],
)
def test_in_water(effects: tuple[NoEffect, ...], modulus: float, left: float) -> None:
    """0.1 cents without the fluid; with it 0.5, as the lattice behind the printed numbers ends elsewhere."""
    found, rms = refitted(apart(WATER, *effects))

    assert rms == pytest.approx(left, abs=0.5 if TANK in effects else 0.1)
    assert found == pytest.approx(modulus, abs=0.5)


def test_water_from_the_constants_in_air() -> None:
    """378 cents without the fluid and 31.5 with it. The printed 31.5 rests on the lattice: 0.2 % of a frequency."""
    modulus, _ = refitted(apart(AIR, SHEAR))
    carried = 600.0 * np.log2(modulus / 200.0)
    without, inside = (apart(WATER, SHEAR, *fluid) + carried for fluid in ((), (TANK,)))

    assert np.sqrt(np.mean(without**2)) == pytest.approx(378.0, abs=2.0)
    assert np.sqrt(np.mean(inside**2)) == pytest.approx(31.5, abs=1200.0 * np.log2(1.002))
    assert np.all(inside > 20.0)


def test_lattices_have_converged_for_water() -> None:
    """Added mass of half the plate's own: 5e-4 of it is 0.15 cents."""
    modes = solve(STEEL, (), 8)
    moved = modes.vectors[:, 3:]
    coarse, fine = (
        997.0 * np.einsum("ik,ij,jk->k", moved, air_mass(modes.basis, False, n), moved) for n in (320, 1280)
    )

    assert coarse == pytest.approx(fine, rel=1e-3)
    assert np.all((fine > 0.4) & (fine < 0.7))
    default = 997.0 * np.einsum("ik,ij,jk->k", moved, air_mass(modes.basis, False), moved)
    assert default == pytest.approx(fine, rel=5e-4)


def test_isotropic_plate_has_two_constants() -> None:
    """D_s = 2 D (1 - nu), and turning it changes nothing."""
    D_s = STEEL.G_xy * STEEL.h**3 / 3.0

    assert STEEL.D_x == STEEL.D_y == pytest.approx(200e9 * STEEL.h**3 / 12.0 / (1.0 - 0.3**2))
    assert D_s == pytest.approx(2.0 * STEEL.D_x * 0.7)
    turned = replace(STEEL, grain=0.7)
    assert solve(turned, [SHEAR], 9).frequencies[3:] == pytest.approx(
        solve(STEEL, [SHEAR], 9).frequencies[3:], rel=1e-9
    )


def test_shear_moduli_of_an_isotropic_plate_are_its_own() -> None:
    assert SHEAR.changed(STEEL).shear == (STEEL.G_xy, STEEL.G_xy)
    assert TransverseShear(1e9, 2e9).changed(STEEL).shear == (1e9, 2e9)
