"""The part of a page that tells of a diagnosis: verdict, errors before and after, candidates, what to measure next."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

from bayesplate.diagnosis.known_words import known_table
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.tables import (
    answers_table,
    candidates_table,
    claim_table,
    errors_table,
    shift_table,
    sizes_table,
    what_is_quoted,
)
from bayesplate.diagnosis.words import (
    IN_PART,
    VERDICTS,
    headline_sentence,
    known_sentences,
    remarks,
    shown_model,
    verdict_sentences,
    warnings,
)
from bayesplate.report.content import summary_sentences
from bayesplate.results.contract import Elastic, Rigidity
from bayesplate.results.fit_tables import compared_constants
from bayesplate.results.summary import Summary
from bayesplate.results.tables import Table

_LOG_SCORE = (
    "Log score: the natural logarithm of how probable each reading was, given the others, summed over the modes. The "
    "higher, the better; it punishes errors as well as intervals that are too narrow."
)
_SHIFT = "Shift, sd: how far a constant moves, counted in the standard deviations that it had before."


def diagnosis_section(diagnosis: Diagnosis) -> SimpleNamespace:
    """Everything that the page shows of a diagnosis besides its pictures."""
    tables = (
        answers_table(diagnosis),
        errors_table(diagnosis),
        claim_table(diagnosis),
        shift_table(diagnosis),
        sizes_table(diagnosis),
    )
    return SimpleNamespace(
        heading=IN_PART if diagnosis.named_in_part else VERDICTS[diagnosis.verdict].heading,
        # each word that a verdict may be, what it means, and whether it is the one given
        verdicts=tuple((word, one.heading, word == diagnosis.verdict) for word, one in VERDICTS.items()),
        sentences=tuple(verdict_sentences(diagnosis)),
        known=" ".join(known_sentences(diagnosis)),
        tables=tuple(table for table in tables if table is not None),
        explained=(_LOG_SCORE, *((_SHIFT,) if diagnosis.is_refitted else ())),
        model=shown_model(diagnosis),
        notes=tuple(remarks(diagnosis)),
        known_effects=known_table(diagnosis.known),
        candidates=candidates_table(diagnosis),
        recommendation=diagnosis.recommendation,
    )


def quoted(summary: Summary, diagnosis: Diagnosis | None) -> Summary:
    """A summary with the constants that are to be quoted, and the errors of the fit that they stand for.

    After a diagnosis the constants are the averaged ones, and the errors those of the first fit unless one model was
    named, be it in part.
    """
    if diagnosis is None:
        return summary
    is_after = diagnosis.verdict == "named" or diagnosis.named_in_part
    errors = diagnosis.after if is_after else diagnosis.before
    return replace(
        summary,
        elastic=Elastic(**diagnosis.elastic_averaged),
        rigidity=Rigidity(**diagnosis.rigidity_averaged),
        error=replace(
            summary.error,
            in_sample_rms_cents=errors.in_sample_rms_cents,
            leave_one_out_rms_cents=errors.leave_one_out_rms_cents,
        ),
        carrying_modes=diagnosis.carrying_modes,
    )


def quoted_constants(summary: Summary, diagnosis: Diagnosis | None) -> Table:
    what = "" if diagnosis is None else f", {what_is_quoted(diagnosis)}"
    return compared_constants(quoted(summary, diagnosis), f"Elastic constants{what}, GPa")


def short_sentences(summary: Summary, diagnosis: Diagnosis | None) -> list[str]:
    """The first lines of a page: the constants to quote, what they are, and how far the frequencies are missed."""
    first, *others = summary_sentences(quoted(summary, diagnosis))
    what = "" if diagnosis is None else headline_sentence(diagnosis)
    return [first, *([what] if what else []), *others]


def page_warnings(summary: Summary, diagnosis: Diagnosis | None) -> list[str]:
    """What stands beneath them: doubts of the diagnosis, then those of the fit."""
    return list(dict.fromkeys([*(warnings(diagnosis) if diagnosis is not None else []), *summary.warnings]))
