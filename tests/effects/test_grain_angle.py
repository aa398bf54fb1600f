"""Grain angle: a quarter turn, and the two signs."""

from __future__ import annotations

import numpy as np
import pytest
from effect_plates import MADE, SHEAR, hertz, setup_of, values_of
from generator.known_boards import FINNISH, FREE

from bayesplate.board.quantity import Quantity
from bayesplate.effects.attached_items import PlacedItem
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


def test_an_angle_away_from_y_is_the_other_sign():
    corner = AttachedMass(MADE, (PlacedItem(Quantity.exact(3e-3), "", ((0.97, 0.91),)),))
    (away,) = (one.name for one in GrainAngle(sign=-1).parameters())
    angle, mass = np.radians(5.0), {"attached_mass.mass": 3e-3}
    found = hertz(FREE, [GrainAngle(sign=-1), corner], {away: angle} | mass, 8)
    assert found == pytest.approx(hertz(FREE, [GrainAngle(), corner], {ANGLE: -angle} | mass, 8), rel=1e-12)
