"""The example closes the loop on the boards that come with the package, and its table is the one that is shown."""

from __future__ import annotations

import csv
import importlib.util
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from bayesplate.workflow.prepare import prepare

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
    lines = [line for line in SHOWN.read_text(encoding="utf-8").splitlines() if line.startswith("|")]
    return [tuple(cell.strip() for cell in line.strip("|").split("|")) for line in lines[2:]]


def test_a_hidden_effect_is_named_and_the_error_falls(computed):
    one = computed["paper-cantilever-fe"]
    assert one.verdict == "named"
    assert one.effects == ("transverse_shear",)
    assert one.claim
    # Readings rounded to 1 Hz leave (1 Hz / f) / sqrt(12) of themselves, 4.6 cents rms over the six; with the effect
    # that is there the fit leaves no more.
    (setup,) = prepare("paper-cantilever-fe").board.setups
    rounding = 1200 / np.log(2) * np.sqrt(np.mean(1 / (12 * setup.measured**2)))
    assert rounding == pytest.approx(4.6, abs=0.05)
    assert one.after.in_sample_rms_cents < rounding < 10.0 < one.before.in_sample_rms_cents
    assert one.after.nested_leave_one_out_rms_cents < 0.5 * one.before.nested_leave_one_out_rms_cents


def test_the_row_is_the_one_that_is_shown(example, computed):
    assert example.rows(computed)[0] == shown_rows()[0]


def test_the_readme_says_what_the_table_shows():
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    rows = {row[0]: row for row in shown_rows()}
    computed = {name: row for name, row in rows.items() if name.startswith("paper-")}

    assert "Two of eleven boards that come with the package are computed with a hidden effect, which it names" in readme
    assert "on the nine measured ones [it claims no improvement](docs/validation/closing-the-loop.md)" in readme
    assert (len(rows), len(computed)) == (11, 2)
    assert all(row[1:3] == ("named", "transverse_shear") for row in computed.values())
    assert "which it names, with a claim on one;" in readme
    assert [row[3] for row in computed.values()].count("error reduced") == 1
    measured = [row for name, row in rows.items() if name not in computed]
    assert all(row[3] == "no claim" for row in measured)
    groups = [row for row in measured if row[1] == "indistinguishable group"]
    assert "On two of these a group is left that the readings cannot tell apart" in readme
    assert len(groups) == 2
    for name, _, effects, *_ in groups:
        assert f"{effects.replace('_', ' ').replace(', ', ' or ')} on {name}" in readme
    (named,) = [row for row in measured if row[1] == "named"]
    assert named[:4:2] == ("spruce-free-1R", "transverse_shear, grain_angle")
    assert "On spruce-free-1R transverse shear with a grain angle is named" in readme
    told = "left out, the search repeated, goes from {} to {} cents, too little for a claim"
    assert told.format(*named[6].split(" → ")) in readme
    *_, nearest = rows["spruce-free-3L"]
    assert nearest.startswith("support_stiffness: ")
    before, after = rows["spruce-free-3L"][5].split(" → ")[0], nearest.split(": ")[1]
    told = f"a support stiffness comes nearest on spruce-free-3L, {before} to {after} cents"
    measure = "with the search not repeated"
    assert f"On two nothing known explains it; {told} {measure}, and leaves more than noise" in readme
    assert [row[1] for row in measured].count("unexplained") == 2


def test_the_readme_says_what_the_campaign_found():
    readme = " ".join((ROOT / "README.md").read_text(encoding="utf-8").split())
    page, *others = (
        (SHOWN.parent / f"spruce-half-tops{which}.md").read_text(encoding="utf-8")
        for which in ("-shear", "", "-scatter")
    )

    assert "Of six measured as one campaign, four are predicted better with the [shear that the others teach]" in readme
    assert "in sum by less than two standard errors: no claim." in readme
    assert "It is not claimed that the boards share transverse shear: 4 of 6 boards" in page
    gain, error = map(float, re.search(r"in sum by (\S+) ± (\S+) in log score", page).groups())
    assert gain < 2.0 * error
    for one in (page, *others):
        assert "It is not claimed that the boards share" in one
        assert "refuses" not in one


def test_the_page_that_is_shown_says_what_its_columns_are(example):
    assert SHOWN.read_text(encoding="utf-8").startswith(example.HEAD)


@pytest.mark.parametrize(("value", "shown"), [(0.0, "0"), (-0.04, "0"), (0.05, "+0.1"), (-1.25, "-1.2"), (2.0, "+2.0")])
def test_what_rounds_to_nothing_has_no_sign(example, value, shown):
    assert example._signed(value) == shown


def test_every_board_is_shown(example):
    assert tuple(row[0] for row in shown_rows()) == example.BOARDS


def test_it_writes_its_table(example, computed, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(example, "close_the_loop", lambda boards: computed)
    monkeypatch.setattr(sys, "argv", ["closing_the_loop.py", "--out", str(tmp_path)])
    example.main()
    assert (tmp_path / "closing-the-loop.md").read_text(encoding="utf-8") == example.page(computed)
    assert example.page(computed).removeprefix(example.HEAD).strip() in capsys.readouterr().out
    with (tmp_path / "closing-the-loop.csv").open(newline="", encoding="utf-8") as stream:
        assert list(csv.reader(stream)) == [list(example.COLUMNS), list(example.rows(computed)[0])]


@pytest.mark.slow
def test_all_rows_are_those_that_are_shown(example):
    assert example.rows(example.close_the_loop()) == shown_rows()
