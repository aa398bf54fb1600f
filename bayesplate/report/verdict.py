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
    verdicts : tuple of (str, str, bool)
        Each word that a verdict may be, what it means, and whether it is the one given.
    sentences : tuple of str
    tables : tuple of Table
        Errors, shift of the constants, constants averaged over the effects.
    explained : tuple of str
        What two words of these tables mean.
    notes : tuple of str
    candidates : Table or None
    recommendation : str
    """

    heading: str
    verdicts: tuple[tuple[str, str, bool], ...]
    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    explained: tuple[str, ...]
    notes: tuple[str, ...]
    candidates: Table | None
    recommendation: str


_LOG_SCORE = (
    "Log score: the natural logarithm of how probable each reading was, given the others, summed over the modes. The "
    "higher, the better; it punishes errors as well as intervals that are too narrow."
)
_SHIFT = "Shift, sd: how far a constant moves, counted in the standard deviations that it had before."


def diagnosis_section(diagnosis: Diagnosis) -> DiagnosisSection:
    """The section of a diagnosis."""
    tables = (errors_table(diagnosis), shift_table(diagnosis), averaged_table(diagnosis))
    return DiagnosisSection(
        heading=VERDICTS[diagnosis.verdict].heading,
        verdicts=tuple((word, one.heading, word == diagnosis.verdict) for word, one in VERDICTS.items()),
        sentences=tuple(verdict_sentences(diagnosis)),
        tables=tuple(table for table in tables if table is not None),
        explained=(_LOG_SCORE, *((_SHIFT,) if diagnosis.is_refitted else ())),
        notes=tuple(remarks(diagnosis)),
        candidates=candidates_table(diagnosis),
        recommendation=diagnosis.recommendation,
    )
