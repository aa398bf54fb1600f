"""Rows of a batch as they are told: where it stands, and whether another has the same readings."""

from __future__ import annotations

from bayesplate.grading.boards import BoardRow, told_rows


def test_boards_of_the_same_readings_are_in_doubt_and_what_was_refused_says_where_it_stands():
    rows = [
        BoardRow("a", "fitted", doubt="misread?", readings_sha256="1"),
        BoardRow("b", "refused", "b.toml [plate] mass_g: wanted"),
        BoardRow("c", "fitted", readings_sha256="2"),
        BoardRow("d", "fitted", readings_sha256="1"),
        *(BoardRow(f"e{i}", "fitted", readings_sha256="3") for i in range(6)),
        BoardRow("f", "fitted"),
        BoardRow("g", "fitted"),
    ]
    found = list(told_rows(rows, lambda at: f"t.csv row {10 - at}"))
    doubts = {row.name: row.doubt for row in found if row.doubt}

    assert found[1].message == "t.csv row 9 -> b.toml [plate] mass_g: wanted"
    assert doubts["a"] == "every reading is that of d to the last digit: one board twice, or a copy?; misread?"
    assert doubts["d"].startswith("every reading is that of a to")
    assert "that of e0, e1, e2 and 2 more to" in doubts["e5"]
    assert set(doubts) == {"a", "d", *(f"e{i}" for i in range(6))}
    assert list(told_rows(rows[1:2], lambda at: "")) == rows[1:2]
