"""The effect that CONTRIBUTING gives as an example: its one file takes it through a fit and a search."""

from __future__ import annotations

import re
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from effect_plates import MADE, modes_of
from generator.known_boards import FREE

from bayesplate.commands.prepare import prepare
from bayesplate.diagnosis.forms import forms
from bayesplate.effects import EFFECTS, declare
from bayesplate.posterior.posing import pose

TEXT = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
NAME = "bracing_bar"


@pytest.fixture
def bar(monkeypatch):
    """The class of the example, in the library for the length of one test."""
    (source,) = re.findall(r"^```python\n(.*?)^```$", TEXT, re.DOTALL | re.MULTILINE)
    module = ModuleType(f"bayesplate.effects.{NAME}")
    monkeypatch.setitem(sys.modules, module.__name__, module)  # where a dataclass looks up its annotations
    exec(compile(source, "CONTRIBUTING.md", "exec"), vars(module))
    monkeypatch.setitem(EFFECTS, NAME, module.BracingBar)
    return module.BracingBar


def test_a_light_bar_shifts_each_mode_by_its_energies(bar):
    """To first order EI int w_xx^2 - omega^2 m int w^2 / L along y0, from the bare plate's shapes: differences of w."""
    EI, mass, n = 1e-3, 1e-6, 2001
    bare = modes_of(FREE, [], {}, 6)
    moved = modes_of(FREE, [bar()], {f"{NAME}.EI": EI, f"{NAME}.mass": mass}, 6)
    x = np.linspace(0.0, 1.0, n)
    edge = bare.displacement(x, np.zeros(1))[:, :, 0]
    curvature = np.diff(edge, 2, axis=1) * (n - 1) ** 2 / FREE.L_x**2
    total = FREE.rho * FREE.h * FREE.L_x * FREE.L_y  # modes are normalised to a mass of one
    gained = (EI * FREE.L_x * (curvature**2).mean(axis=1) - bare.eigenvalues * mass * (edge**2).mean(axis=1)) / total
    assert moved.eigenvalues - bare.eigenvalues == pytest.approx(gained, rel=0.02)
    assert np.abs(gained / bare.eigenvalues).max() < 1e-3


def test_one_file_and_one_word_take_it_through_a_fit_and_a_search(bar):
    board = prepare("finnish-spruce-cantilever").board
    assert {free.key for free in forms(board)[NAME][0].free} == {"EI", "mass"}
    problem = pose(declare(replace(board, effects=(NAME,))), prepare("finnish-spruce-cantilever").prior)
    assert {f"z[{NAME}.EI]", f"z[{NAME}.mass]"} <= set(problem.parameters.names)
    assert "held" in bar.refusal(board, replace(board.setups[0], ends_y=("clamped", "free")))
    assert MADE.name not in problem.parameters.names  # the bar belongs to the board
