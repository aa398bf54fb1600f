"""Grain angle: a quarter turn, and where its sign counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_plates import MADE, SHEAR, hertz, setup_of, values_of
from generator.known_boards import FINNISH, FREE
from made_boards import board_of

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.effects.attached_items import Item
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.transverse_shear import TransverseShear
from bayesplate.frequencies.system import System

ANGLE = "grain_angle.angle"


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
def test_a_quarter_turn_swaps_the_axes(is_sheared):
    """Weights: those of the plate with the other D and nu_yx D_x = nu_xy D_y; nothing couples."""
    effects = (TransverseShear(),) if is_sheared else ()
    own = {**values_of(FINNISH, SHEAR), ANGLE: np.asarray(np.pi / 2)}
    swapped = {**own, "D_x": own["D_y"], "D_y": own["D_x"], "poisson_xy": own["poisson_xy"] * own["D_y"] / own["D_x"]}
    names = ["transverse_shear.G_xz", "transverse_shear.G_yz"]
    swapped |= dict(zip(names, [own[n] for n in reversed(names)], strict=True))
    turned = System(setup_of(FINNISH), (*effects, GrainAngle())).weights(own).stiffness[0]
    expected = System(setup_of(FINNISH), effects).weights(swapped).stiffness[0]
    np.testing.assert_allclose(turned[: expected.size], expected, rtol=1e-12)
    np.testing.assert_allclose(turned[expected.size :] / expected.max(), 0.0, atol=1e-14)


CORNER, MIRRORED, MIDDLE = (0.97, 0.91), (0.97, 0.09), (0.97, 0.5)


def test_an_angle_away_from_y_is_the_other_sign():
    corner = AttachedMass(MADE, (Item(Quantity.exact(3e-3), "", (CORNER,)),))
    (away,) = (one.name for one in GrainAngle(sign=-1).parameters())
    angle, mass = np.radians(5.0), {"attached_mass.mass": 3e-3}
    found = hertz(FREE, [GrainAngle(sign=-1), corner], {away: angle} | mass, 8)
    assert found == pytest.approx(hertz(FREE, [GrainAngle(), corner], {ANGLE: -angle} | mass, 8), rel=1e-12)


BOTH = ["from x towards y", "from x away from y"]


@pytest.mark.parametrize(
    ("place", "edges", "details"),
    [(CORNER, {}, BOTH), (MIDDLE, {}, [""]), (MIDDLE, {"x0": "clamped", "y0": "clamped"}, BOTH)],
)
def test_both_signs_are_tried_where_they_are_two_boards(place, edges, details):
    """A taper that nothing was read of may as well be the mirrored one."""
    item = AttachedItem("weight", ((place[0] * FREE.L_x, place[1] * FREE.L_y),), Quantity.exact(3e-3))
    setup = replace(setup_of(replace(FREE, edges=FREE.edges | edges)), attached=(item,))
    board = replace(board_of(FREE, [setup]), effects=("attached_mass", "thickness_profile"))
    found = GrainAngle.forms(board)
    assert [one.detail for one in found] == details
    fitted = replace(board, effects=(*board.effects, "grain_angle"), chosen=found[-1].effects)
    assert GrainAngle.notes(fitted) == ()


@pytest.mark.parametrize(("card", "details"), [("spruce-free-1R", BOTH), ("fiemme-spruce-clamped", [""])])
def test_a_thickness_that_was_read_at_places_tells_the_sign(card, details):
    """Of 1R the readings say that it varies; without its profile both signs ring alike."""
    assert [one.detail for one in GrainAngle.forms(prepare(card).board)] == details
    assert [one.detail for one in GrainAngle.forms(prepare(card, []).board)] == [""]


@pytest.mark.parametrize(
    ("place", "effects", "edges", "is_told"),
    [
        (CORNER, ("grain_angle", "attached_mass"), {}, True),
        (MIDDLE, ("grain_angle", "attached_mass"), {}, False),
        (CORNER, ("attached_mass",), {}, False),
    ],
)
def test_it_is_said_where_the_sign_counts(place, effects, edges, is_told):
    item = AttachedItem("weight", ((place[0] * FREE.L_x, place[1] * FREE.L_y),), Quantity.exact(3e-3))
    setup = replace(setup_of(replace(FREE, edges=FREE.edges | edges)), attached=(item,))
    board = replace(board_of(FREE, [setup]), effects=effects)
    assert any("sign of the grain angle" in one for one in GrainAngle.notes(board)) is is_told
