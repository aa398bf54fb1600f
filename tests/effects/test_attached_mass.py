"""Attached things: rotary inertia, symmetry, what a card declares, what a search tries."""

from __future__ import annotations

from dataclasses import replace

import made_boards
import numpy as np
import pytest
import ritz
from deflected import power
from effect_plates import MADE
from generator.designs import ALL_FREE

from bayesplate.board.attached import AttachedItem
from bayesplate.board.quantity import Quantity
from bayesplate.effects.attached_items import PlacedItem, base_diameter
from bayesplate.effects.attached_mass import AttachedMass
from bayesplate.plate.line import line
from bayesplate.plate.plate import plate_of
from bayesplate.plate.thin import THIN

AS_FREE = replace(ritz.FINNISH, edges=ALL_FREE)


def at(*places, radius=(0.0, 0.0)):
    """A thing at places, fractions of the sides."""
    return AttachedMass(MADE, (PlacedItem(Quantity.exact(1e-3), "", places, radius),))


def test_rotary_inertia_of_a_compact_solid():
    """w = x + 2 y tilts by 1 and 2: 5 J, J of a cylinder as high as wide about a diameter of its base.

    That is m (R^2 / 4 + H^2 / 3) = m d^2 (1/16 + 1/3), and d^3 = 4 m / (5000 pi).
    """
    board, setup = board_with(replace(KNOWN, mass=Quantity.exact(20e-3)), effects=("attached_mass",), plate=AS_FREE)
    effect = AttachedMass.of(board, setup)
    x, y = (line(("free", "free"), n, is_split=False) for n in (8, 6))
    field = AS_FREE.L_x * np.outer(power(x, 1), power(y, 0)) + 2 * AS_FREE.L_y * np.outer(power(x, 0), power(y, 1))
    values = board.nominal() | {"attached_mass.mass[setup]": np.asarray(20e-3)}
    added = effect.contributions()
    (own,) = plate_of(THIN, x, y).with_terms([], [one.terms for one in added]).classes
    energies = own.energies(field.reshape(-1, 1))[1][0, 1:] * [one.weight(values, setup) for one in added]
    total = AS_FREE.rho * AS_FREE.h * AS_FREE.L_x * AS_FREE.L_y * sum(energies)
    diameter = (4 * 20e-3 / (5000 * np.pi)) ** (1 / 3)
    deflection = 0.2007 + 2 * 0.0855
    assert base_diameter(20e-3) == pytest.approx(diameter)
    assert total == pytest.approx(20e-3 * (deflection**2 + 5 * diameter**2 * (1 / 16 + 1 / 3)), rel=1e-9)


def test_symmetry_that_the_places_keep():
    assert at((0.5, 0.5)).keeps_symmetry() == (True, True)
    assert at((0.9, 0.5)).keeps_symmetry() == (False, True)
    assert at((0.9, 0.3), (0.1, 0.3)).keeps_symmetry() == (True, False)


def board_with(*attached, plate=ritz.FINNISH, effects=()):
    """A board whose vibrating part begins 30 mm from its end x0, with things attached."""
    setup = made_boards.setup_of(plate.edges, {(0, 0): 1.0}, clamped={"x0": Quantity.exact(0.03)})
    board = made_boards.board_of(plate, [replace(setup, attached=attached)])
    return replace(board, effects=effects), board.setups[0]


KNOWN = AttachedItem("accelerometer", ((0.2307, 0.0855),), Quantity.from_mean(0.6e-3, 0.1e-3))
UNKNOWN = AttachedItem("weight", ((0.2, 0.01), (0.1, 0.1)))


def test_what_a_card_declares():
    """A mass declares its thing; the others join if the card lists the effect; places count from the whole board."""
    board, setup = board_with(KNOWN, UNKNOWN)
    (item,) = AttachedMass.of(board, setup).items
    assert item.mass is KNOWN.mass
    assert item.places[0] == pytest.approx((0.9, 0.75))
    listed = AttachedMass.of(replace(board, effects=("attached_mass",)), setup)
    assert [p.key for p in listed.parameters()] == ["mass_1", "mass_2"]


def test_candidates_of_a_search():
    """Each thing of unknown mass; where nothing is said, a few places off the clamp, none the mirror of another."""
    (candidate,) = AttachedMass.candidates(*board_with(KNOWN, UNKNOWN))
    assert [len(item.places) for item in candidate.items] == [1, 2]
    assert AttachedMass.candidates(*board_with(KNOWN)) == ()
    board, _ = board_with()
    tried = [form.effects[0].items[0].places[0] for form in AttachedMass.forms(board)]
    assert len(tried) == 12
    assert min(x for x, _ in tried) == pytest.approx(0.25)
    assert max(y for _, y in tried) == 0.5


def test_a_thing_that_is_somewhere_is_tried_at_the_likely_places():
    """With the prior of its kind, where a forgotten one would be; an exciter, whose magnet hangs, is no thing."""
    forgotten = [form.detail for form in AttachedMass.forms(board_with()[0])]
    drives = AttachedItem("exciter", ((0.1, 0.1),), 0.05), AttachedItem("exciter")
    assert [form.detail for form in AttachedMass.forms(board_with(*drives)[0])] == forgotten
    forms = AttachedMass.forms(board_with(AttachedItem("accelerometer"))[0])
    assert [form.detail for form in forms] == forgotten
    assert [form.effects[0].items[0].mass.median for form in forms] == pytest.approx([1.4e-3] * len(forms))
    beside, setup = board_with(KNOWN, AttachedItem("weight"))
    declared = AttachedMass.of(replace(beside, effects=("attached_mass",)), setup)
    assert [item.mass for item in declared.items] == [KNOWN.mass]  # declared, it has to be somewhere
    assert [len(one.items) for one in AttachedMass.candidates(beside, setup)] == [2] * len(forgotten)
