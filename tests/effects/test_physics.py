"""Every effect on a plate: the frequencies of the generator, which has another discretisation and other formulas."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import generator.effects as planted
import numpy as np
import pytest
from effect_plates import ALL_SUPPORTED, MADE, hertz, hertz_apart, setup_of, tapered
from generator.designs import ALL_FREE, CANTILEVER
from generator.effects import NoEffect
from generator.exciter import Exciter as PlantedExciter
from generator.known_boards import DRIVEN, FIEMME, FINNISH, FREE, HALF_TOP
from generator.plate import Plate
from generator.warp import Warp as PlantedWarp

from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.quantity import Quantity
from bayesplate.effects import Effect
from bayesplate.effects.attached_items import PlacedItem, base_diameter
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.clamp_rotation import LEAST_COMPLIANCE as STIFFEST_TURN
from bayesplate.effects.clamp_rotation import ClampRotation
from bayesplate.effects.clamp_translation import LEAST_COMPLIANCE as STIFFEST_SINK
from bayesplate.effects.clamp_translation import ClampTranslation
from bayesplate.effects.density_gradient import DensityGradient
from bayesplate.effects.drives import Drive
from bayesplate.effects.exciter import Exciter
from bayesplate.effects.fluid_loading import FluidLoading
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.membrane_tension import Axis, MembraneTension
from bayesplate.effects.part import WHOLE_SIDE, VibratingPart
from bayesplate.effects.stiffness_gradient import StiffnessGradient
from bayesplate.effects.support_mass import SupportMass
from bayesplate.effects.support_stiffness import SupportStiffness
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.effects.warp import Warp

PLAIN = replace(FINNISH, nu_xy=0.0)
"""Without a Poisson ratio E_x is in D_x alone, as the package has it."""
STOUT = replace(FREE, h=0.02)
COVERED, PART = replace(FINNISH, covered=0.03, whole=0.253), VibratingPart(0.03 / 0.253, 0.223 / 0.253)
FREE_FINNISH = replace(FINNISH, L_x=0.253, edges=ALL_FREE)
ALONG_X = replace(FINNISH, edges={"x0": "free", "x1": "free", "y0": "clamped", "y1": "free"})
LONG_SADDLE = replace(HALF_TOP, edges=CANTILEVER)
HELD_DOME = replace(HALF_TOP, edges=DRIVEN.edges)
LYING_DOME = replace(HALF_TOP, edges=ALL_SUPPORTED)


@dataclass(frozen=True)
class Acting:
    """An effect with the values of its parameters, and what the generator has for it."""

    effect: Effect
    values: Mapping[str, float]
    planted: NoEffect


def turning(plate: Plate, compliance: float) -> Acting:
    """All edges share k_R, which the compliance gives with the D and L along x where an edge across x is clamped."""
    D, L = (plate.D_x, plate.L_x) if plate.edges["x0"] == "clamped" else (plate.D_y, plate.L_y)
    effect = ClampRotation.of(None, setup_of(plate))
    other = planted.ClampRotation(D / ((compliance + STIFFEST_TURN) * L))
    return Acting(effect, {"clamp_rotation.compliance": compliance}, other)


def sinking(plate: Plate, compliance: float) -> Acting:
    effect = ClampTranslation.of(None, setup_of(plate))
    other = planted.ClampTranslation(plate.D_x / ((compliance + STIFFEST_SINK) * plate.L_x**3))
    return Acting(effect, {"clamp_translation.compliance": compliance}, other)


def denser(gradient: float, part: VibratingPart = WHOLE_SIDE) -> Acting:
    values = {"density_gradient.gradient": gradient}
    return Acting(DensityGradient(part=part), values, planted.DensityGradient(gradient))


def stiffer(gradient: float, part: VibratingPart = WHOLE_SIDE) -> Acting:
    values = {"stiffness_gradient.gradient": gradient}
    return Acting(StiffnessGradient(part=part), values, planted.StiffnessGradient(gradient))


def turned(angle: float) -> Acting:
    return Acting(GrainAngle(), {"grain_angle.angle": angle}, planted.GrainAngle(angle))


def thicker(x: float, y: float, part: VibratingPart = WHOLE_SIDE) -> Acting:
    values = {"thickness_profile.taper_x": x, "thickness_profile.taper_y": y}
    return Acting(ThicknessProfile(part_x=part), values, planted.ThicknessProfile(x, y))


def read(x: float, y: float, part: VibratingPart = WHOLE_SIDE) -> Acting:
    """Tapers that readings leave no doubt of."""
    return Acting(ThicknessProfile(part_x=part, profile=tapered(x, y)), {}, planted.ThicknessProfile(x, y))


def wet(plate: Plate, density: float, baffle: float) -> Acting:
    values = {"fluid_loading.density": density, "fluid_loading.baffle": baffle}
    return Acting(FluidLoading(MADE, plate.L_x / plate.L_y), values, planted.FluidLoading(density, baffle))


def stretched(axis: Axis, tension: float) -> Acting:
    along = (tension * (axis != "y"), tension * (axis != "x"))
    return Acting(MembraneTension(MADE, axis), {"membrane_tension.N": tension}, planted.MembraneTension(*along))


def framed(mass: float) -> Acting:
    return Acting(SupportMass(MADE), {"support_mass.mass": mass}, planted.SupportMass(mass))


def bedded(stiffness: float) -> Acting:
    values = {"support_stiffness.stiffness": stiffness}
    return Acting(SupportStiffness(MADE), values, planted.SupportStiffness(stiffness))


def warped(plate: Plate, **rises: float) -> Acting:
    known = tuple((name, Quantity.exact(1.0), "") for name in rises)
    values = {f"warp.{name}": rise for name, rise in rises.items()}
    return Acting(Warp(BOARD_OWNER, known, plate.L_x / plate.L_y), values, PlantedWarp(**rises))


def loaded(plate: Plate, place: tuple[float, float], share: float, *, is_turning: bool = False) -> Acting:
    """A thing of a share of the board's mass at a place, fractions of the sides."""
    mass = share * plate.rho * plate.h * plate.L_x * plate.L_y
    diameter = float(base_diameter(mass)) if is_turning else 0.0
    item = PlacedItem(Quantity.exact(1e-3), "", (place,), (0.5 * diameter / plate.L_x, 0.5 * diameter / plate.L_y))
    at = ((place[0] * plate.L_x, place[1] * plate.L_y),)
    other = planted.AttachedMass(mass, at, diameter * np.sqrt(1 / 16 + 1 / 3))
    return Acting(AttachedMass(MADE, (item,)), {"attached_mass.mass": mass}, other)


