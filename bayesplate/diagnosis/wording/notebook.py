"""A diagnosis as a notebook shows it: the verdict and its tables."""

from __future__ import annotations

from html import escape

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.tables import candidates_table, errors_table, shift_table
from bayesplate.diagnosis.wording.told import verdict_sentences
from bayesplate.diagnosis.wording.words import VERDICTS
from bayesplate.results.tables import Table


def html(diagnosis: Diagnosis) -> str:
    """Heading, sentences, tables, and what to measure next; every text escaped."""
    sentences = [*verdict_sentences(diagnosis), *diagnosis.notes, f"What to measure next: {diagnosis.recommendation}"]
    tables = (errors_table(diagnosis), shift_table(diagnosis), candidates_table(diagnosis, narrow=True))
    heading = f"{diagnosis.name}: {VERDICTS[diagnosis.verdict].heading}"
    parts = [f"<h3>{escape(heading)}</h3>", *(f"<p>{escape(sentence)}</p>" for sentence in sentences)]
    return "\n".join([*parts, *(_table(one) for one in tables if one is not None)])


def _table(table: Table) -> str:
    def row(cells: tuple[str, ...], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"

    rows = "\n".join(row(cells, "td") for cells in table.rows)
    return f"<table><caption>{escape(table.title)}</caption>\n{row(table.columns, 'th')}\n{rows}\n</table>"
