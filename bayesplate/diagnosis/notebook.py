"""A diagnosis as a notebook shows it: the verdict and its tables."""

from __future__ import annotations

from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.tables import every_table
from bayesplate.diagnosis.told import known_sentences, verdict_sentences, warnings
from bayesplate.diagnosis.words import VERDICTS
from bayesplate.results import notebook


def html(diagnosis: Diagnosis) -> str:
    """Heading, sentences, tables, and what to measure next; every text escaped."""
    advice = [f"What to measure next: {diagnosis.recommendation}"] if diagnosis.recommendation else []
    sentences = [*verdict_sentences(diagnosis), *known_sentences(diagnosis), *warnings(diagnosis), *advice]
    heading = f"{diagnosis.name}: {VERDICTS[diagnosis.verdict].heading}"
    return notebook.html(heading, sentences, every_table(diagnosis))