def driven(resonance: float) -> Acting:
    """A weak drive: polynomials converge slowly on a point."""
    mass, coil, setup = 5e-3, 0.6e-3, setup_of(DRIVEN)
    drive = Drive(*((Quantity.exact(one), "") for one in (mass, coil, resonance)), True, False, ((0.25, 0.25),))
    values = {"exciter.mass": mass, "exciter.coil": coil, "exciter.resonance": resonance}
    at = ((0.25 * DRIVEN.L_x, 0.25 * DRIVEN.L_y),)
    other = PlantedExciter.at_resonance(resonance, mass, at, coil_mass=coil)
    return Acting(Exciter(MADE, (drive,), setup.ends_x, setup.ends_y, (1, 2)), values, other)


@dataclass(frozen=True)
class Case:
    """A plate and what acts on it; a theory, and cents by which package and generator may differ.

    `n` are polynomials of the generator along each side, see `hertz_apart`.
    """

    plate: Plate
    acting: Sequence[Acting]
    is_sheared: bool = False
    cents: float = 0.5
    n: Sequence[int] = ()
    n_modes: int = 6

    @property
    def values(self) -> dict[str, float]:
        return {name: value for one in self.acting for name, value in one.values.items()}

    @property
    def apart(self) -> np.ndarray:
        """Cents between the two."""
        effects, others = ([getattr(one, part) for one in self.acting] for part in ("effect", "planted"))
        return hertz_apart(self.plate, effects, self.values, others, self.n_modes, self.is_sheared, self.n)

    def hertz(self, left_out: Acting | None = None) -> np.ndarray:
        """The package's frequencies, on a thin plate, with all effects but one."""
        effects = [one.effect for one in self.acting if one is not left_out]
        return hertz(self.plate, effects, self.values, self.n_modes)


