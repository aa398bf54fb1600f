"""Warp: symmetry, weights, what a card states and a search tries."""

from __future__ import annotations

from dataclasses import replace

import made_boards
import numpy as np
import pytest
from effect_plates import setup_of, values_of
from generator.known_boards import HALF_TOP, STEEL

from bayesplate.board.parameter import BOARD
from bayesplate.board.quantity import Quantity
from bayesplate.effects.warp import Warp
from bayesplate.frequencies.system import System
from bayesplate.plate.membrane import CURVATURES


def warp(plate, names=CURVATURES):
    """The effect on a plate; its sizes are given with the values."""
    return Warp(BOARD, tuple((name, Quantity.exact(1.0), "") for name in names), plate.L_x / plate.L_y)


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


@pytest.fixture(scope="module")
def half_top():
    return made_boards.board_of(HALF_TOP, [setup_of(HALF_TOP)])


def test_what_was_read_is_taken_and_declares_the_effect(half_top):
    read = replace(half_top, warp={"cup": Quantity.exact(0.8e-3), "twist": Quantity.exact(0.0)})
    assert not Warp.is_implied(half_top)
    assert Warp.is_implied(read)
    parameters = Warp.of(read, read.setups[0]).parameters()
    assert [(one.key, one.prior.is_exact) for one in parameters] == [("cup", True), ("bow", False)]
    assert parameters[0].prior.mean == 0.8e-3


def test_a_search_tries_curvatures_and_a_twist_apart(half_top):
    assert [form.detail for form in Warp.forms(half_top)] == ["cup and bow", "twist"]


def test_refused_where_no_usual_warp_would_show():
    thick = made_boards.board_of(replace(STEEL, h=0.06), [setup_of(STEEL)])
    assert "thick" in Warp.refusal(thick, thick.setups[0])
    assert not Warp.forms(thick)
