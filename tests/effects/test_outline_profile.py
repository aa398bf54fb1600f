"""Outline profile: rectangles inside rectangles, the generator's true outlines, and the board's mass."""

from __future__ import annotations

from dataclasses import dataclass, replace

import generator.effects
import numpy as np
import pytest
import ritz
from effect_plates import hertz, hertz_apart, posed, setup_of, values_of
from generator.known_boards import FIEMME, FINNISH, FREE
from generator.plate import FINE_SHEAR
from generator.plate import solve as solve_generator
from made_boards import board_of

from bayesplate.effects.outline_profile import OutlineProfile
from bayesplate.effects.stations import Stations
from bayesplate.effects.thickness_profile import ThicknessProfile
from bayesplate.plate.parameter import BOARD
from bayesplate.posterior.laplace import worst_cents
from bayesplate.quantities import Quantity

BENT = ((0.0, 0.3, 0.6, 1.0), (0.97, 1.02, 1.01, 1.0))
CUT = ((0.0, 0.25, 0.5, 0.75, 1.0), (1.0, 1.0, 1.0, 0.972, 0.899))
"""Relative widths at fractions of the length; the second as measured on a free board."""


def outline(plate, stations, widths):
    ends = plate.edges["y0"], plate.edges["y1"]
    return OutlineProfile(BOARD, ends, stations=Stations(stations, (0.0,) * len(stations), widths))


def independent(plate, stations, widths):
    return generator.effects.OutlineProfile(
        tuple(s * plate.L_x for s in stations), tuple(w * plate.L_y for w in widths)
    )


PROFILES = {"taper": ((0.0, 1.0), (1.01, 0.99)), "bent": BENT, "cut": CUT}
PLATES = {"cantilever": FINNISH, "free": FREE}
QUICK = {("cantilever", "cut"), ("free", "bent")}
CASES = [
    pytest.param(
        PLATES[plate],
        PROFILES[profile],
        is_sheared,
        id=f"{plate}-{profile}-{'shear-flexible' if is_sheared else 'thin'}",
        marks=pytest.mark.slow if is_sheared and (plate, profile) not in QUICK else (),
    )
    for plate in PLATES
    for profile in PROFILES
    for is_sheared in (False, True)
]


@pytest.mark.parametrize(("plate", "profile", "is_sheared"), CASES)
def test_against_the_generator(plate, profile, is_sheared):
    effect = outline(plate, *profile)
    apart = hertz_apart(plate, [effect], {}, [independent(plate, *profile)], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("plate", [FINNISH, FREE], ids=["cantilever", "free"])
def test_twelve_modes_of_a_shear_flexible_board_that_narrows(plate):
    """By 5 percent over its second half; twist at free edges asks for the generator's fine polynomials."""
    profile = ((0.0, 0.5, 1.0), (1.0, 1.0, 0.95))
    effects, planted = [outline(plate, *profile)], [independent(plate, *profile)]
    assert hertz_apart(plate, effects, {}, planted, 12, is_sheared=True, n=FINE_SHEAR) == pytest.approx(0.0, abs=0.5)


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


@pytest.mark.parametrize("plate", [FINNISH, FREE], ids=["cantilever", "free"])
@pytest.mark.parametrize("factor", [1.003, 1.03, 1.3])
def test_a_narrower_board_is_the_smaller_rectangle(plate, factor):
    """No rest of the ghost outside, and no mode of it."""
    cents = 1200 * np.log2(hertz(plate, [InAWiderRectangle(factor=factor)], {}, 8) / hertz(plate, [], {}, 8))
    assert cents == pytest.approx(0.0, abs=0.1)


def test_the_free_edge_recedes_where_the_other_is_held():
    """A board hinged along y0 is the mirror image of the one hinged along y1."""
    hinged = [replace(FREE, edges=FREE.edges | {edge: "supported"}) for edge in ("y0", "y1")]
    low, high = (hertz(plate, [outline(plate, *CUT)], {}, 6) for plate in hinged)
    np.testing.assert_allclose(low, high, rtol=1e-6)


def test_thickness_and_outline_together():
    thick = generator.effects.ThicknessProfile(0.1, 0.06)
    corners = ((0.0, 0.0, 1.0, 1.0), (0.0, 1.0, 0.0, 1.0))
    readings = tuple(1 + 0.1 * (a - 0.5) + 0.06 * (b - 0.5) for a, b in zip(*corners, strict=True))
    level = ((0.0, 0.5, 1.0), (0.98, 1.0, 0.97))  # the widest is the card's, so both count y alike
    effects = [outline(FREE, *level), ThicknessProfile(stations=Stations(*corners, readings))]
    found = hertz(FREE, effects, {}, 6)
    other = solve_generator(FREE, (thick, independent(FREE, *level)), 9).frequencies[3:]
    assert 1200 * np.log2(found / other) == pytest.approx(0.0, abs=0.5)


def test_a_given_mass_is_kept():
    setup = setup_of(FREE)
    readings = Quantity.from_readings([0.217, 0.217, 0.195], 0.0, [0.0, 0.435, 0.58])
    board = board_of(ritz.FREE_SPRUCE, [setup], length_y=readings, mass=Quantity.exact(0.25))
    values = board.nominal() | {n: v for n, v in values_of(FREE, {}).items() if n.startswith("D_")}
    adjusted = OutlineProfile.of(board, setup).adjusted(values)

    area = 0.435 * 0.217 + 0.145 * (0.217 + 0.195) / 2
    assert adjusted["density"] * area * 4.7e-3 == pytest.approx(0.25, rel=1e-3)
    assert adjusted["length_y"] == pytest.approx(0.217)


def test_refuses_what_it_cannot_do():
    setup = setup_of(FREE)
    plain = board_of(ritz.FREE_SPRUCE, [setup])
    read = board_of(ritz.FREE_SPRUCE, [setup], length_y=Quantity.from_readings([0.2, 0.21], 0, [0.0, 0.5]))
    assert "no widths at stations" in OutlineProfile.refusal(plain, setup)
    assert "a held edge is straight" in OutlineProfile.refusal(read, setup_of(FIEMME))
    assert not OutlineProfile.refusal(read, setup)
    assert (OutlineProfile.is_implied(plain), OutlineProfile.is_implied(read)) == (False, True)


@pytest.mark.parametrize("effects", [["outline_profile"], ["outline_profile", "thickness_profile", "grain_angle"]])
def test_reduced_order_model_is_exact(effects):
    assert worst_cents(posed("spruce-free-1R", effects).posterior.models) < 0.5
