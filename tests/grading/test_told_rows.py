"""Rows of a batch: whether another board has the same readings."""

from __future__ import annotations

from bayesplate.grading.boards import BoardRow, with_copies_in_doubt


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
    doubts = {row.name: row.doubt for row in with_copies_in_doubt(rows) if row.doubt}

    assert doubts["a"] == "every reading is that of d to the last digit: one board twice, or a copy?; misread?"
    assert doubts["d"].startswith("every reading is that of a to")
    assert "that of e0, e1, e2 and 2 more to" in doubts["e5"]
    assert set(doubts) == {"a", "d", *(f"e{i}" for i in range(6))}
