"""Outline profile: rectangles inside rectangles, the generator's true outlines, and the board's mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import generator.effects
import made_boards
import numpy as np
import pytest
import ritz
from effect_plates import MADE, hertz, hertz_apart, modes_of, setup_of, tapered, values_of
from generator.known_boards import FINNISH, FREE
from generator.plate import solve as solve_generator
from made_boards import board_of

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import board_density, vibrating_lengths
from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import Surface
from bayesplate.effects.attached_items import PlacedItem
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.field_components import FieldProfile
from bayesplate.effects.fluid_loading import FluidLoading
from bayesplate.effects.membrane_tension import MembraneTension
from bayesplate.effects.outline_profile import OutlineProfile
from bayesplate.effects.support_mass import SupportMass
from bayesplate.effects.support_stiffness import SupportStiffness
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.frequencies.residues import residues_of

BENT = ((0.0, 0.3, 0.6, 1.0), (0.97, 1.02, 1.01, 1.0))
CUT = ((0.0, 0.25, 0.5, 0.75, 1.0), (1.0, 1.0, 1.0, 0.972, 0.899))
"""Relative widths at fractions of the length; the second as measured on a free board."""
FINELY = np.linspace(0.0, 1.0, 41)
DEGREES = tuple((k, 0) for k in range(1, 5))


def course(stations, widths):
    """The polynomial through widths, over its mean."""
    powers = np.polynomial.Legendre.fit(stations, widths, len(stations) - 1, domain=[0.0, 1.0]).coef
    relative = powers[1:] / powers[0] / np.sqrt(2.0 * np.arange(1, powers.size) + 1.0)
    return Surface(DEGREES, tuple(np.pad(relative, (0, len(DEGREES) - relative.size))))


def outline(plate, stations, widths, components=(), mean=1.0):
    ends = plate.edges["y0"], plate.edges["y1"]
    return OutlineProfile(
        BOARD_OWNER, ends, profile=FieldProfile(course(stations, widths), None, components, mean, 0.0)
    )


def independent(plate, stations, widths, steps=()):
    """Straight between many stations; `steps` are surfaces that the width gains, over its mean."""
    relative = 1.0 + sum(one(FINELY, np.full_like(FINELY, 0.5)) for one in (course(stations, widths), *steps))
    return generator.effects.OutlineProfile(tuple(FINELY * plate.L_x), tuple(relative * plate.L_y))


LEVEL = ((0.0, 0.5, 1.0), (0.98, 1.0, 0.97))
TAPERED = ThicknessProfile(profile=tapered(0.1, 0.06)), generator.effects.ThicknessProfile(0.1, 0.06)
"""The same tapers in the package and in the generator."""


@pytest.mark.parametrize(
    ("plate", "profile", "further", "is_sheared"),
    [
        pytest.param(FINNISH, CUT, (), False, id="cantilever"),
        pytest.param(FREE, BENT, (), False, id="free"),
        pytest.param(FREE, LEVEL, (TAPERED,), False, id="free-tapered"),
        pytest.param(FREE, CUT, (), True, id="free-cut-shear-flexible", marks=pytest.mark.slow),
    ],
)
def test_against_the_generator(plate, profile, further, is_sheared):
    effects = [outline(plate, *profile), *(one for one, _ in further)]
    planted = [*(one for _, one in further), independent(plate, *profile)]
    assert hertz_apart(plate, effects, {}, planted, 6, is_sheared) == pytest.approx(0.0, abs=0.5)


@dataclass(frozen=True)
class InAWiderRectangle(OutlineProfile):
    """The board's own width everywhere, cut out of a rectangle so many times as wide."""

    factor: float = 1.0

    def adjusted(self, values):
        return {**values, "length_y": values["length_y"] * self.factor}

    def keeps_symmetry(self):
        return False, False

    def outline(self):
        return lambda x: (np.zeros_like(x), np.full_like(x, 1.0 / self.factor))


BRIDGE = replace(FREE, edges=FREE.edges | {"x0": "clamped", "x1": "clamped"})
AIR = FluidLoading(MADE, FREE.L_x / FREE.L_y)


def air_values(baffle):
    return {"fluid_loading.density": 1.2, "fluid_loading.baffle": baffle}


TERMS = {
    "nothing, and no rest or mode of the ghost outside": (FREE, None, {}),
    "foundation": (FREE, SupportStiffness(MADE), {"support_stiffness.stiffness": 2e4}),
    "tension": (BRIDGE, MembraneTension(MADE, "x"), {"membrane_tension.N": 500.0}),
    "frame": (BRIDGE, SupportMass(MADE), {"support_mass.mass": 1.0}),
    "open air": (FREE, AIR, air_values(0.0)),
    "wall": (FREE, AIR, air_values(1.0)),
}


