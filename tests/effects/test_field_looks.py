"""Components of a field in words: the place that they name is where they are high, and their size is in millimetres."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from bayesplate.board.random_field import Surface
from bayesplate.commands.prepare import prepare
from bayesplate.effects.field_components import surface_words

PLACES = {
    "towards x0": (0.0, 0.5), "towards x1": (1.0, 0.5), "towards y0": (0.5, 0.0), "towards y1": (0.5, 1.0),
    "at mid-length": (0.5, 0.5), "at both ends": (0.0, 0.5), "along the middle": (0.5, 0.5),
    "along both sides": (0.5, 0.0), "at the corners x0 y1 and x1 y0": (0.0, 1.0),
    "at the corners x0 y0 and x1 y1": (1.0, 1.0),
}  # fmt: skip


def test_a_surface_is_high_where_it_is_said_to_be():
    x, y = np.meshgrid(np.linspace(0, 1, 11), np.linspace(0, 1, 11))
    for degrees, size in product([(1, 0), (0, 1), (2, 0), (0, 2), (1, 1)], [0.01, -0.01]):
        surface = Surface((degrees,), (size,))
        place = surface_words(surface, 3e-3, "thicker").removeprefix("at +1 thicker ").removesuffix(", 0.03 mm rms")
        assert float(surface(*(np.array(at) for at in PLACES[place]))) == pytest.approx(surface(x, y).max())


@pytest.mark.parametrize(
    ("coefficients", "words"),
    [
        ((-0.71, 0.50, 0.36), "at mid-length and along both sides"),  # the third has an eighth of the mean square
        ((-0.95, 0.20, 0.10), "at mid-length"),
        ((-0.60, -0.60, 0.50), "at mid-length and along the middle"),
        ((0.10, 0.10, 0.97), "in waves"),
    ],
)
def test_of_a_mixture_its_largest_parts_are_told(coefficients, words):
    surface = Surface(((2, 0), (0, 2), (3, 0)), tuple(0.005 * one for one in coefficients))

    assert surface_words(surface, 5e-3, "wider").startswith(f"at +1 wider {words}, ")


def test_every_component_of_a_measured_board_has_a_look():
    board = prepare("spruce-free-2L").board
    looks = {one.name: one.description for one in board.uncertain if one.is_component}

    assert set(looks) == {"thickness_profile.field_1", "thickness_profile.field_2", "outline_profile.field_1"}
    assert looks["thickness_profile.field_1"] == "at +1 thicker at mid-length and along both sides, 0.02 mm rms"
    assert looks["outline_profile.field_1"].startswith("at +1 wider at mid-length, 0.")
