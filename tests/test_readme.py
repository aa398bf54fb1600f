"""The README shows what the package prints: its table is that of the fit which `make fit` runs."""

from __future__ import annotations

from pathlib import Path

from bayesplate.workflow.fit import fit
from bayesplate.workflow.shown import show_fit

README = Path(__file__).parents[1] / "README.md"


def test_the_printed_tables_are_those_of_the_fit():
    printed = README.read_text(encoding="utf-8")
    shown = show_fit(fit("finnish-spruce-cantilever").summary)
    rows = [[cell.strip() for cell in line.strip("│").split("│")] for line in printed.splitlines() if "│" in line]
    wanted = [list(row) for table in shown.tables for row in table.rows]
    assert rows == wanted
    assert all(" ".join(text.split()) in " ".join(printed.split()) for text in (*shown.remarks, shown.closing))
