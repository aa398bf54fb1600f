"""Effects of the generator against the independent sizes of physics.md, and those that are no effect of the library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from generator.designs import ALL_FREE
from generator.effects import (
    AttachedMass,
    ClampRotation,
    ClampTranslation,
    DensityGradient,
    FluidLoading,
    GrainAngle,
    MembraneTension,
    NoEffect,
    OutlineProfile,
    PoissonRatio,
    ThicknessProfile,
    TransverseShear,
)
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE, cents, field
from generator.naming import frequencies
from generator.outside import Crack, Rib
from generator.panels import air_mass
from generator.plate import Plate, matrices, solve

FREE_FINNISH = replace(FINNISH, edges=ALL_FREE)


def energy(plate: Plate, w, effect: NoEffect | None = None) -> tuple[float, float]:
    """Twice the strain energy of a deflection and twice its kinetic energy at unit frequency."""
    plate = effect.changed(plate) if effect else plate
    basis = plate.basis((8, 8))
    stiffness, mass = matrices(plate, basis)
    stiffness, mass = effect.added(plate, basis, stiffness, mass) if effect else (stiffness, mass)
    unknowns = field(basis, w)
    return float(unknowns @ stiffness @ unknowns), float(unknowns @ mass @ unknowns)


def gain(plate: Plate, w, effect: NoEffect) -> np.ndarray:
    """What an effect adds to both."""
    return np.subtract(energy(plate, w, effect), energy(plate, w))


PHYSICS = {
    "shear, cantilever": (FINNISH, TransverseShear(0.62e9, 0.023e9), [-2, -24, -15, -30, -35, -62]),
    "air open, cantilever": (FINNISH, FluidLoading(), [-42, -22, -32, -25, -21, -17]),
    "grain, cantilever": (FINNISH, GrainAngle(np.radians(3.0)), [-17.6, 4.9, -8.9, -7.2, 4.5, -6.5]),
    "taper": (FINNISH, ThicknessProfile(0.05), [-54, -23, -13, 7, -6, 1]),
    "density": (FINNISH, DensityGradient(0.05), [-13, -12, -5, -10, -4, -4]),
    "Poisson": (FINNISH, PoissonRatio(0.35), [-5, -3, 5, -14, -5, -9]),
    "0.6 g": (FINNISH, AttachedMass(0.6e-3, ((0.9 * 0.223, 0.75 * 0.114),)), [-42, -28, -16, 0, -17, -1]),
    "tension along": (FIEMME, MembraneTension(500.0, 0.0), [92, 30, 66, 43, 10, 22]),
    "tension across": (FIEMME, MembraneTension(0.0, 500.0), [181, 220, 36, 87, 163, 98]),
    "soft clamp": (FINNISH, ClampRotation(30.0 * FINNISH.D_x / FINNISH.L_x), [-109, None, None, -22, None, None]),
    "sinking clamp": (FINNISH, ClampTranslation(1e4 * FINNISH.D_x / FINNISH.L_x**3), [-1, None, None, None, None, -12]),
}


@pytest.mark.parametrize(("plate", "effect", "sizes"), PHYSICS.values(), ids=PHYSICS)
def test_sizes_on_the_papers_boards(plate: Plate, effect: NoEffect, sizes: list[float | None]) -> None:
    """Within 15 %, or 1 cent where the size is printed as a small whole number; None is not printed."""
    found = cents(plate, [effect], BEAMS["clamped" if plate is FIEMME else "cantilever"])

    for shift, size in zip(found, sizes, strict=True):
        assert size is None or shift == pytest.approx(size, rel=0.15, abs=1.0)


def test_roving_mass_averages_the_frequencies_and_turns() -> None:
    places = ((0.05, 0.02), (0.2, 0.1))
    beams = BEAMS["cantilever"]
    roving = frequencies(FINNISH, [AttachedMass(1e-3, places)], beams)[0]
    each = [frequencies(FINNISH, [AttachedMass(1e-3, (place,))], beams)[0] for place in places]

    assert [roving[m] for m in beams] == pytest.approx([0.5 * (each[0][m] + each[1][m]) for m in beams])
    turned = gain(FREE_FINNISH, lambda x, y: x + 2.0 * y, AttachedMass(3e-3, ((0.1, 0.05),), rotary_radius=0.01))
    assert turned[1] == pytest.approx(3e-3 * (0.2**2 + 0.01**2 * (1.0 + 4.0)))


def test_outlines() -> None:
    """A narrower rectangle inside a wider basis is the narrower plate; a trapezium weighs what it should."""
    narrow = replace(FREE, L_y=0.95 * FREE.L_y)
    inside = replace(FREE, outline=((0.0, 0.95 * FREE.L_y), (FREE.L_x, 0.95 * FREE.L_y)))
    found, expected = (solve(plate, (), 11).frequencies[3:] for plate in (inside, narrow))
    assert found == pytest.approx(expected, rel=1e-6)

    trapezium = OutlineProfile((0.0, 0.3, FREE.L_x), (0.200, 0.217, 0.210))
    _, weight = energy(FREE, lambda x, y: np.ones_like(x), trapezium)
    area = 0.3 * 0.2085 + 0.28 * 0.2135
    assert weight == pytest.approx(FREE.rho * FREE.h * area)
    with pytest.raises(ValueError, match="wanted y0 and y1 free"):
        trapezium.changed(FIEMME)


def test_what_lies_outside_the_library() -> None:
    """A rib bends with w_yy along its line, a crack takes half of its strip."""
    L_y = FINNISH.L_y
    assert gain(FREE_FINNISH, lambda x, y: 0.5 * y**2, Rib(0.1, 0.02, 0.0))[0] == pytest.approx(0.02 * L_y)
    assert gain(FREE_FINNISH, lambda x, y: x, Rib(0.1, 0.0, 0.004))[1] == pytest.approx(0.004 * 0.1**2 * L_y)

    crack = Crack(start=0.1, end=0.2, place=0.05, width=0.02, loss=0.5)
    lost, _ = gain(FREE_FINNISH, lambda x, y: 0.5 * y**2, crack)
    assert lost == pytest.approx(-0.5 * FINNISH.E_y * FINNISH.h**3 / 12.0 * 0.1 * 0.02 * 0.5, rel=1e-6)


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