@pytest.mark.parametrize(("plate", "effect", "values"), TERMS.values(), ids=TERMS)
def test_what_other_effects_add_ends_with_the_board(plate, effect, values):
    """A rectangle cut out of a wider one has the foundation, the tension, the frame and the air of its own width."""
    effects = [effect] if effect else []
    cut = hertz(plate, [InAWiderRectangle(factor=1.3), *effects], values, 8)
    cents = 1200 * np.log2(cut / hertz(plate, effects, values, 8))
    assert cents == pytest.approx(0.0, abs=0.1)


OF_AIR = {
    0.0: (-27.0, -40.8, -24.4, -26.3, -22.7, -38.6, -24.3, -20.9),
    1.0: (-40.0, -56.3, -34.3, -30.0, -29.2, -44.1),
}
"""Cents by the baffle's share, once computed: polynomials on panels whose middles lie within the outline, 30 across,
extrapolated from those and 18 to panels without end, which leaves half a cent."""


def test_air_of_a_board_that_narrows():
    """By a quarter of its width."""
    narrow = outline(FREE, (0.0, 0.2 / 0.58, 0.75, 1.0), (1.0, 0.99, 0.9, 0.74))
    for baffle, expected in OF_AIR.items():
        wet, dry = (hertz(FREE, effects, air_values(baffle), len(expected)) for effects in ([narrow, AIR], [narrow]))
        assert 1200 * np.log2(wet / dry) == pytest.approx(np.array(expected), abs=1.0)


STEP = Surface(DEGREES, (1e-3, -2e-3, 1.5e-3, -1e-3))
"""As large as the largest component of a measured board, and as crooked."""


@pytest.mark.parametrize(
    ("plate", "is_sheared"),
    [(FINNISH, False), pytest.param(FREE, True, marks=pytest.mark.slow)],
    ids=["cantilever", "free and shear-flexible"],
)
def test_what_is_open_to_first_order_against_the_generator(plate, is_sheared):
    """At two standard deviations an eighth of the shift is missed at most, a cent."""
    steps = 2.0  # as many of them make the generator's outline
    effect = outline(plate, *CUT, components=(STEP,))
    moved = [independent(plate, *CUT, steps=[STEP] * 2)]
    found, ignored = (
        hertz_apart(plate, [effect], {"outline_profile.field_1": at}, moved, 6, is_sheared) for at in (steps, 0.0)
    )
    assert np.abs(found).max() < 1.0
    assert np.abs(found).max() < np.abs(ignored).max() / 8.0
    assert np.abs(ignored).max() > 5.0


def test_no_step_leaves_the_edge_weighing_less_than_nothing():
    """A posterior may go where its prior hardly does: frequencies stay what they are there."""
    effect = outline(FREE, *CUT, components=(STEP,))
    far = {at: hertz(FREE, [effect], {"outline_profile.field_1": at}, 6) for at in (-20.0, -2.94, 2.94, 20.0)}
    assert far[-20.0] == pytest.approx(far[-2.94], rel=1e-9)
    assert far[20.0] == pytest.approx(far[2.94], rel=1e-9)
    cents = 1200 * np.log2(far[-20.0] / hertz(FREE, [outline(FREE, *CUT)], {}, 6))
    assert 1.0 < np.abs(cents).max() < 20.0


def test_a_given_mass_is_kept():
    setup = setup_of(FREE)
    readings = Quantity.from_readings([0.217, 0.217, 0.195], 0.001, [0.0, 0.435, 0.58])
    board = board_of(ritz.FREE_SPRUCE, [setup], length_y=readings, mass=Quantity.exact(0.25))
    values = board.nominal() | {n: v for n, v in values_of(FREE, {}).items() if n.startswith("D_")}
    effect = OutlineProfile.of(board, setup)
    at = (np.arange(500) + 0.5) / 500
    low, high = effect.outline()(at)

    adjusted = effect.adjusted(values)
    area = 0.58 * float(adjusted["length_y"]) * np.mean(high - low)
    assert board_density(adjusted) * area * 4.7e-3 == pytest.approx(0.25, rel=1e-4)
    assert (high - low).max() == pytest.approx(1.0, abs=1e-6)
    assert 0.205 < float(values["length_y"]) < float(adjusted["length_y"])


