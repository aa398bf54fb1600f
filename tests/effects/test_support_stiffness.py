"""Foundation: the bounce of a board states its stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from effect_plates import board_with
from generator.known_boards import FREE

from bayesplate.board.quantity import Quantity
from bayesplate.effects.support_stiffness import SupportStiffness


def bouncing(bounce):
    board = board_with(FREE, bounce=bounce)
    return board, board.setups[0]


def bounce_of(stiffness):
    """The frequency at which a plate moves as a whole on a foundation."""
    return np.sqrt(stiffness / (FREE.rho * FREE.h)) / (2.0 * np.pi)


def test_a_bounce_is_the_stiffness_that_the_board_bounces_on():
    """With its uncertainty: two thirds of the frequencies within the factor that was stated, about the same median."""
    stated = Quantity.from_mean(4.25, 0.75)
    board, setup = bouncing(stated)
    (parameter,) = SupportStiffness.of(board, setup).parameters()
    assert (parameter.unit, parameter.source) == ("N/m^3", "")
    for z in (-2.0, -1.0, 0.0, 1.0, 2.0):
        assert bounce_of(parameter.prior.value(z)) == pytest.approx(stated.value(z), rel=1e-12)
    (exact,) = SupportStiffness.of(*bouncing(Quantity.exact(5.0))).parameters()
    assert exact.prior.is_exact
    assert bounce_of(exact.prior.mean) == pytest.approx(5.0, rel=1e-12)


def test_a_bounce_bounds_the_support_where_it_is_only_a_candidate():
    board, setup = bouncing(Quantity.exact(5.0))
    (form,) = SupportStiffness.forms(board)
    assert form.effects == (SupportStiffness.of(board, setup),)
    other = replace(setup, name="other", bounce=None)
    assert form.effects[0].in_setup(board, other).stiffness == form.effects[0].stiffness
    assert SupportStiffness(other.owner).in_setup(board, setup) == form.effects[0]
