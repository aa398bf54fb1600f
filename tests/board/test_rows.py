"""A board as a row of a table: what would silently mean something else is refused with its place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from stated import frequencies

from bayesplate.board.checks import readings_sha256
from bayesplate.board.csv_table import read_csv_table
from bayesplate.board.rows import TableColumns
from bayesplate.errors import InputError

FREE = 'edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }'
CARD = f"""
format = 1
name = "template"
[plate]
length_x_mm = 580
length_y_mm = 217
thickness_mm = {{ mean = 4.5, sd = 0.03 }}
mass_g = 240
[setup]
{FREE}
"""
SIGNED = CARD + 'label_confidence = { "(1,1)" = 0.9 }\nsigns = { "(1,1)" = "+", "(2, 0)" = "-" }\n'
TWICE = CARD.replace("[setup]", '[[setup]]\nname = "one"') + f'[[setup]]\nname = "two"\n{FREE}\n'
READ = CARD + 'unlabelled_hz = [300]\n[setup.frequencies_hz]\n"(1, 1)" = 51.8\n"(3,0)" = 202\n"(1,2)" = 174\n'


def columns(tmp_path: Path, header: str, card: str = CARD) -> TableColumns:
    """The columns of a header beside a template."""
    (tmp_path / "template.toml").write_text(card)
    return TableColumns(tmp_path / "template.toml", read_csv_table(header.encode(), "t.csv")[0], "t.csv")


HEADERS = [
    ('name,thickness_mm sd,"(1,1)"', CARD, 'column 2: wanted a column "thickness_mm" beside it, got "thickness_mm sd"'),
    ('name,"(1,1)","( 1 , 1 )"', CARD, 'column 3: wanted each column once, got "( 1 , 1 )", which is "(1,1)" again'),
    ('name,"free (1,1)"', CARD, '(the template has no setup of a name: write the label alone, "(1,1)")'),
    ('name,"(1,1)"', TWICE, '(the setups of the template are "one", "two": write the name of one)'),
    ('name,"(1,1)"', READ, "(the template): wanted no reading that has no column in the table, got (3,0), (1,2), "
     "unlabelled_hz (leave it off"),
    ("name,thickness_mm,(1,1),(2,0) sd", CARD, 'wanted labels in double quotes, "(1,1)", got 2 without, each of them '
     'two cells (write "(1,1)","(2,0) sd")'),
    ("name;thickness_mm;(1,1)", CARD, "header: wanted commas between the cells, got semicolons (separate cells with"),
    ("name\tthickness_mm", CARD, "header: wanted commas between the cells, got tabs"),
    (",,\n,\n", CARD, "t.csv: wanted a table with a header, got an empty file"),
]  # fmt: skip


def test_a_header_that_would_mean_something_else_is_refused(tmp_path):
    for header, card, said in HEADERS:
        with pytest.raises(InputError, match=re.escape(said)):
            columns(tmp_path, header, card)


def test_a_template_may_have_readings_that_every_row_replaces(tmp_path):
    own = columns(tmp_path, 'name,"(1,1)","(3,0)","(1,2)"', READ.replace("unlabelled_hz = [300]\n", ""))
    (setup,) = own.board(["a", "52", "", "175"]).setups

    assert {str(label): hertz.mean for label, hertz in frequencies(setup).items()} == {"(1,1)": 52.0, "(1,2)": 175.0}


ROWS = [
    (["a", "", "0.5", "51.8"], '"thickness_mm": wanted a value beside its standard deviation, got an empty cell'),
    (["a", "4.4;4.5", "0.5", "51.8"], '"thickness_mm sd": wanted readings, or a value and its standard deviation'),
    (["a", "5_1.8", "", "51.8"], 'a.toml [plate] thickness_mm: wanted a number, got "5_1.8"'),
    (["", "4.5", "", "51.8"], "name: wanted a name, got an empty cell"),
    (["a", "4", "", "51", "8"], "cells: wanted 5, as the header has, got 6 (does a decimal comma divide"),
    (["a", "4.5", "", "51.8", "x"], 'column 5: wanted an empty cell, for the column has no name, got "x"'),
]


def test_a_row_that_would_mean_something_else_is_refused(tmp_path):
    for row, said in ROWS:
        own = columns(tmp_path, 'name,thickness_mm,thickness_mm sd,"(1,1)",')
        full = [*row[:4], "", row[4]] if "decimal" in said else row
        with pytest.raises(InputError, match=re.escape(said)):
            own.board(full)


def test_texts_stay_texts_and_what_is_empty_is_nothing(tmp_path):
    own = columns(tmp_path, 'name,title,notes,prior,,"(1,1)",,')
    for name, expected in (("007", "007"), ("1e5", "1e5"), ("nan", "nan"), (101, "101"), (101.0, "101")):
        card = own.board([name, "12", "3;4", "spruce", "", "51.8", "", None, " ", ""])
        assert (card.name, card.title, card.card.table["notes"], card.prior) == (expected, "12", "3;4", "spruce")


def test_what_was_not_read_on_a_board_is_left_out_with_all_that_is_said_of_it(tmp_path):
    signed = columns(tmp_path, 'name,"(1,1)","(2,0)","(0,2)"', SIGNED).board(["a", "51.8", "", "140"]).setups[0]
    assert [(str(one.label), one.sign, one.confidence) for one in signed.readings] == [
        ("(1,1)", "+", 0.9),
        ("(0,2)", "", 1.0),
    ]
    twice = columns(tmp_path, 'name,"one (1,1)","one (2,0)","two (1,1)"', TWICE)
    assert [one.name for one in twice.board(["a", "51.8", "72", ""]).setups] == ["one"]
    assert [one.name for one in twice.board(["a", "51.8", "72", "51"]).setups] == ["one", "two"]
    with pytest.raises(InputError, match=r'\[\[setup\]\] 1 "one" frequencies_hz: wanted measured frequencies'):
        twice.board(["a", "", "", ""])


def test_boards_of_other_names_with_the_same_readings_are_known(tmp_path):
    own = columns(tmp_path, 'name,title,mass_g,"(1,1)","(2,0)"')
    rows = [["a", "x", "240", "51.8", "72"], ["b", "", "240.0", "51.80", "72"], ["c", "", "241", "51.8", "72"]]
    one, copy, other = (readings_sha256(own.board(row)) for row in rows)

    assert one == copy != other


def test_a_column_of_yes_or_no_says_true_or_false(tmp_path):
    told = columns(tmp_path, 'name,isotropic,"(1,1)","(2,0)","(0,2)"')
    boards = [told.board([name, word, "51.8", "140", "220"]) for name, word in (("a", "true"), ("b", " FALSE"))]
    assert [board.isotropic for board in boards] == [True, False]
