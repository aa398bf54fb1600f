"""The forms in which an effect is tried, and boards on which several are declared together."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.diagnosis.shifts.forms import forms, sizes, with_forms
from bayesplate.effects import EFFECTS
from bayesplate.workflow.prepare import prepare


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
            keys = [key for free in one.free for key in free.keys]
            assert set(keys) == {key for key, quantity in one.board.inputs.items() if not quantity.is_exact}
            assert all(one.board.inputs[key] == board.inputs[key] for key in board.inputs if key not in keys)
            assert sizes(one, {free.name: 2.0 for free in one.free}) == dict.fromkeys(keys, 2.0)


def test_a_forgotten_mass_is_tried_at_places_on_the_free_part(board):
    places = []
    for one in forms(board)["attached_mass"]:
        ((place,),) = (item.places for item in one.board.setups[0].attached)
        places.append(place)
    x, y = np.array(places).T
    assert len(set(places)) == len(places) >= 4
    assert x.min() >= 0.030  # what the clamp covers carries nothing
    assert x.max() <= 0.253
    assert 0.0 <= y.min() <= y.max() <= 0.114


def test_forms_declared_together_keep_what_each_needs(board):
    found = forms(board)
    pairs = (("transverse_shear", "attached_mass"), ("attached_mass", "clamp_rotation"), ("air_loading", "grain_angle"))
    for names in pairs:
        chosen = [found[name][0] for name in names]
        both = with_forms(board, chosen)
        assert both.effects == names
        for one in chosen:
            for free in one.free:
                assert all(both.inputs[key] == free.prior for key in free.keys)
        assert bool(both.setups[0].attached) == ("attached_mass" in names)
    assert with_forms(board, []) == board


def test_a_form_acts_in_every_setup_where_it_can():
    """One value in all of them: a tension of the clamped board cannot act on a free one."""
    one = prepare("fiemme-spruce-clamped").board
    tension = forms(one)["membrane_tension"]
    assert {form.detail for form in tension} >= {"along x", "along y"}
    assert all(free.keys == ("membrane_tension.N[clamped]",) for form in tension for free in form.free)
