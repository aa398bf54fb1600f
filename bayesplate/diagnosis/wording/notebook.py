"""A diagnosis as a notebook shows it: the verdict and its tables."""

from __future__ import annotations

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.tables import candidates_table, errors_table, shift_table
from bayesplate.diagnosis.wording.told import verdict_sentences
from bayesplate.diagnosis.wording.words import VERDICTS
from bayesplate.results import notebook


def html(diagnosis: Diagnosis) -> str:
    """Heading, sentences, tables, and what to measure next; every text escaped."""
    sentences = [*verdict_sentences(diagnosis), *diagnosis.notes, f"What to measure next: {diagnosis.recommendation}"]
    tables = (errors_table(diagnosis), shift_table(diagnosis), candidates_table(diagnosis, narrow=True))
    heading = f"{diagnosis.name}: {VERDICTS[diagnosis.verdict].heading}"
    return notebook.html(heading, sentences, (one for one in tables if one is not None))
