"""The forms in which an effect is tried, and boards on which several are declared together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.board.attached import AttachedItem
from bayesplate.board.board import make_board
from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.forms import forms, with_forms
from bayesplate.diagnosis.shifts import COARSE_CELLS, FINE_CELLS, cells_along
from bayesplate.effects import EFFECTS, effects_of


@pytest.fixture(scope="module")
def board():
    return prepare("finnish-spruce-cantilever").board


def test_every_effect_that_can_act_and_is_not_declared_has_a_form(board):
    found = forms(board)
    acting = {name for name, effect in EFFECTS.items() if not effect.refusal(board, board.setups[0])}
    assert set(found) == acting | {"attached_mass"}
    assert "membrane_tension" not in found  # three edges are free
    declared = prepare("finnish-spruce-cantilever", ["clamp_rotation"]).board
    assert "clamp_rotation" not in forms(declared)


def test_each_form_declares_its_effect_and_leaves_the_rest_of_the_board(board):
    for name, every in forms(board).items():
        assert len({one.title for one in every}) == len(every)
        for one in every:
            assert one.board.effects == (*board.effects, name)
            keys = [free.name for free in one.free]
            assert set(keys) == {key for key, quantity in one.board.inputs.items() if not quantity.is_exact}
            assert all(one.board.inputs[key] == board.inputs[key] for key in board.inputs if key not in keys)


def test_a_forgotten_mass_is_tried_at_places_on_the_free_part(board):
    places = []
    for one in forms(board)["attached_mass"]:
        (effect,) = effects_of(one.board, one.board.setups[0])
        ((place,),) = (item.places for item in effect.items)
        places.append(place)
    x, y = np.array(places).T
    assert len(set(places)) == len(places) >= 4
    assert (x.min(), y.min()) >= (0.0, 0.0)  # fractions of what the clamp leaves free
    assert (x.max(), y.max()) <= (1.0, 1.0)
    assert "at 242, 6 mm" in {one.detail for one in forms(board)["attached_mass"]}  # 30 mm are clamped of 253


def test_forms_declared_together_keep_what_each_needs(board):
    found = forms(board)
    mass = "attached_mass"
    pairs = (("transverse_shear", mass), (mass, "clamp_rotation"), ("fluid_loading", "grain_angle"))
    for names in pairs:
        chosen = [found[name][0] for name in names]
        both = with_forms(board, chosen)
        assert both.effects == names
        for one in chosen:
            for free in one.free:
                assert both.inputs[free.name] == free.prior
        masses = [one for one in effects_of(both, both.setups[0]) if one.name == "attached_mass"]
        assert len(masses) == names.count("attached_mass")
    assert with_forms(board, []) == board


def test_a_form_acts_in_every_setup_where_it_can():
    """One value in all of them: a tension of the clamped board cannot act on a free one."""
    one = prepare("fiemme-spruce-clamped").board
    tension = forms(one)["membrane_tension"]
    assert {form.detail for form in tension} >= {"along x", "along y"}
    assert all(free.name == "membrane_tension.N[clamped]" for form in tension for free in form.free)


def test_two_setups_masses_are_two(board):
    """One parameter per owner, in the search as in a refit; a taper of the board is one whatever the setups."""
    (setup,) = board.setups
    thing = AttachedItem("weight", ((0.2, 0.05),))
    held = tuple(replace(setup, name=name, attached=(thing,), clamped={}) for name in ("first", "second"))
    inputs = {one.key: one.prior for one in board.parameters if one.owner == BOARD_OWNER}
    both = forms(make_board("two", inputs, held))
    names = {name: {free.name for free in every[0].free} for name, every in both.items()}
    assert names["attached_mass"] == {"attached_mass.mass[first]", "attached_mass.mass[second]"}
    assert names["thickness_profile"] == {"thickness_profile.taper_x", "thickness_profile.taper_y"}
    every = {one.name for one in both["attached_mass"][0].board.uncertain}
    assert names["attached_mass"] <= every


def test_readings_at_places_are_tried_as_the_components_that_they_leave_open():
    """Widths that were read alike are no outline to try."""
    found = forms(prepare("spruce-free-2R", []).board)
    (form,) = found["thickness_profile"]
    assert [free.name for free in form.free] == ["thickness_profile.field_1", "thickness_profile.field_2"]
    assert "outline_profile" not in found
    (cut,) = forms(prepare("spruce-free-1R", []).board)["outline_profile"]
    assert [free.name for free in cut.free] == ["outline_profile.field_1", "outline_profile.field_2"]


def test_a_table_stays_small_whatever_the_number_of_parameters():
    assert [cells_along(n, FINE_CELLS) for n in (1, 2, 3, 5, 20)] == [33, 11, 6, 3, 1]
    assert [cells_along(n, COARSE_CELLS) for n in (1, 2, 3, 5, 20)] == [9, 5, 3, 1, 1]
