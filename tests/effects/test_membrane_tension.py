"""Tension: between which edges it acts."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from effect_plates import setup_of
from generator.known_boards import FIEMME

from bayesplate.effects.membrane_tension import MembraneTension


def test_acts_between_held_edges_only():
    between_y = replace(FIEMME, edges=FIEMME.edges | {"x1": "free"})
    assert MembraneTension.of(None, setup_of(between_y)).axis == "y"


@pytest.mark.parametrize(
    ("held", "axes"),
    [
        (["all"], {"": ["both"], "along x": ["x"], "along y": ["y"]}),
        (["y"], {"along y": ["y"]}),
        (["y", "none", "all"], {"": ["y", "both"], "along x": ["x"], "along y": ["y", "y"]}),
    ],
)
def test_setups_that_are_held_otherwise_are_stretched_along_the_same_side(held, axes):
    edges = {"all": {}, "y": {"x1": "free"}, "x": {"y1": "free"}, "none": {"x1": "free", "y1": "free"}}
    setups = [setup_of(replace(FIEMME, edges=FIEMME.edges | edges[one])) for one in held]
    setups = [replace(one, name=str(i)) for i, one in enumerate(setups)]
    forms = MembraneTension.forms(SimpleNamespace(setups=setups))
    assert {form.detail: [effect.axis for effect in form.effects] for form in forms} == axes
