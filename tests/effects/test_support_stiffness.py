"""Foundation: a shift that is known exactly, the generator, and rigid motions that stay left out."""

from __future__ import annotations

import generator.effects
import pytest
from effect_plates import MADE, hertz_apart, modes_of
from generator.known_boards import FIEMME, FINNISH, FREE

from bayesplate.effects.support_stiffness import SupportStiffness
from bayesplate.plate.setup import DEFAULT_NOISE, Setup

STIFFNESS = "support_stiffness.stiffness"
EFFECT = SupportStiffness(MADE)


@pytest.mark.parametrize("stiffness", [2e3, 2e4, 1e6])
@pytest.mark.parametrize("plate", [FINNISH, FIEMME, FREE], ids=["cantilever", "clamped", "free"])
def test_adds_k_over_rho_h_to_every_mode(plate, stiffness):
    bare, resting = (modes_of(plate, e, {STIFFNESS: stiffness}, 9).eigenvalues for e in ([], [EFFECT]))
    added = stiffness / (plate.rho * plate.h)
    assert resting - bare == pytest.approx(added, rel=1e-7)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("stiffness", [3e3, 2e4, 2e5])
@pytest.mark.parametrize("plate", [FINNISH, FREE], ids=["cantilever", "free"])
def test_against_the_generator(plate, stiffness, is_sheared):
    """A free board's rigid motions bounce, at up to 50 Hz here, and are left out as before."""
    spring = generator.effects.SupportStiffness(stiffness)
    apart = hertz_apart(plate, [EFFECT], {STIFFNESS: stiffness}, [spring], 9, is_sheared)
    assert apart == pytest.approx(0.0, abs=0.5)


def test_a_board_that_is_held_lies_on_nothing():
    free, held = ("free", "free"), ("clamped", "free")
    assert SupportStiffness.refusal(None, Setup("made", free, free, (), DEFAULT_NOISE)) == ""
    assert "an edge is held" in SupportStiffness.refusal(None, Setup("made", held, free, (), DEFAULT_NOISE))
