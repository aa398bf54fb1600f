"""The example closes the loop on the boards that come with the package, and its table is the one that is shown."""

from __future__ import annotations

import csv
import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
SHOWN = ROOT / "docs" / "validation" / "closing-the-loop.md"


def load():
    spec = importlib.util.spec_from_file_location("closing_the_loop", ROOT / "examples" / "closing_the_loop.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def example():
    return load()


@pytest.fixture(scope="module")
def computed(example):
    """The column that was computed with shear: the one board whose answer is known."""
    return example.close_the_loop(["paper-cantilever-fe"])


def shown_rows():
    lines = SHOWN.read_text(encoding="utf-8").splitlines()[2:]
    return [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines if line.startswith("|")]


def test_a_hidden_effect_is_named_and_the_error_falls(computed):
    one = computed["paper-cantilever-fe"]
    assert one["verdict"] == "named"
    assert one["effects"] == ["transverse_shear"]
    assert one["claim"]
    # An interval of 1 Hz is all that is known of a reading, and the fit may end anywhere inside: 4.6 cents rms over the
    # six, (1 Hz / f) / sqrt(12) each.
    read = np.array([51, 100, 315, 336, 394, 629])
    rounding = np.sqrt(np.mean((1200 / np.log(2) / read) ** 2 / 12))
    assert one["after"]["in_sample_rms_cents"] < rounding < 10.0 < one["before"]["in_sample_rms_cents"]
    assert one["after"]["nested_leave_one_out_rms_cents"] < 0.5 * one["before"]["nested_leave_one_out_rms_cents"]


def test_the_row_is_the_one_that_is_shown(example, computed):
    assert example.rows(computed)[0] == shown_rows()[0]


def test_the_readme_shows_the_table():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    inside = readme.partition("<!-- closing-the-loop -->")[2].partition("<!-- /closing-the-loop -->")[0]
    assert inside.strip() == SHOWN.read_text(encoding="utf-8").strip()


def test_every_board_is_shown(example):
    assert tuple(row[0] for row in shown_rows()) == example.BOARDS


def test_it_writes_its_table(example, computed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(example, "close_the_loop", lambda boards: computed)
    monkeypatch.setattr(sys, "argv", ["closing_the_loop.py", "--out", str(tmp_path)])
    example.main()
    assert (tmp_path / "closing-the-loop.md").read_text(encoding="utf-8").strip() in capsys.readouterr().out
    with (tmp_path / "closing-the-loop.csv").open(newline="", encoding="utf-8") as stream:
        assert list(csv.reader(stream)) == [list(example.COLUMNS), list(example.rows(computed)[0])]


@pytest.mark.slow
def test_all_rows_are_those_that_are_shown(example):
    assert example.rows(example.close_the_loop()) == shown_rows()
