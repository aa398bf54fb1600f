"""Grain angle: a quarter turn, the generator, Mascia and Lahr's numbers, and where a first-order column fails."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
from effect_plates import MADE, SHEAR, hertz, hertz_apart, modes_of, setup_of, shifts, values_of
from generator.known_boards import BEAMS, FINNISH, FREE
from made_boards import board_of

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.effects.attached_items import Item
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.effects.grain_angle import GrainAngle
from bayesplate.effects.transverse_shear import TransverseShear
from bayesplate.frequencies.system import System
from bayesplate.plate.naming import find

ANGLE = "grain_angle.angle"
EXACT = [-17.6, 4.9, -8.9, -7.2, 4.5, -6.5]
FIRST_ORDER = [-4.7, 23.0, -4.6, 12.0, 10.0, 20.0]
"""physics.md 4, at 3 degrees on the cantilever."""


@pytest.mark.parametrize(
    ("plate", "is_sheared"),
    [(FINNISH, True), (FREE, False)],
    ids=["cantilever, shear-flexible", "free"],
)
def test_against_the_generator(plate, is_sheared):
    angle = np.radians(12.0)
    independent = generator.effects.GrainAngle(angle)
    apart = hertz_apart(plate, [GrainAngle()], {ANGLE: angle}, [independent], 6, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


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


def test_sizes_on_the_papers_cantilever():
    moved = shifts(FINNISH, [GrainAngle()], {ANGLE: np.radians(3.0)}, BEAMS["cantilever"])
    assert moved == pytest.approx(EXACT, abs=0.06)


def test_first_order_use_fails():
    """The energies of the unturned modes under the turned weights: another answer, with wrong signs."""
    system, values = System(setup_of(FINNISH), (GrainAngle(),)), values_of(FINNISH, {ANGLE: 0.0})
    turned = {**values, ANGLE: np.asarray(np.radians(3.0))}
    found = find(system.plate(values), system.weights(values).at(0), BEAMS["cantilever"])
    weights = system.weights(turned).stiffness[0]
    column = np.array([600 * np.log2(found[b].stiffness @ weights / found[b].eigenvalue) for b in BEAMS["cantilever"]])

    assert column == pytest.approx(FIRST_ORDER, abs=0.6)
    assert np.abs(column - EXACT).max() > 20.0


def test_the_sign_of_the_angle_is_not_seen():
    up, down = (modes_of(FREE, [GrainAngle()], {ANGLE: a}, 6).eigenvalues for a in (0.08, -0.08))
    np.testing.assert_allclose(up, down, rtol=1e-8)
    assert GrainAngle().parameters()[0].prior.lower == 0.0


def test_a_material_alike_both_ways_has_no_grain():
    isotropic = replace(FINNISH, E_y=FINNISH.E_x, nu_xy=0.3, G_xy=FINNISH.E_x / 2.6)
    assert shifts(isotropic, [GrainAngle()], {ANGLE: 0.5}, BEAMS["cantilever"]) == pytest.approx(0.0, abs=1e-3)


CORNER, MIRRORED, MIDDLE = (0.97, 0.91), (0.97, 0.09), (0.97, 0.5)


def test_a_thing_at_a_corner_tells_the_sign():
    """The other sign is the same board with the thing at the mirrored corner."""
    at = {place: AttachedMass(MADE, (Item(Quantity.exact(3e-3), "", (place,)),)) for place in (CORNER, MIRRORED)}
    turned, other, mirrored = (
        hertz(FREE, [GrainAngle(), at[place]], {ANGLE: np.radians(degrees), "attached_mass.mass": 3e-3}, 8)
        for place, degrees in ((CORNER, 3.0), (CORNER, -3.0), (MIRRORED, 3.0))
    )
    assert np.abs(1200 * np.log2(turned / other)).max() > 30.0
    assert other == pytest.approx(mirrored, rel=1e-6)


@pytest.mark.parametrize("degrees", [1.0, 5.0])
def test_an_angle_away_from_y_is_the_other_sign(degrees):
    corner = AttachedMass(MADE, (Item(Quantity.exact(3e-3), "", (CORNER,)),))
    (away,) = (one.name for one in GrainAngle(sign=-1).parameters())
    angle, mass = np.radians(degrees), {"attached_mass.mass": 3e-3}
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
        (CORNER, ("grain_angle",), {}, False),
        (CORNER, ("attached_mass",), {}, False),
        (MIDDLE, ("grain_angle", "attached_mass"), {"x0": "clamped", "y0": "clamped"}, True),
    ],
)
def test_it_is_said_where_the_sign_counts(place, effects, edges, is_told):
    item = AttachedItem("weight", ((place[0] * FREE.L_x, place[1] * FREE.L_y),), Quantity.exact(3e-3))
    setup = replace(setup_of(replace(FREE, edges=FREE.edges | edges)), attached=(item,))
    board = replace(board_of(FREE, [setup]), effects=effects)
    assert any("sign of the grain angle" in one for one in GrainAngle.notes(board)) is is_told
