"""Every effect on a plate: the frequencies of the generator, which has another discretisation and other formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import generator.effects as planted
import numpy as np
import pytest
from effect_plates import MADE, hertz, hertz_apart, setup_of, tapered
from generator.designs import ALL_FREE, CANTILEVER
from generator.effects import NoEffect
from generator.exciter import Exciter as PlantedExciter
from generator.known_boards import DRIVEN, FIEMME, FINNISH, FREE, HALF_TOP
from generator.plate import Plate
from generator.warp import Warp as PlantedWarp

from bayesplate.board.parameter import BOARD
from bayesplate.board.quantity import Quantity
from bayesplate.effects import Effect
from bayesplate.effects.attached_items import Item, base_diameter
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.clamp_rotation import STIFFEST as STIFFEST_TURN
from bayesplate.effects.clamp_rotation import ClampRotation
from bayesplate.effects.clamp_translation import STIFFEST as STIFFEST_SINK
from bayesplate.effects.clamp_translation import ClampTranslation
from bayesplate.effects.density_gradient import DensityGradient
from bayesplate.effects.drives import Drive
from bayesplate.effects.exciter import Exciter
from bayesplate.effects.fluid_loading import FluidLoading
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.membrane_tension import MembraneTension
from bayesplate.effects.part import Part
from bayesplate.effects.stiffness_gradient import StiffnessGradient
from bayesplate.effects.support_mass import SupportMass
from bayesplate.effects.support_stiffness import SupportStiffness
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.effects.warp import Warp
from bayesplate.plate.membrane import CURVATURES

TURN, SINK = "clamp_rotation.compliance", "clamp_translation.compliance"
DENSITY, STIFFNESS = "density_gradient.gradient", "stiffness_gradient.gradient"
MASS, FRAME, BED = "attached_mass.mass", "support_mass.mass", "support_stiffness.stiffness"
N, ANGLE = "membrane_tension.N", "grain_angle.angle"
PLAIN = replace(FINNISH, nu_xy=0.0)
"""Without a Poisson ratio E_x is in D_x alone, as the package has it."""
STOUT = replace(FREE, h=0.02)
COVERED, PART = replace(FINNISH, covered=0.03, whole=0.253), Part(0.03 / 0.253, 0.223 / 0.253)
FREE_FINNISH = replace(FINNISH, L_x=0.253, edges=ALL_FREE)
ALONG_X = replace(FINNISH, edges={"x0": "free", "x1": "free", "y0": "clamped", "y1": "free"})


@dataclass(frozen=True)
class Case:
    """The same effects in the package and in the generator; a theory, and cents by which the two may differ.

    `n` are polynomials of the generator along each side, see `hertz_apart`.
    """

    plate: Plate
    effects: Sequence[Effect]
    values: Mapping[str, float]
    planted: Sequence[NoEffect]
    is_sheared: bool = False
    cents: float = 0.5
    n: Sequence[int] = ()
    n_modes: int = 6


def clamp(kind: type[Effect], plate: Plate) -> Effect:
    return kind.of(None, setup_of(plate))


def turning(plate: Plate, compliance: float) -> NoEffect:
    """All edges share k_R, which the compliance gives with the D and L along x where an edge across x is clamped."""
    D, L = (plate.D_x, plate.L_x) if plate.edges["x0"] == "clamped" else (plate.D_y, plate.L_y)
    return planted.ClampRotation(D / ((compliance + STIFFEST_TURN) * L))


def sinking(plate: Plate, compliance: float) -> NoEffect:
    return planted.ClampTranslation(plate.D_x / ((compliance + STIFFEST_SINK) * plate.L_x**3))


def air(plate: Plate) -> FluidLoading:
    return FluidLoading(MADE, plate.L_x / plate.L_y)


def air_values(density: float, baffle: float) -> dict[str, float]:
    return {"fluid_loading.density": density, "fluid_loading.baffle": baffle}


def at(plate: Plate, place: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    """A place, fractions of the sides, as the generator has it."""
    return ((place[0] * plate.L_x, place[1] * plate.L_y),)


def resting(plate: Plate, place: tuple[float, float], mass: float, is_turning: bool = False) -> AttachedMass:
    diameter = float(base_diameter(mass)) if is_turning else 0.0
    radius = 0.5 * diameter / plate.L_x, 0.5 * diameter / plate.L_y
    return AttachedMass(MADE, (Item(Quantity.exact(1e-3), "", (place,), radius),))


def weighed(
    plate: Plate,
    place: tuple[float, float],
    share: float,
    *,
    is_turning: bool = False,
    beside: tuple[Effect, Mapping[str, float], NoEffect] | None = None,
    **how: Any,
) -> Case:
    """A thing of a share of the board's mass at a place; another effect may act beside it.

    Whose polynomials err as the inverse square of their number, so that two numbers of them are extrapolated.
    """
    mass = share * plate.rho * plate.h * plate.L_x * plate.L_y
    gyration = float(base_diameter(mass)) * np.sqrt(1 / 16 + 1 / 3) if is_turning else 0.0
    effects, values = [resting(plate, place, mass, is_turning)], {MASS: mass}
    others: list[NoEffect] = [planted.AttachedMass(mass, at(plate, place), gyration)]
    if beside is not None:
        effects, values, others = [beside[0], *effects], {**beside[1], **values}, [beside[2], *others]
    return Case(plate, effects, values, others, **how)


def driven(resonance: float, **how: Any) -> Case:
    """A weak drive, whose magnet has a mode too; polynomials converge slowly on a point."""
    stated = [(Quantity.exact(value), "") for value in (5e-3, 0.6e-3, resonance)]
    setup, place = setup_of(DRIVEN), (0.25, 0.25)
    effect = Exciter(MADE, (Drive(*stated, True, False, (place,)),), setup.ends_x, setup.ends_y, (1, 2))
    values = {"exciter.mass": 5e-3, "exciter.coil": 0.6e-3, "exciter.resonance": resonance}
    exciter = PlantedExciter.at_resonance(resonance, 5e-3, at(DRIVEN, place), coil_mass=0.6e-3)
    return Case(DRIVEN, [effect], values, [exciter], n_modes=7, **how)


def warp(plate: Plate, names: Sequence[str] = CURVATURES) -> Warp:
    return Warp(BOARD, tuple((name, Quantity.exact(1.0), "") for name in names), plate.L_x / plate.L_y)


def rises(cup: float, bow: float, twist: float) -> dict[str, float]:
    return {"warp.cup": cup, "warp.bow": bow, "warp.twist": twist}


def tapers(x: float, y: float) -> dict[str, float]:
    return {"thickness_profile.taper_x": x, "thickness_profile.taper_y": y}


CASES = {
    "clamps that turn": Case(FIEMME, [clamp(ClampRotation, FIEMME)], {TURN: 1 / 3}, [turning(FIEMME, 1 / 3)]),
    "a clamp along x takes the sides of y": Case(
        ALONG_X, [clamp(ClampRotation, ALONG_X)], {TURN: 0.05}, [turning(ALONG_X, 0.05)]
    ),
    "clamps that give way": Case(FIEMME, [clamp(ClampTranslation, FIEMME)], {SINK: 1e-2}, [sinking(FIEMME, 1e-2)]),
    "a clamp that turns and gives way, shear-flexible": Case(
        FINNISH,
        [clamp(ClampRotation, FINNISH), clamp(ClampTranslation, FINNISH)],
        {TURN: 1 / 30, SINK: 1e-4},
        [turning(FINNISH, 1 / 30), sinking(FINNISH, 1e-4)],
        is_sheared=True,
    ),
    "a clamp that gives way, shear-flexible": Case(
        FINNISH, [clamp(ClampTranslation, FINNISH)], {SINK: 1e-3}, [sinking(FINNISH, 1e-3)], is_sheared=True
    ),
    "density, shear-flexible": Case(FREE, [DensityGradient()], {DENSITY: 0.6}, [planted.DensityGradient(0.6)], True),
    "density of a part": Case(COVERED, [DensityGradient(part=PART)], {DENSITY: 0.3}, [planted.DensityGradient(0.3)]),
    "stiffness": Case(PLAIN, [StiffnessGradient()], {STIFFNESS: 0.6}, [planted.StiffnessGradient(0.6)], cents=0.1),
    "stiffness of a part": Case(
        COVERED, [StiffnessGradient(part=PART)], {STIFFNESS: 0.2}, [planted.StiffnessGradient(0.2)]
    ),
    "stiffness along a turned grain, tapered": Case(
        PLAIN,
        [ThicknessProfile(), StiffnessGradient(), GrainAngle()],
        {STIFFNESS: 0.6, ANGLE: 0.1} | tapers(0.1, 0.05),
        [planted.ThicknessProfile(0.1, 0.05), planted.StiffnessGradient(0.6), planted.GrainAngle(0.1)],
        cents=0.1,
    ),
    "stiffness along a turned grain, shear-flexible": Case(
        PLAIN,
        [StiffnessGradient(), GrainAngle()],
        {STIFFNESS: 0.6, ANGLE: 0.1},
        [planted.StiffnessGradient(0.6), planted.GrainAngle(0.1)],
        is_sheared=True,
        cents=0.2,
    ),
    "air in half a wall": Case(FIEMME, [air(FIEMME)], air_values(1.2, 0.4), [planted.FluidLoading(1.2, 0.4)]),
    "air in a wall, heavier than the board": Case(
        FREE, [air(FREE)], air_values(6.0, 1.0), [planted.FluidLoading(6.0, 1.0)]
    ),
    "open air, shear-flexible": Case(
        FIEMME, [air(FIEMME)], air_values(1.2, 0.0), [planted.FluidLoading(1.2, 0.0)], is_sheared=True
    ),
    "grain": Case(FREE, [GrainAngle()], {ANGLE: 0.2}, [planted.GrainAngle(0.2)]),
    "grain, shear-flexible": Case(FINNISH, [GrainAngle()], {ANGLE: 0.2}, [planted.GrainAngle(0.2)], is_sheared=True),
    "tension along": Case(FIEMME, [MembraneTension(MADE, "x")], {N: 5e3}, [planted.MembraneTension(5e3, 0.0)]),
    "tension across": Case(FIEMME, [MembraneTension(MADE, "y")], {N: 5e3}, [planted.MembraneTension(0.0, 5e3)]),
    "tension, shear-flexible": Case(
        FIEMME, [MembraneTension(MADE, "both")], {N: 5e3}, [planted.MembraneTension(5e3, 5e3)], is_sheared=True
    ),
    "a frame as heavy as the board": Case(FIEMME, [SupportMass(MADE)], {FRAME: 0.3}, [planted.SupportMass(0.3)]),
    "a bed, on which rigid motions bounce, shear-flexible": Case(
        FREE, [SupportStiffness(MADE)], {BED: 2e5}, [planted.SupportStiffness(2e5)], is_sheared=True
    ),
    "tapers of a stout board, whose rotary inertia counts, shear-flexible": Case(
        STOUT, [ThicknessProfile()], tapers(0.4, -0.3), [planted.ThicknessProfile(0.4, -0.3)], is_sheared=True
    ),
    "a taper of a part": Case(
        COVERED, [ThicknessProfile(part_x=PART)], tapers(0.2, 0.0), [planted.ThicknessProfile(0.2)]
    ),
    "expected tapers, shear-flexible": Case(
        FREE,
        [ThicknessProfile(profile=tapered(0.1, 0.06))],
        {},
        [planted.ThicknessProfile(0.1, 0.06)],
        is_sheared=True,
    ),
    "an expected taper of a part": Case(
        COVERED,
        [ThicknessProfile(part_x=PART, profile=tapered(0.2, 0.0))],
        {},
        [planted.ThicknessProfile(0.2)],
    ),
    "warp, shear-flexible": Case(
        HALF_TOP, [warp(HALF_TOP)], rises(1.3e-3, 2e-3, 16e-3), [PlantedWarp(1.3e-3, 2e-3, 16e-3)], is_sheared=True
    ),
    "warp of a saddle without a twist": Case(
        replace(HALF_TOP, edges=CANTILEVER),
        [warp(HALF_TOP, ("cup", "bow"))],
        rises(1e-3, -3e-3, 0.0),
        [PlantedWarp(1e-3, -3e-3, 0.0)],
    ),
    "warp between clamps": Case(
        replace(HALF_TOP, edges=DRIVEN.edges),
        [warp(HALF_TOP)],
        rises(1.3e-3, 2e-3, 16e-3),
        [PlantedWarp(1.3e-3, 2e-3, 16e-3)],
    ),
    "warp of a tapered board": Case(
        HALF_TOP,
        [ThicknessProfile(), warp(HALF_TOP, ("cup", "bow"))],
        rises(1.3e-3, 2e-3, 0.0) | tapers(0.15, -0.1),
        [planted.ThicknessProfile(0.15, -0.1), PlantedWarp(1.3e-3, 2e-3, 0.0)],
    ),
    "a tenth of a board": weighed(FREE, (0.97, 0.91), 0.1, n=(18, 24)),
    "a sensor that turns": weighed(FREE, (0.966, 0.908), 0.012, is_turning=True, n=(18, 24)),
    # A heavier point would sink in without limit on finer meshes, in both computations.
    "a point on a shear-flexible plate": weighed(FIEMME, (0.35, 0.3), 0.01, is_sheared=True),
    "a sensor in the air": weighed(
        FREE_FINNISH,
        (0.86, 0.34),
        0.07,
        beside=(air(FREE_FINNISH), air_values(1.2, 0.0), planted.FluidLoading(1.2, 0.0)),
        n=(16, 22),
    ),
    "a sensor on a board whose frame moves": weighed(
        FIEMME,
        (0.86, 0.34),
        0.02,
        beside=(SupportMass(MADE), {FRAME: 2.0}, planted.SupportMass(2.0)),
        n=(16, 22),
    ),
    "an exciter": driven(38.6, n=(14,)),
    "an exciter, shear-flexible": driven(12.0, n=(12,), is_sheared=True),
}


@pytest.mark.parametrize("name", CASES)
def test_frequencies_are_those_of_the_generator(name):
    """The meshes are within 0.15 to 0.3 cents of converged; where D_y falls as E_x grows 0.4 come on top."""
    case = CASES[name]
    apart = hertz_apart(case.plate, case.effects, case.values, case.planted, case.n_modes, case.is_sheared, case.n)
    assert apart == pytest.approx(0.0, abs=case.cents)


SEVERAL = [name for name, case in CASES.items() if len(case.effects) > 1]


@pytest.mark.parametrize("name", SEVERAL)
def test_each_of_several_effects_matters(name):
    """The control: without any one of them the frequencies are not the same."""
    case = CASES[name]
    together = hertz(case.plate, case.effects, case.values, case.n_modes)
    for left_out in case.effects:
        others = [one for one in case.effects if one is not left_out]
        apart = 1200 * np.log2(hertz(case.plate, others, case.values, case.n_modes) / together)
        assert np.abs(apart).max() > 5.0, left_out.name


def test_the_part_of_the_other_modulus_in_the_stiffness_along_the_grain_stays():
    """Modes that bend along the grain; with nu_xy = 0.9 nu_xy^2 D_y is 4 % of D_x, and of the shift."""
    stout = replace(FINNISH, nu_xy=0.9)
    apart = hertz_apart(stout, [StiffnessGradient()], {STIFFNESS: 0.3}, [planted.StiffnessGradient(0.3)], 3)
    assert apart[[0, 2]] == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("kind", "name", "cents"), [(ClampRotation, TURN, 0.1), (ClampTranslation, SINK, 0.12)])
def test_clamps_of_no_compliance_are_ideal(kind, name, cents):
    """What is left by `STIFFEST` is a hundredth of the shift at k_R L / D = 1000, 3.5 cents, or a few times that."""
    ratio = hertz(FINNISH, [clamp(kind, FINNISH)], {name: 0.0}, 6) / hertz(FINNISH, [], {}, 6)
    assert 1200 * np.log2(ratio) == pytest.approx(0.0, abs=cents)
