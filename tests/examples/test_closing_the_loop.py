"""The example closes the loop on the boards that come with the package, and its table is the one that is shown."""

from __future__ import annotations

import csv
import re
import sys
from pathlib import Path

import numpy as np
import pytest

from bayesplate.commands.prepare import prepare

ROOT = Path(__file__).parents[2]
SHOWN = ROOT / "docs" / "validation" / "closing-the-loop.md"


@pytest.fixture(scope="module")
def example(load):
    return load("closing_the_loop")


@pytest.fixture(scope="module")
def computed(example):
    """The column that was computed with shear: the one board whose answer is known."""
    return example.close_the_loop(["paper-cantilever-fe"])


def tables_of(path):
    """The tables of a page in Markdown, without their headings."""
    tables, rows = [], []
    for line in [*path.read_text(encoding="utf-8").splitlines(), ""]:
        if line.startswith("|"):
            rows.append(tuple(cell.strip() for cell in line.removeprefix("|").removesuffix("|").split("|")))
        elif rows:
            tables.append(rows[2:])
            rows = []
    return tables


def shown_rows():
    return tables_of(SHOWN)[1]


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
    """Word for word; the last digit of a number is the draws', which differ from machine to machine."""
    found, shown = (
        [re.split(r"([-+]?\d+\.\d+)", cell) for cell in row] for row in (example.rows(computed)[0], shown_rows()[0])
    )
    for one, other in zip(found, shown, strict=True):
        assert one[::2] == other[::2]
        assert list(map(float, one[1::2])) == pytest.approx(list(map(float, other[1::2])), abs=0.101)


def test_the_readme_says_what_the_page_of_measured_boards_shows(example):
    """One row a board; steel in water, the half-tops that were set aside, and what the search claims in a sentence."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    inside = readme.partition("<!-- measured -->")[2].partition("<!-- /measured -->")[0]
    assert inside.strip() == example.markdown(example.SHORT_COLUMNS, example.shortest(tables_of(SHOWN)[0])).strip()

    words = " ".join(readme.split())
    steel = next(row for row in shown_rows() if row[0] == "steel-air-water")
    before, after = re.search(r"fluid_loading in water: (\S+) → (\S+)", steel[11]).groups()
    assert f"its frequencies in water are missed by {before} cents without the water and by {after} with it" in words
    page = (SHOWN.parent / "spruce-half-tops-set-aside.md").read_text(encoding="utf-8")
    told = r"in sum by (\S+) ± (\S+) in log score; error of the left-out boards (\S+) cents before, (\S+)"
    gain, error, first, last = re.search(told, page).groups()
    assert page.count("The boards share transverse shear: 4 of 4 boards") == 1
    assert f"by {gain} ± {error} in log score, {first} to {last.rstrip('.')} cents" in words

    assert [row[0] for row in shown_rows() if row[3] == "error reduced"] == ["paper-cantilever-fe"]
    assert "nor does it claim anything on the other measured boards" in words
    (alone,) = [row for row in shown_rows() if row[0] == "spruce-free-1R"]
    assert alone[1:4] == ("indistinguishable group", "transverse_shear, grain_angle", "no claim")
    before, after = alone[6].split(" → ")
    assert f"the nested leave-one-out error goes from {before} to {after} cents" in words


def test_on_fiemme_air_and_exciter_work_only_together():
    """physics.md 7.1: air alone 43 to 61 cents, with the exciter half of that, fitted at most 10; E_x 12 +- 0.8 GPa."""
    table = tables_of(SHOWN)[0]
    start = next(i for i, row in enumerate(table) if row[0] == "fiemme-spruce-clamped")
    rows = {(row[1], row[2].split(",")[0]): row for row in table[start : start + 5]}
    computed = {words: float(row[3]) for (words, how), row in rows.items() if how == "computed"}
    assert 43.0 <= computed["fluid loading"] <= 61.0
    assert computed["fluid loading and exciter"] == pytest.approx(0.5 * computed["fluid loading"], rel=0.25)
    both = rows["fluid loading and exciter", "fitted"]
    assert float(both[3]) <= 10.0
    assert float(both[5].split(" ± ")[0]) == pytest.approx(12.0, abs=0.8)


def test_the_page_that_is_shown_says_what_its_columns_are_and_has_every_board(example):
    """Nothing is named on the control."""
    page = SHOWN.read_text(encoding="utf-8")
    assert page.startswith(example.STATED_HEAD)
    assert example.HEAD in page
    rows = {row[0]: row for row in shown_rows()}
    assert tuple(rows) == example.BOARDS
    assert rows["acrylic-panel"][2:4] == ("-", "no claim")


def test_what_rounds_to_nothing_has_no_sign(example):
    shown = {0.0: "0", -0.04: "0", 0.05: "+0.1", -1.25: "-1.2", 2.0: "+2.0"}
    assert {value: example._signed(value) for value in shown} == shown


def test_it_writes_its_table(example, computed, tmp_path, monkeypatch, capsys):
    stated = [("made", "nothing", "fitted", "15.7", "34.9", "10.4 ± 0.4", "", "")]
    monkeypatch.setattr(example, "close_the_loop", lambda boards: computed)
    monkeypatch.setattr(example, "stated_rows", lambda diagnoses: stated)
    monkeypatch.setattr(sys, "argv", ["closing_the_loop.py", "--out", str(tmp_path)])
    example.main()
    assert (tmp_path / "closing-the-loop.md").read_text(encoding="utf-8") == example.page(stated, computed)
    assert example.page(stated, computed).strip() in capsys.readouterr().out
    with (tmp_path / "closing-the-loop.csv").open(newline="", encoding="utf-8") as stream:
        assert list(csv.reader(stream)) == [list(example.COLUMNS), list(example.rows(computed)[0])]


@pytest.mark.slow
def test_all_rows_are_those_that_are_shown(example):
    found = example.close_the_loop()
    assert [example.stated_rows(found), example.rows(found)] == tables_of(SHOWN)
