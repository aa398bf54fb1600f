"""Rows of many boards: their copies, and their journal, of which a killed run leaves what is used as far as sound."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_summaries import SUMMARY

from bayesplate.grading.boards import NUMBER_COLUMNS, TEXT_COLUMNS, BoardRow, board_row, mark_copied_readings
from bayesplate.grading.storage import Journal, write_table

ROW, REFUSED = (
    board_row(replace(SUMMARY, doubts=("misread?", "scatter"))),
    BoardRow("bad", "refused", "=cmd|' /C calc'!A0"),
)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "boards.jsonl"


def written(path, **rows):
    """The bytes of a journal with some rows, which are there when it is opened again."""
    journal = Journal(path)
    for key, row in rows.items():
        journal.append(key, row)
    journal.close()
    again = Journal(path)
    assert again.rows == journal.rows == rows
    again.close()
    return path.read_bytes()


def test_rows_come_back_to_the_last_bit(path):
    written(path, one=ROW, two=REFUSED)
    assert ROW.doubt == "misread?; scatter"
    assert len(ROW.cells()) == len(TEXT_COLUMNS) + len(NUMBER_COLUMNS) == len(REFUSED.cells())


@pytest.mark.parametrize("cut", [1, 100])
def test_a_line_that_is_half_written_is_cut_off_and_written_anew(path, cut):
    whole = written(path, one=ROW, two=REFUSED)
    path.write_bytes(whole[:-cut])
    journal = Journal(path)
    assert set(journal.rows) <= {"one"}

    journal.append("two", REFUSED)
    journal.close()

    assert path.read_bytes() == whole


def test_a_line_that_was_altered_is_no_row_wherever_it_was(path):
    """Every byte in turn, as a disk or a hand may change it: never another row in its place, and the next one stays."""
    whole = written(path, one=REFUSED, two=REFUSED)
    for at in range(whole.index(b"\n")):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        journal = Journal(path)
        assert journal.rows.get("one", REFUSED) == REFUSED
        assert journal.rows["two"] == REFUSED
        journal.close()


def test_a_damaged_line_is_no_row_and_the_others_are(path):
    path.write_bytes(b'{"key": "x"}\nnonsense\n{"key": "y", "row": {"name": 3}}\n' + b"[" * 100_000 + b"\n")
    journal = Journal(path)
    assert journal.rows == {}
    journal.append("one", ROW)
    journal.keep(["one"])
    journal.close()

    assert path.read_bytes().count(b"\n") == 1
    again = Journal(path)
    assert again.rows == {"one": ROW}
    again.close()


def test_a_cell_that_a_sheet_would_execute_is_a_text(tmp_path):
    text = write_table(tmp_path, "csv", [ROW, REFUSED]).read_text()

    assert ",'=cmd|" in text
    assert text.count("\n") == 3
    assert [path.name for path in tmp_path.iterdir()] == ["boards.csv"]


def test_a_table_in_parquet_has_the_same_cells(tmp_path):
    from pyarrow import parquet

    rows = [ROW, REFUSED] * 700
    found = parquet.read_table(write_table(tmp_path, "parquet", rows))

    assert found.column_names == [*TEXT_COLUMNS, *NUMBER_COLUMNS]
    assert [list(one.values()) for one in found.to_pylist()[:2]] == [ROW.cells(), REFUSED.cells()]
    assert found.num_rows == 1400


def test_boards_of_the_same_readings_are_in_doubt():
    rows = [
        BoardRow("a", "fitted", doubt="misread?", readings_sha256="1"),
        BoardRow("b", "refused", "b.toml [plate] mass_g: wanted"),
        BoardRow("c", "fitted", readings_sha256="2"),
        BoardRow("d", "fitted", readings_sha256="1"),
        *(BoardRow(f"e{i}", "fitted", readings_sha256="3") for i in range(6)),
        BoardRow("f", "fitted"),
        BoardRow("g", "fitted"),
    ]
    doubts = {row.name: row.doubt for row in mark_copied_readings(rows) if row.doubt}

    assert doubts["a"] == "every reading is that of d to the last digit: one board twice, or a copy?; misread?"
    assert doubts["d"].startswith("every reading is that of a to")
    assert "that of e0, e1, e2 and 2 more to" in doubts["e5"]
    assert set(doubts) == {"a", "d", *(f"e{i}" for i in range(6))}
