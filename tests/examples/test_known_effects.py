"""The example on known effects: every measured board of the shelf, and a table that says rises as well as falls."""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import pytest
from diagnoses import KNOWN

from bayesplate.board.shelf import card_names

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def example(load):
    return load("known_effects")


def test_the_measured_boards_are_all_but_those_that_say_they_are_computed(example):
    """A card of computed frequencies says so in its first lines."""
    shelf = ROOT / "models" / "boards"
    computed = {
        path.stem for path in shelf.glob("*.toml") if path.read_text(encoding="utf-8").startswith("# A computed board")
    }
    assert set(card_names("boards")) - computed == set(example.measured_boards())
    assert len(computed) == 2


def test_it_writes_its_table(example, tmp_path, monkeypatch, capsys):
    asked = []

    def computed(boards):
        asked.extend(boards)
        return dict.fromkeys(boards[:2], KNOWN)

    monkeypatch.setattr(example, "known_effects", computed)
    monkeypatch.setattr(sys, "argv", ["known_effects.py", "--out", str(tmp_path)])
    example.main()
    assert tuple(asked) == example.measured_boards()
    lines = (tmp_path / "known-effects.md").read_text(encoding="utf-8").splitlines()
    assert "\n".join(lines) in capsys.readouterr().out
    first = asked[0]
    assert lines[2] == f"| {first} | as it stands | 21.2 | 46.5 | - | - | - |"
    assert lines[4] == f"| {first} | with fluid loading and attached mass | 42.8 | 94.0 | +1.2 | -2.5 | +0.0 |"
    assert len(lines) == 2 + 2 * len(KNOWN)
    with (tmp_path / "known-effects.csv").open(newline="", encoding="utf-8") as stream:
        header, *rows = csv.reader(stream)
    assert tuple(header) == example.COLUMNS
    assert rows[2] == [first, "with fluid loading and attached mass", "42.75", "94.0", "1.25", "-2.5", "0.0"]


@pytest.mark.slow
def test_on_a_measured_board_the_air_raises_the_error(example):
    """The paper's clamped board: computed air alone makes it worse, as the reference figures of another program do."""
    ((name, models),) = example.known_effects(["fiemme-spruce-clamped"]).items()
    assert name == "fiemme-spruce-clamped"
    stands, *others = models
    (air,) = (one for one in others if one.combination == ("fluid_loading",))
    assert air.leave_one_out_rms_cents > 2.0 * stands.leave_one_out_rms_cents
