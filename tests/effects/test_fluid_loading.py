"""Air: a kernel by hand, and what a card says of the fluid."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from deflected import deflections, power
from effect_plates import MADE, board_with, modes_of
from generator.known_boards import FIEMME, FINNISH

from bayesplate.board.attached import DeclaredFluid
from bayesplate.board.quantity import Quantity
from bayesplate.effects.fluid_loading import BAFFLES, DEFAULT_DENSITY, UNKNOWN_BAFFLE, FluidLoading
from bayesplate.plate.air import air_mass
from bayesplate.plate.line import line

OPEN = {"fluid_loading.density": 1.2, "fluid_loading.baffle": 0.0}


def air(plate, baffle=UNKNOWN_BAFFLE):
    return FluidLoading(MADE, plate.L_x / plate.L_y, baffle=baffle)


def piston(aspect_ratio, is_baffled):
    """Added mass of a free rectangle of unit area that moves as a whole, at unit density."""
    side = line(("free", "free"), 4)
    shift = power(side, 0)
    return air_mass(deflections(side, side, [np.outer(shift, shift)]), aspect_ratio, is_baffled)[0, 0]


def test_baffled_piston_has_a_closed_form():
    """int int 1/R over a rectangle a x b twice: 2 (a^2 b asinh(b/a) + a b^2 asinh(a/b) - ((a^2+b^2)^1.5-a^3-b^3)/3)."""
    aspect_ratio = 3.0
    a, b = np.sqrt(aspect_ratio), 1 / np.sqrt(aspect_ratio)
    logs = a**2 * b * np.arcsinh(b / a) + a * b**2 * np.arcsinh(a / b)
    exact = 2.0 * (logs - (np.hypot(a, b) ** 3 - a**3 - b**3) / 3.0)
    assert piston(aspect_ratio, True) == pytest.approx(exact / np.pi, rel=1e-5)


def test_a_known_baffle_needs_one_term():
    both = modes_of(FIEMME, [air(FIEMME)], OPEN, 6)
    one = modes_of(FIEMME, [air(FIEMME, BAFFLES["none"])], OPEN, 6)
    assert [m.mass_coefficients.shape[1] for m in (both, one)] == [3, 2]
    assert one.eigenvalues == pytest.approx(both.eigenvalues, rel=1e-12)


def test_takes_what_the_card_declares():
    """A setup that states its own fluid keeps it."""
    board = board_with(FINNISH)
    (setup,) = board.setups
    declared = replace(setup, fluid=DeclaredFluid(Quantity.exact(1.1), "full"))

    assert FluidLoading.of(board, setup) == FluidLoading(MADE, 0.223 / 0.114, DEFAULT_DENSITY, UNKNOWN_BAFFLE)
    effect = FluidLoading.of(board, declared)
    assert (effect.density.mean, effect.baffle) == (1.1, Quantity.exact(1.0))
    wet = replace(setup, name="wet", fluid=DeclaredFluid(997.0))
    assert FluidLoading.of(board, wet).in_setup(board, setup).density.mean == 997.0
    assert FluidLoading.of(board, setup).in_setup(board, wet).density.mean == 997.0


def test_people_call_it_air_or_water():
    for value, word in ((99.0, "air"), (997.0, "water"), (790.0, "fluid")):
        density, _ = FluidLoading(MADE, density=Quantity.exact(value)).parameters()
        assert density.display_name == f"density of the {word} of fluid loading"
