"""Warp: symmetry, weights, and what a card states."""

from __future__ import annotations

import numpy as np
import pytest
from effect_plates import board_with, hertz_apart, setup_of, values_of
from generator.effects import OutlineProfile as GeneratorOutline
from generator.known_boards import HALF_TOP
from generator.warp import Warp as GeneratorWarp

from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.quantity import Quantity
from bayesplate.board.random_field import Surface
from bayesplate.effects.field_components import FieldProfile
from bayesplate.effects.outline_profile import OutlineProfile
from bayesplate.effects.warp import Warp
from bayesplate.frequencies.system import System
from bayesplate.plate.membrane import CURVATURES


def warp(plate, names=CURVATURES):
    """The effect on a plate; its sizes are given with the values."""
    return Warp(BOARD_OWNER, tuple((name, Quantity.exact(1.0), "") for name in names), plate.L_x / plate.L_y)


def test_halves_stay_alike_unless_a_twist_has_a_curvature_beside_it():
    assert warp(HALF_TOP, ("cup", "bow")).keeps_symmetry() == (True, True)
    assert warp(HALF_TOP, ("twist",)).keeps_symmetry() == (True, True)
    assert warp(HALF_TOP, ("cup", "twist")).keeps_symmetry() == (False, False)


def test_quadratic_in_the_rises():
    """Twice the rise is four times the weight, for all draws at once."""
    system = System(setup_of(HALF_TOP), (warp(HALF_TOP, ("cup",)),))
    values = values_of(HALF_TOP, {"warp.cup": np.array([1e-3, 2e-3])})
    weights = system.weights(values).stiffness[:, 4:]
    assert weights.shape == (2, 4)
    assert weights[1] == pytest.approx(4.0 * weights[0])


def test_what_was_read_is_taken():
    """A rise of nothing is no parameter."""
    read = board_with(HALF_TOP, warp={"cup": Quantity.exact(0.8e-3), "twist": Quantity.exact(0.0)})
    parameters = Warp.of(read, read.setups[0]).parameters()
    assert [(one.key, one.prior.is_exact) for one in parameters] == [("cup", True), ("bow", False)]
    assert parameters[0].prior.mean == 0.8e-3


def test_the_membrane_ends_at_the_outline():
    """A dome narrower at one end; with the rectangle's membrane (0,2) would be 5.7 cents too high."""
    narrowing = Surface(((1, 0),), (-0.1 / np.sqrt(12.0),))
    outline = OutlineProfile(profile=FieldProfile(narrowing, None, (), 1.0, 0.0))
    ends = (0.0, HALF_TOP.L_x), (1.05 * HALF_TOP.L_y, 0.95 * HALF_TOP.L_y)
    dome = {"cup": 1.3e-3, "bow": 2e-3}
    sizes = {f"warp.{name}": rise for name, rise in dome.items()}
    planted = [GeneratorOutline(*ends), GeneratorWarp(**dome)]
    apart = hertz_apart(HALF_TOP, [warp(HALF_TOP, tuple(dome)), outline], sizes, planted, 6)
    assert apart == pytest.approx(0.0, abs=0.2)
