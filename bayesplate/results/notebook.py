"""Results as a notebook shows them: heading, sentences and tables in HTML, every text escaped."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

from bayesplate.results.tables import Table


def html(heading: str, sentences: Iterable[str], tables: Iterable[Table]) -> str:
    """A heading, a paragraph per sentence, and tables."""
    parts = [f"<h3>{escape(heading)}</h3>", *(f"<p>{escape(sentence)}</p>" for sentence in sentences)]
    return "\n".join([*parts, *(_table(one) for one in tables)])


def _table(table: Table) -> str:
    def row(cells: tuple[str, ...], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    rows = "\n".join(row(cells, "td") for cells in table.rows)
    return f"<table><caption>{escape(table.title)}</caption>\n{row(table.columns, 'th')}\n{rows}\n</table>"
