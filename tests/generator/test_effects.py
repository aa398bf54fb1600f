"""Every effect of the generator against a hand formula, and against the independent sizes of physics.md."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize

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
    StiffnessGradient,
    SupportStiffness,
    ThicknessProfile,
    TransverseShear,
)
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE, cents, field
from generator.naming import frequencies
from generator.outside import Crack, Rib
from generator.plate import EDGES, Plate, matrices, solve

ALL_SUPPORTED = dict.fromkeys(EDGES, "supported")
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
    "shear, clamped": (FIEMME, TransverseShear(0.62e9, 0.023e9), [-6, -19, -6, -15, -36, -31]),
    "air open, cantilever": (FINNISH, FluidLoading(), [-42, -22, -32, -25, -21, -17]),
    "grain, cantilever": (FINNISH, GrainAngle(np.radians(3.0)), [-17.6, 4.9, -8.9, -7.2, 4.5, -6.5]),
    "taper": (FINNISH, ThicknessProfile(0.05), [-54, -23, -13, 7, -6, 1]),
    "density": (FINNISH, DensityGradient(0.05), [-13, -12, -5, -10, -4, -4]),
    "Poisson": (FINNISH, PoissonRatio(0.35), [-5, -3, 5, -14, -5, -9]),
    "0.6 g": (FINNISH, AttachedMass(0.6e-3, ((0.9 * 0.223, 0.75 * 0.114),)), [-42, -28, -16, 0, -17, -1]),
    "tension along": (FIEMME, MembraneTension(500.0, 0.0), [92, 30, 66, 43, 10, 22]),
    "tension across": (FIEMME, MembraneTension(0.0, 500.0), [181, 220, 36, 87, 163, 98]),
    "soft clamp": (FINNISH, ClampRotation(30.0 * FINNISH.D_x / FINNISH.L_x), [-109, None, None, -22, None, None]),
    "clamp at 1000": (FINNISH, ClampRotation(1e3 * FINNISH.D_x / FINNISH.L_x), [-3.5, None, None, -1, None, None]),
    "sinking clamp": (FINNISH, ClampTranslation(1e4 * FINNISH.D_x / FINNISH.L_x**3), [-1, None, None, None, None, -12]),
}


@pytest.mark.parametrize(("plate", "effect", "sizes"), PHYSICS.values(), ids=PHYSICS)
def test_sizes_on_the_papers_boards(plate: Plate, effect: NoEffect, sizes: list[float | None]) -> None:
    """Within 15 %, or 1 cent where the size is printed as a small whole number; None is not printed."""
    found = cents(plate, [effect], BEAMS["clamped" if plate is FIEMME else "cantilever"])

    for shift, size in zip(found, sizes, strict=True):
        assert size is None or shift == pytest.approx(size, rel=0.15, abs=1.0)


def test_mass_at_the_end_of_a_free_beam() -> None:
    """The transcendental equation, and for a tiny mass the first order: -4 m / M of omega^2."""
    beam = Plate(10e9, 10e9, 5e9, 0.0, 500.0, 2e-3, 0.3, 0.01, ALL_FREE)
    total = beam.rho * beam.h * beam.L_x * beam.L_y

    def tip(b: float, ratio: float) -> float:
        """Determinant for b = beta L: no moment at the end, shear force EI w''' = -m omega^2 w."""
        c, s, C, S = np.cos(b), np.sin(b), np.cosh(b), np.sinh(b)
        moment = (C - c, S - s)
        force = (S + s + ratio * b * (C + c), C - c + ratio * b * (S + s))
        return float(moment[0] * force[1] - moment[1] * force[0])

    def square(ratio: float) -> float:
        mass = AttachedMass(ratio * total, ((beam.L_x, 0.5 * beam.L_y),))
        return frequencies(beam, [mass], [(2, 0)], (14, 5))[0][2, 0] ** 2

    bare = square(0.0)
    for ratio in (1e-4, 0.03, 0.3):
        root = scipy.optimize.brentq(tip, 3.5, 4.74, args=(ratio,))
        assert square(ratio) / bare == pytest.approx((root / 4.7300407) ** 4, rel=1e-4)
    assert square(1e-4) / bare - 1.0 == pytest.approx(-4e-4, rel=2e-3)


def test_roving_mass_averages_the_frequencies_and_turns() -> None:
    places = ((0.05, 0.02), (0.2, 0.1))
    beams = BEAMS["cantilever"]
    roving = frequencies(FINNISH, [AttachedMass(1e-3, places)], beams)[0]
    each = [frequencies(FINNISH, [AttachedMass(1e-3, (place,))], beams)[0] for place in places]

    assert [roving[m] for m in beams] == pytest.approx([0.5 * (each[0][m] + each[1][m]) for m in beams])
    turned = gain(FREE_FINNISH, lambda x, y: x + 2.0 * y, AttachedMass(3e-3, ((0.1, 0.05),), rotary_radius=0.01))
    assert turned[1] == pytest.approx(3e-3 * (0.2**2 + 0.01**2 * (1.0 + 4.0)))


def test_tension_and_foundation_on_a_supported_plate() -> None:
    plate = replace(FIEMME, edges=ALL_SUPPORTED)
    beams = BEAMS["clamped"]
    bare = frequencies(plate, (), beams)[0]
    tight = frequencies(plate, [MembraneTension(300.0, 200.0), SupportStiffness(5e3)], beams)[0]
    for m, n in beams:
        along, across = (m + 1) * np.pi / plate.L_x, (n + 1) * np.pi / plate.L_y
        added = (300.0 * along**2 + 200.0 * across**2 + 5e3) / (plate.rho * plate.h)
        assert (2.0 * np.pi) ** 2 * (tight[m, n] ** 2 - bare[m, n] ** 2) == pytest.approx(added, rel=1e-6)


def test_profiles_on_fields_integrated_by_hand() -> None:
    """w = x^2 / 2 bends along x by one everywhere; w = 1 only weighs."""
    L_x, area, D_x = FINNISH.L_x, FINNISH.L_x * FINNISH.L_y, FINNISH.D_x
    ends = 1.0 - 0.1, 1.0 + 0.1  # a taper of 0.2
    cubes = (ends[1] ** 4 - ends[0] ** 4) / (4.0 * 0.2)

    bent, _ = energy(FREE_FINNISH, lambda x, y: 0.5 * x**2, ThicknessProfile(0.2))
    assert bent == pytest.approx(D_x * area * cubes)
    bent, _ = energy(FREE_FINNISH, lambda x, y: 0.5 * x**2, ThicknessProfile(0.0, -0.2))
    assert bent == pytest.approx(D_x * area * cubes)
    _, weight = energy(FREE_FINNISH, lambda x, y: np.ones_like(x), ThicknessProfile(0.2, 0.1))
    assert weight == pytest.approx(FINNISH.rho * FINNISH.h * area)
    bent, moment = energy(FREE_FINNISH, lambda x, y: x, DensityGradient(0.1))
    assert moment == pytest.approx(FINNISH.rho * FINNISH.h * area * L_x**2 * (1.0 / 3.0 + 0.1 * (0.25 - 1.0 / 6.0)))
    assert bent == pytest.approx(0.0, abs=1e-9)
    no_poisson = replace(FREE_FINNISH, nu_xy=0.0)
    bent, _ = energy(no_poisson, lambda x, y: x**3 / 6.0, StiffnessGradient(0.2))
    assert bent == pytest.approx(no_poisson.D_x * FINNISH.L_y * L_x**3 * (1.0 / 3.0 + 0.2 * (0.25 - 1.0 / 6.0)))


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
