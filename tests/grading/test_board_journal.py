"""The journal of many boards: what a killed run leaves of it is used as far as it is sound."""

from __future__ import annotations

from dataclasses import replace

import pytest
from made_summaries import SUMMARY

from bayesplate.grading.boards import NUMBERS, WORDS, BoardRow, row_of
from bayesplate.grading.storage import Journal, write_table

ROW, REFUSED = (
    row_of(replace(SUMMARY, doubts=("misread?", "scatter"))),
    BoardRow("bad", "refused", "=cmd|' /C calc'!A0"),
)


def test_rows_come_back_to_the_last_bit(tmp_path):
    journal = Journal(tmp_path / "boards.jsonl")
    journal.append("one", ROW)
    journal.append("two", REFUSED)
    again = Journal(tmp_path / "boards.jsonl")

    assert again.rows == journal.rows == {"one": ROW, "two": REFUSED}
    assert ROW.doubt == "misread?; scatter"
    assert len(ROW.cells()) == len(WORDS) + len(NUMBERS) == len(REFUSED.cells())
    journal.close()
    again.close()


@pytest.mark.parametrize("cut", [1, 7, 100])
def test_a_line_that_is_half_written_is_cut_off_and_written_anew(tmp_path, cut):
    path = tmp_path / "boards.jsonl"
    journal = Journal(path)
    journal.append("one", ROW)
    journal.append("two", REFUSED)
    journal.close()
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    journal = Journal(path)
    assert set(journal.rows) <= {"one"}

    journal.append("two", REFUSED)
    journal.close()

    assert path.read_bytes() == whole


def test_a_line_that_was_altered_is_no_row_wherever_it_was(tmp_path):
    """Every byte in turn, as a disk or a hand may change it: never another row in its place, and the next one stays."""
    path = tmp_path / "boards.jsonl"
    journal = Journal(path)
    journal.append("one", REFUSED)
    journal.append("two", REFUSED)
    journal.close()
    whole = path.read_bytes()
    for at in range(whole.index(b"\n")):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        journal = Journal(path)
        assert journal.rows.get("one", REFUSED) == REFUSED
        assert journal.rows["two"] == REFUSED
        journal.close()


def test_a_damaged_line_is_no_row_and_the_others_are(tmp_path):
    path = tmp_path / "boards.jsonl"
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

    assert found.column_names == [*WORDS, *NUMBERS]
    assert [list(one.values()) for one in found.to_pylist()[:2]] == [ROW.cells(), REFUSED.cells()]
    assert found.num_rows == 1400
