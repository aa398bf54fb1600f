"""Tables on terminals of any width: no number loses a digit, and a wide terminal shows a plain grid."""

from __future__ import annotations

import re

import pytest
from diagnoses import DIAGNOSES
from made_summaries import SUMMARY

from bayesplate.commands.shown import show_diagnosis, show_fit
from bayesplate.diagnosis.tables import candidates_table
from bayesplate.results.layout import column_widths
from bayesplate.results.tables import Table, render

TABLES = {
    "fit": show_fit(SUMMARY).tables,
    "diagnosis": show_diagnosis(DIAGNOSES["named"]).tables,
    "wide": (candidates_table(DIAGNOSES["named"]),),
}


def printed(table: Table, width: int) -> list[str]:
    """The lines of a table on a terminal."""
    return [line.rstrip() for line in render(table, "terminal", width=width).splitlines()]


@pytest.mark.parametrize("width", [40, 80])
@pytest.mark.parametrize("shown", TABLES)
def test_no_number_is_cut_on_a_narrow_terminal(shown, width):
    for table in TABLES[shown]:
        lines = printed(table, width)
        words = set(re.findall(r"[^\s│┃]+", "\n".join(lines)))

        assert max(map(len, lines)) <= width
        assert "…" not in "".join(lines)
        for row in table.texts:
            for cell in row:
                assert {word for word in cell.split() if len(word) < width - 4} <= words, cell


def test_a_number_and_its_uncertainty_stay_in_one_line():
    text = "\n".join(printed(TABLES["fit"][0], 50))

    assert "10.50 ± 0.25" in text
    assert "10.00 to 11.00" in text


def test_a_table_that_fits_is_a_grid_and_one_that_does_not_is_stacked():
    table = Table("Made", ("mode", "90 % interval", "a reason in words"), (("(1,0)", "-35.3 to +45.7", "not needed"),))

    assert column_widths(table.columns, table.texts, 80) == [5, 14, 17]
    assert column_widths(table.columns, table.texts, 40) == [5, 14, 11]  # by hand: 40 less 10 of rules leaves 30
    assert column_widths(table.columns, table.texts, 30) is None
    assert printed(table, 30) == [
        "Made",
        "mode (1,0)",
        "  90 % interval: -35.3 to",
        "  +45.7",
        "  a reason in words: not",
        "  needed",
    ]


def test_numbers_end_at_the_right_and_sentences_begin_at_the_left():
    rows = (("a", "1.5", "a sentence of more characters than any number has"), ("b", "12", "short"))
    assert "│ b     │    12 │ short " in "\n".join(printed(Table("t", ("board", "value", "doubt"), rows), 80))
