"""Tables for other programs: numbers at full precision, and no text that a program would run."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import pytest
from made_summaries import SUMMARY
from payloads import PAYLOADS

from bayesplate.results.exports import (
    constants_csv,
    constants_tex,
    csv_text,
    latex,
    write_exports,
)

SPREAD = {"mean": 10.5, "sd": 0.25, "q05": 10.0, "q25": 10.25, "q50": 10.5, "q75": 10.75, "q95": 11.0}


def read(text):
    header, *rows = csv.reader(io.StringIO(text))
    return {row[0]: dict(zip(header, row, strict=True)) for row in rows}


def test_constants_keep_their_numbers():
    rows = read(constants_csv(SUMMARY))

    assert list(rows) == ["E_x", "E_y", "G_xy", "D_x", "D_y", "D_s"]
    assert {key: float(rows["E_x"][key]) for key in SPREAD} == pytest.approx(SPREAD)
    assert {key: float(rows["D_s"][key]) for key in SPREAD} == SPREAD
    assert (rows["E_x"]["unit"], rows["D_x"]["unit"]) == ("GPa", "N m")
    assert float(rows["E_x"]["least_squares"]) == pytest.approx(10.25)
    assert float(rows["E_x"]["percentile_sd_percent"]) == 2.0
    assert rows["E_y"]["least_squares"] == rows["E_y"]["percentile_mean"] == rows["D_x"]["percentile_mean"] == ""


def test_no_percentile_leaves_its_cells_empty():
    assert read(constants_csv(replace(SUMMARY, percentile=None)))["E_x"]["percentile_mean"] == ""


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "  =1", *PAYLOADS])
def test_no_text_becomes_a_formula(text):
    written = csv_text([[text, -1.5, 2, None]])
    (cells,) = csv.reader(io.StringIO(written, newline=""), strict=True)

    assert not cells[0].lstrip(" ").startswith(("=", "+", "-", "@", "\t", "\r"))
    assert cells[0].removeprefix("'" if not text.startswith("'") else "") == " ".join(text.split())
    assert cells[1:] == ["-1.5", "2", ""]


def test_latex_prints_what_stands_there():
    """By hand: every character that means something to LaTeX."""
    assert latex("50 % & #1 $x_1^2$ {a} ~b\\c") == (
        r"50 \% \& \#1 \$x\_1\textasciicircum{}2\$ \{a\} \textasciitilde{}b\textbackslash{}c"
    )
    assert latex("one\ntwo") == "one two"


@pytest.mark.parametrize("payload", PAYLOADS, ids=range(len(PAYLOADS)))
def test_a_title_cannot_break_the_tables(payload):
    """It stands in a comment of one line: below it the table begins, and nothing else."""
    table = constants_tex(SUMMARY, payload)
    comment, begin, *_, last = table.splitlines()

    assert comment.startswith("% ")
    assert begin.startswith(r"\begin{tabular}")
    assert last == r"\end{tabular}"
    assert payload not in table or not set('\\{}$&#^_~%<>|"') & set(payload)


def test_tables_have_as_many_cells_as_columns():
    table = constants_tex(SUMMARY, "x")
    rows = [line for line in table.splitlines() if line.endswith(r"\\")]
    columns = table.splitlines()[1].rpartition("{")[2].rstrip("}")

    assert {row.count(" & ") + 1 for row in rows} == {len(columns)}
    assert r"$E_{x}$ & $10.50 \pm 0.25$ & 10.00 to 11.00 & 10.25 & 10.25 \\" in table


def test_the_files(tmp_path):
    assert [path.name for path in write_exports(tmp_path, SUMMARY, "x")] == ["constants.csv", "constants.tex"]
    assert len(list(tmp_path.iterdir())) == 2
