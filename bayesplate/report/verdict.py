"""The part of a page that tells of a diagnosis: verdict, errors before and after, candidates, what to measure next."""

from __future__ import annotations

from dataclasses import dataclass

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.tables import averaged_table, candidates_table, errors_table, shift_table
from bayesplate.diagnosis.wording.told import remarks, verdict_sentences
from bayesplate.diagnosis.wording.words import VERDICTS
from bayesplate.results.tables import Table


@dataclass(frozen=True)
class DiagnosisSection:
    """Everything that the page shows of a diagnosis besides its pictures.

    Attributes
    ----------
    heading : str
    sentences : tuple of str
    tables : tuple of Table
        Errors, shift of the constants, constants averaged over the effects.
    notes : tuple of str
    candidates : Table or None
    recommendation : str
    """

    heading: str
    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    notes: tuple[str, ...]
    candidates: Table | None
    recommendation: str


def diagnosis_section(diagnosis: Diagnosis) -> DiagnosisSection:
    """The section of a diagnosis."""
    tables = (errors_table(diagnosis), shift_table(diagnosis), averaged_table(diagnosis))
    return DiagnosisSection(
        heading=VERDICTS[diagnosis.verdict].heading,
        sentences=tuple(verdict_sentences(diagnosis)),
        tables=tuple(table for table in tables if table is not None),
        notes=tuple(remarks(diagnosis)),
        candidates=candidates_table(diagnosis),
        recommendation=diagnosis.recommendation,
    )
