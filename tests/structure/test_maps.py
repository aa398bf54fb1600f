"""The docstring of a room is a map of it: it names every file, and no other."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import bayesplate
from bayesplate.board.words import EFFECT_NAMES

PACKAGE = Path(bayesplate.__file__).parent
ROOMS = sorted(path.parent for path in PACKAGE.glob("*/__init__.py"))


def faults_of(source: str, files: set[str]) -> set[str]:
    """Files that a map leaves out, and names on it that are none."""
    caption = ast.get_docstring(ast.parse(source)) or ""
    return set(re.findall(r"`(\w+)(?:\.py)?`", caption)) ^ files


@pytest.mark.parametrize("room", ROOMS, ids=lambda room: room.name)
def test_a_room_is_mapped(room):
    files = {path.stem for path in room.glob("*.py")} - {"__init__"}
    of_their_own = set(EFFECT_NAMES) if room.name == "effects" else set()  # an effect's file bears its name

    assert faults_of((room / "__init__.py").read_text(encoding="utf-8"), files - of_their_own) == set()


def test_what_is_left_out_or_gone_is_found():
    """The negative control."""
    assert faults_of('"""A `plate` and its `forms`."""', {"plate", "forms"}) == set()
    assert faults_of('"""A `plate` and its `shapes`."""', {"plate", "forms"}) == {"forms", "shapes"}
    assert faults_of("", {"plate"}) == {"plate"}
