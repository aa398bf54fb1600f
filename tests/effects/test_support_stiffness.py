"""Foundation: the bounce of a board declares it and states its stiffness."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from generator.known_boards import FREE
from made_boards import board_of

from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import DEFAULT_NOISE, Setup
from bayesplate.effects import effect_faults, implied_effects
from bayesplate.effects.support_stiffness import SupportStiffness


def bouncing(bounce, ends=("free", "free")):
    setup = Setup("made", ends, ("free", "free"), (), DEFAULT_NOISE, bounce=bounce)
    return replace(board_of(FREE, [setup]), effects=()), setup


def bounce_of(board, stiffness):
    """The frequency at which a plate moves as a whole on a foundation, from its own mass and size."""
    size = {name: float(one.mean) for name, one in board.inputs.items()}
    per_area = FREE.rho * FREE.h
    assert size["thickness"] == pytest.approx(FREE.h)
    return np.sqrt(stiffness / per_area) / (2.0 * np.pi)


def test_a_bounce_is_the_stiffness_that_the_board_bounces_on():
    """With its uncertainty: two thirds of the frequencies within the factor that was stated, about the same median."""
    stated = Quantity.from_mean(4.25, 0.75)
    board, setup = bouncing(stated)
    (parameter,) = SupportStiffness.of(board, setup).parameters()
    assert (parameter.unit, parameter.source) == ("N/m^3", "")
    for z in (-2.0, -1.0, 0.0, 1.0, 2.0):
        assert bounce_of(board, parameter.prior.value(z)) == pytest.approx(stated.value(z), rel=1e-12)
    (exact,) = SupportStiffness.of(*bouncing(Quantity.exact(5.0))).parameters()
    assert exact.prior.is_exact
    assert bounce_of(board, exact.prior.mean) == pytest.approx(5.0, rel=1e-12)


def test_a_bounce_declares_the_support_and_bounds_it_where_it_is_only_a_candidate():
    board, setup = bouncing(Quantity.exact(5.0))
    assert implied_effects(board) == ("support_stiffness",)
    assert implied_effects(replace(board, implies=False)) == ()
    assert not SupportStiffness.is_implied(bouncing(None)[0])
    (form,) = SupportStiffness.forms(board)
    assert form.effects == (SupportStiffness.of(board, setup),)
    other = replace(setup, name="other", bounce=None)
    assert form.effects[0].in_setup(board, other).stiffness == form.effects[0].stiffness
    assert SupportStiffness(other.owner).in_setup(board, setup) == form.effects[0]


def test_a_bounce_of_a_held_board_is_refused():
    board, _ = bouncing(Quantity.exact(5.0), ("clamped", "free"))
    assert implied_effects(board) == ("support_stiffness",)
    (fault,) = effect_faults(replace(board, effects=("support_stiffness",)))
    assert str(fault).startswith(
        f"{board.name}.toml [setup]: wanted a setup in which support_stiffness can act, got an"
    )
