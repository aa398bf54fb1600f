"""The tables of a diagnosis, the same in terminal, page, notebook, CSV and LaTeX."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesplate.board.parameter import display_unit
from bayesplate.diagnosis.known_words import known_table
from bayesplate.diagnosis.result import Amplitude, Diagnosis, EffectEntry, Finalist
from bayesplate.diagnosis.words import (
    CONDITIONS,
    MERITS,
    candidate_names,
    known_sentences,
    verdict_heading,
    verdict_sentences,
    warnings,
)
from bayesplate.effects.words import effect_name, effect_names
from bayesplate.results.contract import Spread
from bayesplate.results.fit_tables import write_tables
from bayesplate.results.folder import BEFORE_AFTER_FILES, KNOWN_EFFECTS_FILES
from bayesplate.results.tables import Cell, Row, Table, constants_table, notebook_html, table_by_constant
from bayesplate.results.words import (
    GPA,
    Value,
    decimals,
    interval,
    is_isotropic,
    number,
    percent,
    plus_minus,
    rounded_texts,
)

_LEAST_LISTED = 0.01
"""Probability below which an explanation or an exchange of two labels is not listed."""
_SD_TO_90_PERCENT = 1.645
"""Standard deviations from the middle of a normal distribution to the ends of its 90 % interval."""
_NARROW_COLUMNS = ("effect", "shift", "visible", "size (90 %)", "fate")


def every_table(diagnosis: Diagnosis) -> tuple[Table, ...]:
    """The tables of a terminal or a notebook, the constants to quote first."""
    tables = (
        averaged_table(diagnosis),
        known_table(diagnosis.known),
        explanations_table(diagnosis),
        errors_table(diagnosis),
        claim_table(diagnosis),
        shift_table(diagnosis),
        sizes_table(diagnosis),
        candidates_table(diagnosis, narrow=True),
    )
    return tuple(table for table in tables if table is not None)


def errors_table(diagnosis: Diagnosis) -> Table:
    """Every figure of merit, before and after where something was added."""
    if diagnosis.is_refitted:
        title = "Error before and after"
        columns = {"before": diagnosis.before, f"after: {diagnosis.refitted_words}": diagnosis.after}
    else:
        title, columns = "Error of the fit", {"as it is": diagnosis.before}
    rows: list[Row] = [
        (merit.title, *(merit.formatted(merit.value_of(errors)) for errors in columns.values())) for merit in MERITS
    ]
    return Table(f"{title}: {diagnosis.name}", ("", *columns), tuple(rows))


def claim_table(diagnosis: Diagnosis) -> Table | None:
    """Each condition of the claim that the error is reduced; None where nothing was added."""
    if not diagnosis.conditions:
        return None
    rows = []
    for condition in diagnosis.conditions:
        words = CONDITIONS[condition.name]
        requirement = words.requirement.format(limit=words.formatted(condition.limit))
        value = str(words.formatted(condition.value))
        if condition.name == "chance selection" and diagnosis.null_control.nested_ratio_percentile is not None:
            value += f", smaller than on {diagnosis.null_control.nested_ratio_percentile:.0f} % of them"
        rows.append((words.title, value, requirement, "yes" if condition.is_met else "no"))
    return Table(
        "May a lower error be claimed? Only if every condition is met", ("", "found", "wanted", "met"), tuple(rows)
    )


def shift_table(diagnosis: Diagnosis) -> Table | None:
    """Each modulus before and after; None where nothing was added."""
    if not diagnosis.is_refitted:
        return None
    return table_by_constant(
        f"Shift of the constants by {diagnosis.refitted_words}, GPa",
        {
            "before": lambda name: _modulus_shift(diagnosis, name)[0],
            "after": lambda name: _modulus_shift(diagnosis, name)[1],
            "shift, sd": lambda name: _modulus_shift(diagnosis, name)[2],
        },
        isotropic=is_isotropic(diagnosis.elastic_averaged),
    )


def _modulus_shift(diagnosis: Diagnosis, name: str) -> tuple[Value, Value, Value]:
    """A modulus before and after, GPa, and the shift in standard deviations."""
    shift = diagnosis.elastic_shift[name]
    digits = decimals(0.01 * shift.before * GPA)
    before, after = (number(value, digits, factor=GPA) for value in (shift.before, shift.after))
    return before, after, number(shift.shift_in_sd, 1, signed=True)


def quoted_constants_words(diagnosis: Diagnosis) -> str:
    """Which constants a diagnosis shows, in words that follow a comma."""
    if diagnosis.verdict == "unexplained":
        return "of the model that does not explain the readings"
    return "averaged over all explanations by their probability"


def averaged_table(diagnosis: Diagnosis) -> Table:
    """The moduli to quote."""
    constants = diagnosis.elastic_averaged
    title = f"The constants, {quoted_constants_words(diagnosis)}, GPa"
    return constants_table(title, constants, isotropic=is_isotropic(constants))


def explanations_table(diagnosis: Diagnosis) -> Table:
    """No effect, the probable explanations and the rest: probabilities that sum to one as printed."""
    listed_explanations = [
        explanation
        for explanation in diagnosis.explanations
        if explanation.probability >= _LEAST_LISTED or explanation.is_stated
    ]
    probabilities = [
        ("nothing is lacking", diagnosis.probability_of_none),
        *((explanation.words, explanation.probability) for explanation in listed_explanations),
    ]
    n_rest = len(diagnosis.explanations) - len(listed_explanations)
    if n_rest:
        rest_share = max(1.0 - sum(share for _, share in probabilities), 0.0)
        probabilities.append((f"any of {n_rest} others" if n_rest > 1 else "one other", rest_share))
    percentages = _percentages([share for _, share in probabilities])
    rows = tuple((words, share) for (words, _), share in zip(probabilities, percentages, strict=True))
    is_unexplained = diagnosis.verdict == "unexplained"
    title = "What was tried; none of it is a probable explanation" if is_unexplained else "What may be the case"
    return Table(title, ("explanation", "probability"), rows)


def sizes_table(diagnosis: Diagnosis) -> Table | None:
    """The sizes of each explanation that was fitted again, with its effects where there are several; None without
    sizes."""
    rows: list[Row] = []
    are_several = len(diagnosis.finalists) > 1
    for finalist in diagnosis.finalists:
        explanation = (effect_names(finalist.effects),) if are_several else ()
        for owner, effect, parameter, spread, factor, unit in _every_size(finalist):
            place, unit_words = "" if owner == "board" else f", {owner}", f" {unit}" * bool(unit)
            range_ = None if spread.sd == 0.0 else interval(spread, factor, unit_words)
            rows.append((*explanation, f"{effect}{place}", parameter, plus_minus(spread, factor, unit_words), range_))
    columns = (*(["fitted with"] if are_several else []), "effect", "size", "mean ± sd", "90 % interval")
    return Table("Sizes of what was fitted again", columns, tuple(rows)) if rows else None


def candidates_table(diagnosis: Diagnosis, *, narrow: bool = False) -> Table | None:
    """Candidates, the most probable first, and why each was rejected; narrow for a terminal. None if there are none."""
    likely_candidates = (
        candidate
        for candidate in diagnosis.candidates
        if isinstance(candidate, EffectEntry) or candidate.inclusion_probability >= _LEAST_LISTED
    )
    listed_candidates = sorted(likely_candidates, key=lambda candidate: -candidate.inclusion_probability)
    if not listed_candidates:
        return None
    rows: list[dict[str, Cell]] = [
        {
            "effect": name,
            "shift": number(candidate.raw_rms_cents, 1),
            "visible": number(candidate.visible_rms_cents, 1),
            "E_x / E_y / G_xy off by, %": _bias_words(candidate.bias_percent),
            "inclusion probability": percent(candidate.inclusion_probability, 1),
            "size (90 %)": _size_words(candidate.amplitude),
            "looks like": ", ".join(map(effect_name, candidate.look_alikes)) or None,
            "rejected because": candidate.rejected_because or None,
            "fate": candidate.fate,
        }
        for name, candidate in zip(candidate_names(listed_candidates), listed_candidates, strict=True)
    ]
    columns = _NARROW_COLUMNS if narrow else tuple(column for column in rows[0] if column != "fate")
    title = "Candidates at their usual size: shift of the modes, rms cents, and what of it shows"
    return Table(title, columns, tuple(tuple(cells[column] for column in columns) for cells in rows))


def _percentages(shares: Sequence[float]) -> list[str]:
    """Shares in percent that sum to 100 as printed: the last tenths go to the shares with the largest remainders."""
    thousandths = [int(1000.0 * share) for share in shares]
    by_rest = sorted(range(len(shares)), key=lambda i: thousandths[i] - 1000.0 * shares[i])
    for i in by_rest[: 1000 - sum(thousandths)]:
        thousandths[i] += 1
    return [f"{count / 10.0:.1f} %" for count in thousandths]


def _bias_words(bias: Mapping[str, float] | None) -> str | None:
    return None if bias is None else " / ".join(str(number(value, 1, signed=True)) for value in bias.values())


def _size_words(amplitude: Amplitude | None) -> str | None:
    if amplitude is None:
        return None
    factor, unit = display_unit(amplitude.unit)
    quantiles = (amplitude.q05, amplitude.q50, amplitude.q95)
    spread = (
        min((gap for gap in np.diff(quantiles) if gap > 0.0), default=0.0) / _SD_TO_90_PERCENT
    )  # of the narrower side
    texts = (rounded_texts(factor * value, factor * spread)[0] for value in quantiles)
    low, middle, high = (text.replace("\N{NARROW NO-BREAK SPACE}", "") for text in texts)  # a line may end there
    range_ = " (fixed)" if amplitude.q05 == amplitude.q95 else f" ({low} to {high})"
    return f"{amplitude.parameter} {middle} {unit}".rstrip() + f"{range_} {amplitude.form}".rstrip()


def before_after_table(diagnosis: Diagnosis) -> Table:
    """Errors, moduli in GPa and sizes of the added effects; without an added effect there is no column after."""
    rows: list[Row] = [
        (
            merit.title,
            merit.formatted(merit.value_of(diagnosis.before)),
            merit.formatted(merit.value_of(diagnosis.after)),
            None,
            None,
        )
        for merit in MERITS
    ]
    for name, averaged in diagnosis.elastic_averaged.items():
        rows.append((f"{name}, GPa", *_modulus_shift(diagnosis, name), plus_minus(averaged, GPA)))
    title = f"Before and after; verdict: {diagnosis.verdict}"
    columns = ("", "before", "after", "shift, sd", "averaged")
    keys = ("quantity", "before", "after", "shift_in_sd", "averaged")
    for finalist in (finalist for finalist in diagnosis.finalists if finalist.effects == diagnosis.refitted):
        for owner, effect, parameter, spread, factor, unit in _every_size(finalist):
            words = f"{effect} {parameter}, {owner}" + f", {unit}" * bool(unit)
            rows.append((words, None, number(spread.mean, decimals(spread.sd * factor), factor=factor), None, None))
    shown_columns = range(len(columns)) if diagnosis.is_refitted else (0, 1, 4)
    cells = tuple(tuple(row[i] for i in shown_columns) for row in rows)
    return Table(title, tuple(columns[i] for i in shown_columns), cells, tuple(keys[i] for i in shown_columns))


def _every_size(finalist: Finalist) -> Iterator[tuple[str, str, str, Spread, float, str]]:
    """Board or setup, effect in words, parameter and spread of each size, with the factor to its display unit."""
    for owner, effects in finalist.sizes.items():
        for effect, parameters in effects.items():
            for parameter, spread in parameters.items():
                words = f"{effect_name(effect)} {finalist.forms.get(effect, '')}".rstrip()
                yield owner, words, parameter, spread, *display_unit(spread.unit)


def write_diagnosis_tables(folder: Path, diagnosis: Diagnosis, title: str) -> tuple[Path, ...]:
    """Write errors and constants before and after, and known effects where there are any, as CSV and LaTeX."""
    written: tuple[Path, ...] = ()
    for names, table in (
        (BEFORE_AFTER_FILES, before_after_table(diagnosis)),
        (KNOWN_EFFECTS_FILES, known_table(diagnosis.known)),
    ):
        if table is not None:
            titled_table = replace(table, title=f"{table.title}; {title}")
            written += write_tables(folder, names, table, titled_table)
    return written


def diagnosis_html(diagnosis: Diagnosis) -> str:
    """A diagnosis as HTML for a notebook: heading, sentences, tables, and what to measure next."""
    advice = [f"What to measure next: {diagnosis.recommendation}"] if diagnosis.recommendation else []
    sentences = [*verdict_sentences(diagnosis), *known_sentences(diagnosis), *warnings(diagnosis), *advice]
    heading = f"{diagnosis.name}: {verdict_heading(diagnosis)}"
    return notebook_html(heading, sentences, every_table(diagnosis))
