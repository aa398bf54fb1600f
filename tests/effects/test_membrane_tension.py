"""Tension: the closed form of a supported plate, the generator, and the sizes of physics.md."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import generator.effects
import numpy as np
import pytest
from effect_plates import ALL_SUPPORTED, MADE, hertz_apart, modes_of, setup_of, shifts
from generator.known_boards import BEAMS, FIEMME, FINNISH, FREE

from bayesplate.effects.membrane_tension import MembraneTension

N = "membrane_tension.N"


@pytest.mark.parametrize("axis", ["x", "y", "both"])
@pytest.mark.parametrize("tension", [5000.0])
def test_supported_plate_has_a_closed_form(tension, axis):
    """rho h omega^2 = D_x a^4 + (2 nu_xy D_y + D_s) a^2 b^2 + D_y b^4 + N_x a^2 + N_y b^2."""
    plate = replace(FIEMME, edges=ALL_SUPPORTED)
    a, b = np.meshgrid(np.arange(1, 9) * np.pi / plate.L_x, np.arange(1, 9) * np.pi / plate.L_y)
    twist = 2 * plate.nu_xy * plate.D_y + plate.G_xy * plate.h**3 / 3
    pulled = (a**2 if axis != "y" else 0) + (b**2 if axis != "x" else 0)
    squared = (plate.D_x * a**4 + twist * a**2 * b**2 + plate.D_y * b**4 + tension * pulled) / (plate.rho * plate.h)
    found = modes_of(plate, [MembraneTension(MADE, axis)], {N: tension}, 9).eigenvalues
    assert 600 * np.log2(found / np.sort(squared.ravel())[:9]) == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize("is_sheared", [False, True], ids=["thin", "shear-flexible"])
@pytest.mark.parametrize("tension", [5000.0])
def test_against_the_generator(tension, is_sheared):
    apart = hertz_apart(
        FIEMME,
        [MembraneTension.of(None, setup_of(FIEMME))],
        {N: tension},
        [generator.effects.MembraneTension(tension, tension)],
        9,
        is_sheared,
    )
    assert apart == pytest.approx(0.0, abs=0.5)


@pytest.mark.parametrize(
    ("axis", "sizes"), [("x", [92, 30, 66, 43, 10, 22]), ("y", [181, 220, 36, 87, 163, 98])], ids=["x", "y"]
)
def test_sizes_on_the_papers_clamped_board(axis, sizes):
    """physics.md 6: 500 N/m, printed as whole cents."""
    assert shifts(FIEMME, [MembraneTension(MADE, axis)], {N: 500.0}, BEAMS["clamped"]) == pytest.approx(sizes, abs=0.6)


def test_acts_between_held_edges_only():
    between_y = replace(FIEMME, edges=FIEMME.edges | {"x1": "free"})
    assert "nothing can stretch" in MembraneTension.refusal(None, setup_of(FINNISH))
    assert MembraneTension.refusal(None, setup_of(FREE))
    assert MembraneTension.of(None, setup_of(between_y)).axis == "y"


@pytest.mark.parametrize(
    ("held", "axes"),
    [
        (["all"], {"": ["both"], "along x": ["x"], "along y": ["y"]}),
        (["y"], {"along y": ["y"]}),
        (["none"], {}),
        (["all", "y"], {"": ["both", "y"], "along x": ["x"], "along y": ["y", "y"]}),
        (["y", "none", "all"], {"": ["y", "both"], "along x": ["x"], "along y": ["y", "y"]}),
        (["x", "y"], {"": ["x", "y"], "along x": ["x"], "along y": ["y"]}),
    ],
)
def test_setups_that_are_held_otherwise_are_stretched_along_the_same_side(held, axes):
    edges = {"all": {}, "y": {"x1": "free"}, "x": {"y1": "free"}, "none": {"x1": "free", "y1": "free"}}
    setups = [setup_of(replace(FIEMME, edges=FIEMME.edges | edges[one])) for one in held]
    setups = [replace(one, name=str(i)) for i, one in enumerate(setups)]
    forms = MembraneTension.forms(SimpleNamespace(setups=setups))
    assert {form.detail: [effect.axis for effect in form.effects] for form in forms} == axes