DOME = {"cup": 1.3e-3, "bow": 2e-3, "twist": 16e-3}
CASES = {
    "clamps that turn": Case(FIEMME, [turning(FIEMME, 1 / 3)]),
    "a clamp along x takes the sides of y": Case(ALONG_X, [turning(ALONG_X, 0.05)]),
    "clamps that give way": Case(FIEMME, [sinking(FIEMME, 1e-2)]),
    "a clamp that gives way, sheared": Case(FINNISH, [sinking(FINNISH, 1e-3)], is_sheared=True),
    "a clamp that does both, sheared": Case(
        FINNISH, [turning(FINNISH, 1 / 30), sinking(FINNISH, 1e-4)], is_sheared=True
    ),
    "density, sheared": Case(FREE, [denser(0.6)], is_sheared=True),
    "density of a part": Case(COVERED, [denser(0.3, PART)]),
    "stiffness of a part": Case(COVERED, [stiffer(0.2, PART)]),
    "stiffness along a turned grain, tapered": Case(PLAIN, [thicker(0.1, 0.05), stiffer(0.6), turned(0.1)], cents=0.1),
    "stiffness along a turned grain, sheared": Case(PLAIN, [stiffer(0.6), turned(0.1)], is_sheared=True, cents=0.2),
    "grain, sheared": Case(FINNISH, [turned(0.2)], is_sheared=True),
    "air in half a wall": Case(FIEMME, [wet(FIEMME, 1.2, 0.4)]),
    "air in a wall, heavier than the board": Case(FREE, [wet(FREE, 6.0, 1.0)]),
    "open air, sheared": Case(FIEMME, [wet(FIEMME, 1.2, 0.0)], is_sheared=True),
    "tension along": Case(FIEMME, [stretched("x", 5e3)]),
    "tension across": Case(FIEMME, [stretched("y", 5e3)]),
    "tension, sheared": Case(FIEMME, [stretched("both", 5e3)], is_sheared=True),
    "a frame as heavy as the board": Case(FIEMME, [framed(0.3)]),
    "a bed, on which rigid motions bounce, sheared": Case(FREE, [bedded(2e5)], is_sheared=True),
    "tapers of a stout board, whose rotary inertia counts, sheared": Case(STOUT, [thicker(0.4, -0.3)], is_sheared=True),
    "a taper of a part": Case(COVERED, [thicker(0.2, 0.0, PART)]),
    "read tapers, sheared": Case(FREE, [read(0.1, 0.06)], is_sheared=True),
    "a read taper of a part": Case(COVERED, [read(0.2, 0.0, PART)]),
    "warp, sheared": Case(HALF_TOP, [warped(HALF_TOP, **DOME)], is_sheared=True),
    "warp of a saddle without a twist": Case(LONG_SADDLE, [warped(LONG_SADDLE, cup=1e-3, bow=-3e-3)]),
    "warp between clamps": Case(HELD_DOME, [warped(HELD_DOME, **DOME)]),
    "warp between supports, on which it slides": Case(LYING_DOME, [warped(LYING_DOME, **DOME)]),
    "warp of a tapered board": Case(HALF_TOP, [thicker(0.15, -0.1), warped(HALF_TOP, cup=1.3e-3, bow=2e-3)]),
    "a tenth of a board": Case(FREE, [loaded(FREE, (0.97, 0.91), 0.1)], n=(18, 24)),
    "a sensor that turns": Case(FREE, [loaded(FREE, (0.966, 0.908), 0.012, is_turning=True)], n=(18, 24)),
    # A heavier point would sink in without limit on finer meshes, in both computations.
    "a point, sheared": Case(FIEMME, [loaded(FIEMME, (0.35, 0.3), 0.01)], is_sheared=True),
    "a sensor in the air": Case(
        FREE_FINNISH, [wet(FREE_FINNISH, 1.2, 0.0), loaded(FREE_FINNISH, (0.86, 0.34), 0.07)], n=(16, 22)
    ),
    "a sensor on a board whose frame moves": Case(
        FIEMME, [framed(2.0), loaded(FIEMME, (0.86, 0.34), 0.02)], n=(16, 22)
    ),
    # The magnet has a mode too.
    "an exciter": Case(DRIVEN, [driven(38.6)], n=(14,), n_modes=7),
    "an exciter, sheared": Case(DRIVEN, [driven(12.0)], n=(12,), n_modes=7, is_sheared=True),
}


@pytest.mark.parametrize("name", CASES)
def test_frequencies_are_those_of_the_generator(name):
    """The meshes are within 0.15 to 0.3 cents of converged; where D_y falls as E_x grows 0.4 come on top.

    The control: without any one of several effects the frequencies are others.
    """
    case = CASES[name]
    assert case.apart == pytest.approx(0.0, abs=case.cents)
    if len(case.acting) > 1:
        together = case.hertz()
        for one in case.acting:
            ratio = case.hertz(left_out=one) / together
            assert np.abs(1200 * np.log2(ratio)).max() > 5.0, one.effect.name


def test_the_part_of_the_other_modulus_in_the_stiffness_along_the_grain_stays():
    """Modes that bend along the grain; with nu_xy = 0.9 nu_xy^2 D_y is 4 % of D_x, and of the shift."""
    apart = Case(replace(FINNISH, nu_xy=0.9), [stiffer(0.3)], n_modes=3).apart
    assert apart[[0, 2]] == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(("clamp", "cents"), [(turning, 0.1), (sinking, 0.12)])
def test_clamps_of_no_compliance_are_ideal(clamp, cents):
    """`LEAST_COMPLIANCE` leaves a hundredth of the shift at k_R L / D = 1000, 3.5 cents, or a few times that."""
    stiff = clamp(FINNISH, 0.0)
    ratio = hertz(FINNISH, [stiff.effect], stiff.values, 6) / hertz(FINNISH, [], {}, 6)
    assert 1200 * np.log2(ratio) == pytest.approx(0.0, abs=cents)
