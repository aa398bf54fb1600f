"""The command that CONTRIBUTING gives as an example weighs a board as it stands there."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from click.testing import CliRunner

import bayesplate
from bayesplate import cli
from bayesplate.commands.prepare import prepare

TEXT = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
BOARD = "finnish-spruce-cantilever"
IMPORTS = """
from __future__ import annotations
from typing import Annotated
from bayesplate.board.board import nominal_mass
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.options import CARD, SetupFile
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.problem import Problem, as_problem
"""


def test_the_example_weighs_a_board(monkeypatch):
    section = TEXT.partition("## A new command")[2].partition("\n## ")[0]
    (diff,) = re.findall(r"^```diff\n(.*?)^```$", section, re.DOTALL | re.MULTILINE)
    file, home, printed = (
        "\n".join(line[1:] for line in part.splitlines() if line.startswith("+")) for part in diff.split("\n # ")
    )
    module = ModuleType("bayesplate.commands.weigh")
    monkeypatch.setitem(sys.modules, module.__name__, module)
    exec(IMPORTS + file, vars(module))
    monkeypatch.setattr(bayesplate, "_HOMES", bayesplate._HOMES | eval(f"{{{home}}}"))
    monkeypatch.setattr(cli.main, "commands", dict(cli.main.commands))
    exec(printed, dict(vars(cli)))

    weighed = CliRunner().invoke(cli.main, ["weigh", BOARD, "--json"])

    board = prepare(BOARD).board
    sizes = [board.inputs[name].mean for name in ("length_x", "length_y", "thickness")]
    density = board.inputs["density"].mean if "density" in board.inputs else board.inputs["mass"].mean / np.prod(sizes)
    assert json.loads(weighed.output) == {"mass_kg": pytest.approx(density * np.prod(sizes))}
    assert " g\n" in CliRunner().invoke(cli.main, ["weigh", BOARD]).output
    assert CliRunner().invoke(cli.main, ["weigh", "no-such-board"]).exit_code == 3
    assert "--setup" in CliRunner().invoke(cli.main, ["weigh", "--help"]).output