def test_components_of_the_thickness_leave_nothing_negative_outside_the_outline():
    """What is left of the plate there has the weight of what is expected: a negative mass has modes of its own."""
    steps = -2.0
    surfaces = [Surface(((i, j),), (0.01,)) for i, j in ((1, 0), (0, 1), (1, 1))]
    open_field = ThicknessProfile(profile=FieldProfile(Surface(((1, 0),), (0.0,)), None, tuple(surfaces), FREE.h, 0.0))
    effects = [outline(FREE, (0.0, 0.5, 1.0), (0.6, 1.0, 0.6)), open_field]  # whole elements lie outside
    components = {one.name: steps for one in open_field.parameters()}
    assert len(components) == 3
    away, there = (hertz(FREE, effects, values, 6) for values in (components, dict.fromkeys(components, 0.0)))
    assert 1200 * np.log2(away / there) == pytest.approx(0.0, abs=200.0)


def test_a_clamp_along_the_straight_edge_covers_as_much_everywhere():
    """What is left beside it narrows by as many millimetres as the board."""
    setup = made_boards.setup_of(ritz.ALL_FREE | {"y0": "clamped"}, {(2, 2): 1.0}, clamped={"y0": Quantity.exact(0.06)})
    readings = Quantity.from_readings([0.217, 0.211, 0.195], 0.001, [0.0, 0.3, 0.58])
    board = board_of(ritz.FREE_SPRUCE, [setup], length_y=readings)
    effect, at = OutlineProfile.of(board, setup), np.linspace(0.0, 1.0, 41)
    values = effect.adjusted(board.nominal())
    low, high = effect.limits(at)

    width = board.inputs["length_y"].mean * (1.0 + effect.profile.expected(at, np.full_like(at, 0.5)))
    assert high * vibrating_lengths(values, setup)[1] == pytest.approx(width - 0.06, rel=1e-3)
    assert low == pytest.approx(0.0)


WEDGE = ((0.0, 0.5, 1.0), (1.02, 1.0, 0.84))


def test_a_thing_stands_where_it_was_measured_from_the_corner():
    """At its rim where the board narrows: on what is left of the rectangle there it would have a mode of its own."""
    place = 0.97, 0.02  # as fractions of the nominal sides
    mass, item = 3e-3, PlacedItem(Quantity.exact(3e-3), "", (place,))
    effect, planted = outline(FREE, *WEDGE), independent(FREE, *WEDGE)
    widths = np.array(planted.widths)
    widest, at = widths.max(), np.interp(place[0] * FREE.L_x, planted.stations, widths)
    y = np.clip(0.5 * (widest - widths[0]) + place[1] * FREE.L_y, 0.5 * (widest - at), 0.5 * (widest + at))
    heavy = generator.effects.AttachedMass(mass, ((place[0] * FREE.L_x, y),))

    effects, values = [effect, AttachedMass(MADE, (item,))], {"attached_mass.mass": mass}
    apart = hertz_apart(FREE, effects, values, [planted, heavy], 6, n=(10, 15))
    assert apart == pytest.approx(0.0, abs=0.5)


def test_a_thing_beside_the_board_tilts_with_its_rim():
    """With a base as wide as what is missing there."""
    narrow, mass = outline(FREE, *WEDGE), {"attached_mass.mass": 3e-3}
    items = (PlacedItem(Quantity.exact(3e-3), "", ((0.97, 0.02),), radius) for radius in ((0.0, 0.0), (0.01, 0.08)))
    point, tilting = (hertz(FREE, [narrow, AttachedMass(MADE, (one,))], mass, 6) for one in items)
    assert np.all(np.abs(1200 * np.log2(tilting / point)) < 10.0)


def test_residues_are_those_of_the_places_on_the_outline():
    """Over the largest deflection on the board, not on what is left of the rectangle around it."""
    sensor = AttachedItem("accelerometer", ((0.97 * FREE.L_x, 0.9 * FREE.L_y),))
    setup = replace(setup_of(FREE), hammer=(0.03 * FREE.L_x, 0.1 * FREE.L_y), attached=(sensor,))
    effect, planted = outline(FREE, *WEDGE), independent(FREE, *WEDGE)
    found = residues_of(setup, modes_of(FREE, [effect], {}, 6), values_of(FREE, {}), effect)

    modes = solve_generator(FREE, (planted,), 9)
    widest = max(planted.widths)
    x, share = (one.ravel() for one in np.meshgrid(np.linspace(0.0, FREE.L_x, 41), np.linspace(-0.5, 0.5, 41)))
    everywhere = modes.basis.deflection(x, 0.5 * widest + share * np.interp(x, planted.stations, planted.widths))
    corner = 0.5 * (widest - planted.widths[0])
    y = corner + np.array([0.1, 0.9]) * FREE.L_y
    both = modes.basis.deflection(np.array([0.03, 0.97]) * FREE.L_x, y) @ modes.vectors
    expected = both[0] * both[1] / np.abs(everywhere @ modes.vectors).max(axis=0) ** 2
    assert found == pytest.approx(expected[3:], abs=0.01)
