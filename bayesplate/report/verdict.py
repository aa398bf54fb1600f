"""The diagnosis section of a page: verdict, errors before and after, candidates, next measurement."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

from bayesplate.diagnosis.known_words import known_table
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.tables import (
    candidates_table,
    claim_table,
    errors_table,
    explanations_table,
    quoted_constants_words,
    shift_table,
    sizes_table,
)
from bayesplate.diagnosis.words import (
    VERDICTS,
    headline_sentence,
    known_sentences,
    reason_and_notes,
    shown_model_sentence,
    verdict_heading,
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
    """The diagnosis section of the page, without its pictures."""
    tables = (
        explanations_table(diagnosis),
        errors_table(diagnosis),
        claim_table(diagnosis),
        shift_table(diagnosis),
        sizes_table(diagnosis),
    )
    return SimpleNamespace(
        heading=verdict_heading(diagnosis),
        # every possible verdict, its meaning, and whether it was given
        verdicts=tuple((word, verdict.heading, word == diagnosis.verdict) for word, verdict in VERDICTS.items()),
        sentences=tuple(verdict_sentences(diagnosis)),
        known=" ".join(known_sentences(diagnosis)),
        tables=tuple(table for table in tables if table is not None),
        explained=(_LOG_SCORE, *((_SHIFT,) if diagnosis.is_refitted else ())),
        model=shown_model_sentence(diagnosis),
        notes=tuple(reason_and_notes(diagnosis)),
        known_effects=known_table(diagnosis.known),
        candidates=candidates_table(diagnosis),
        recommendation=diagnosis.recommendation,
    )


def quoted_summary(summary: Summary, diagnosis: Diagnosis | None) -> Summary:
    """A summary with the constants to quote and the errors that belong to them.

    After a diagnosis the constants are averaged over the hypotheses, and the errors are those of the first fit unless
    the verdict names a model, be it in part.
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
    subject = "" if diagnosis is None else f", {quoted_constants_words(diagnosis)}"
    return compared_constants(quoted_summary(summary, diagnosis), f"Elastic constants{subject}, GPa")


def short_sentences(summary: Summary, diagnosis: Diagnosis | None) -> list[str]:
    """The first lines of a page: the constants to quote, their meaning, and the errors of the frequencies."""
    first, *others = summary_sentences(quoted_summary(summary, diagnosis))
    headline = "" if diagnosis is None else headline_sentence(diagnosis)
    return [first, *([headline] if headline else []), *others]


def page_warnings(summary: Summary, diagnosis: Diagnosis | None) -> list[str]:
    """The warnings of a page: those of the diagnosis, then those of the fit."""
    return list(dict.fromkeys([*(warnings(diagnosis) if diagnosis is not None else []), *summary.warnings]))
