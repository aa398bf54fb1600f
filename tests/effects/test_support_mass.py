"""Frame that moves: against the generator, the supported plate by hand, and the classes that cannot push a frame."""

from __future__ import annotations

from dataclasses import replace

import generator.effects
import numpy as np
import pytest
from effect_plates import ALL_SUPPORTED, MADE, hertz, hertz_apart, setup_of, shifts
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE

from bayesplate.effects.support_mass import SupportMass

MASS = "support_mass.mass"
EFFECT = SupportMass(MADE)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("mass", [8.0, 0.3])
def test_against_the_generator(mass, is_sheared):
    """Down to a frame as heavy as the board."""
    apart = hertz_apart(FIEMME, [EFFECT], {MASS: mass}, [generator.effects.SupportMass(mass)], 9, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_supported_plate_by_hand():
    """w = sin sin: (int rho h w)^2 = (8 / pi^2)^2 m of the modal mass, of which the frame leaves m / (M_f + m)."""
    plate = replace(FIEMME, edges=ALL_SUPPORTED)
    vibrating = plate.rho * plate.h * plate.L_x * plate.L_y
    ratio = hertz(plate, [EFFECT], {MASS: 20.0}, 1)[0] / hertz(plate, [], {}, 1)[0]
    assert ratio**2 - 1 == pytest.approx((8 / np.pi**2) ** 2 * vibrating / (20.0 + vibrating), rel=0.02)


def test_size_on_the_papers_clamped_board():
    """physics.md 6: at most 20 cents on (0,0) for 8 kg, less above, nothing where an order is odd."""
    found = dict(zip(BEAMS["clamped"], shifts(FIEMME, [EFFECT], {MASS: 8.0}, BEAMS["clamped"]), strict=True))
    assert 0 < found[0, 2] < found[0, 0] < 20
    assert np.array([found[b] for b in ((0, 1), (1, 0), (1, 1), (1, 2))]) == pytest.approx(0.0, abs=1e-9)


def test_refused_without_a_frame():
    assert "no frame" in SupportMass.refusal(None, setup_of(FINNISH))
    assert "no frame" in SupportMass.refusal(None, setup_of(FREE))
    assert SupportMass.refusal(None, setup_of(FIEMME)) == ""
