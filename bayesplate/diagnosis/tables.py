"""The tables of a diagnosis: terminal, page, notebook, CSV and LaTeX show the same ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesplate.board.parameter import unit_of_people
from bayesplate.diagnosis.known_words import known_table
from bayesplate.diagnosis.result import Amplitude, Diagnosis, EffectEntry, Finalist
from bayesplate.diagnosis.words import (
    CONDITIONS,
    MERITS,
    VERDICTS,
    known_sentences,
    names_of,
    verdict_sentences,
    warnings,
)
from bayesplate.effects.words import effect_name, effect_names
from bayesplate.results.contract import Spread
from bayesplate.results.fit_tables import write_tables
from bayesplate.results.folder import BEFORE_AFTER, KNOWN_EFFECTS
from bayesplate.results.tables import Cell, Row, Table, by_constant, constants_table, notebook
from bayesplate.results.words import GPA, Value, decimals, interval, is_isotropic, number, percent, plus_minus, rounded

_WORTH_A_ROW = 0.01
_UNLIKELY = 0.01
"""Probability below which an exchange of two labels is not worth showing: any two neighbours are a candidate."""
_NINETY = 1.645
"""Standard deviations from the middle of a normal distribution to the ends of its 90 % interval."""
_NARROW = ("effect", "shift", "visible", "size (90 %)", "fate")


def every_table(diagnosis: Diagnosis) -> tuple[Table, ...]:
    """The tables of a terminal or a notebook, the constants to quote first."""
    tables = (
        averaged_table(diagnosis),
        known_table(diagnosis.known),
        answers_table(diagnosis),
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
        title, columns = "Error", {"as it is": diagnosis.before}
    rows: list[Row] = [(one.title, *(one.shown(one.of(errors)) for errors in columns.values())) for one in MERITS]
    return Table(f"{title}: {diagnosis.name}", ("", *columns), tuple(rows))


def claim_table(diagnosis: Diagnosis) -> Table | None:
    """Each condition of the claim that the error is reduced; None where nothing was added."""
    if not diagnosis.conditions:
        return None
    rows = []
    for one in diagnosis.conditions:
        words = CONDITIONS[one.name]
        wanted = words.wanted.format(limit=words.shown(one.limit))
        found = str(words.shown(one.value))
        if one.name == "chance selection" and diagnosis.null_control.nested_ratio_percentile is not None:
            found += f", smaller than on {diagnosis.null_control.nested_ratio_percentile:.0f} % of them"
        rows.append((words.title, found, wanted, "yes" if one.is_met else "no"))
    return Table(
        "May a lower error be claimed? Only if every condition is met", ("", "found", "wanted", "met"), tuple(rows)
    )


def shift_table(diagnosis: Diagnosis) -> Table | None:
    """Each modulus before and after; None where nothing was added."""
    if not diagnosis.is_refitted:
        return None
    return by_constant(
        f"Shift of the constants by {diagnosis.refitted_words}, GPa",
        {
            "before": lambda name: _shifted(diagnosis, name)[0],
            "after": lambda name: _shifted(diagnosis, name)[1],
            "shift, sd": lambda name: _shifted(diagnosis, name)[2],
        },
        isotropic=is_isotropic(diagnosis.elastic_averaged),
    )


def _shifted(diagnosis: Diagnosis, name: str) -> tuple[Value, Value, Value]:
    """A modulus before and after, GPa, and the shift in standard deviations."""
    one = diagnosis.elastic_shift[name]
    digits = decimals(0.01 * one.before * GPA)
    before, after = (number(value, digits, factor=GPA) for value in (one.before, one.after))
    return before, after, number(one.shift_in_sd, 1, signed=True)


def what_is_quoted(diagnosis: Diagnosis) -> str:
    """What the constants are that a diagnosis shows, as it stands after a comma."""
    if diagnosis.verdict == "unexplained":
        return "of the model that does not explain the readings"
    return "averaged over all explanations by their probability"


def averaged_table(diagnosis: Diagnosis) -> Table:
    """The moduli to quote."""
    every = diagnosis.elastic_averaged
    title = f"The constants, {what_is_quoted(diagnosis)}, GPa"
    return constants_table(title, every, isotropic=is_isotropic(every))


def answers_table(diagnosis: Diagnosis) -> Table:
    """Every explanation that is worth a row, none of them, and the rest: probabilities that sum to one as printed."""
    shown = [one for one in diagnosis.answers if one.probability >= _WORTH_A_ROW or one.is_stated]
    named = [("nothing is lacking", diagnosis.probability_of_none), *((one.words, one.probability) for one in shown)]
    rest = len(diagnosis.answers) - len(shown)
    if rest:
        left = max(1.0 - sum(share for _, share in named), 0.0)
        named.append((f"any of {rest} others" if rest > 1 else "one other", left))
    printed = _summing([share for _, share in named])
    rows = tuple((words, share) for (words, _), share in zip(named, printed, strict=True))
    return Table("What may be the case", ("explanation", "probability"), rows)


def sizes_table(diagnosis: Diagnosis) -> Table | None:
    """Every size of every explanation that was fitted again, named where there are several; None if none was."""
    rows: list[Row] = []
    are_several = len(diagnosis.finalists) > 1
    for one in diagnosis.finalists:
        explanation = (effect_names(one.effects),) if are_several else ()
        for owner, effect, parameter, spread, factor, unit in _every_size(one):
            where, after = "" if owner == "board" else f", {owner}", f" {unit}" * bool(unit)
            range_ = None if spread.sd == 0.0 else interval(spread, factor, after)
            rows.append((*explanation, f"{effect}{where}", parameter, plus_minus(spread, factor, after), range_))
    columns = (*(["fitted with"] if are_several else []), "effect", "size", "mean ± sd", "90 % interval")
    return Table("Sizes of what was fitted again", columns, tuple(rows)) if rows else None


def candidates_table(diagnosis: Diagnosis, *, narrow: bool = False) -> Table | None:
    """Candidates, the most probable first, and why each was rejected; narrow for a terminal. None if there are none."""
    likely = (
        one for one in diagnosis.candidates if isinstance(one, EffectEntry) or one.inclusion_probability >= _UNLIKELY
    )
    shown = sorted(likely, key=lambda one: -one.inclusion_probability)
    if not shown:
        return None
    every: list[dict[str, Cell]] = [
        {
            "effect": name,
            "shift": number(one.raw_rms_cents, 1),
            "visible": number(one.visible_rms_cents, 1),
            "E_x / E_y / G_xy off by, %": _bias(one.bias_percent),
            "inclusion probability": percent(one.inclusion_probability, 1),
            "size (90 %)": _size(one.amplitude),
            "looks like": ", ".join(map(effect_name, one.look_alikes)) or None,
            "rejected because": one.rejected_because or None,
            "fate": one.fate,
        }
        for name, one in zip(names_of(shown), shown, strict=True)
    ]
    columns = _NARROW if narrow else tuple(column for column in every[0] if column != "fate")
    title = "Candidates at their usual size: shift of the modes, rms cents, and what of it shows"
    return Table(title, columns, tuple(tuple(cells[column] for column in columns) for cells in every))


def _summing(shares: Sequence[float]) -> list[str]:
    """Shares in per cent that sum to a hundred as they are printed: the last tenths go to the largest rests."""
    thousandths = [int(1000.0 * share) for share in shares]
    by_rest = sorted(range(len(shares)), key=lambda i: thousandths[i] - 1000.0 * shares[i])
    for i in by_rest[: 1000 - sum(thousandths)]:
        thousandths[i] += 1
    return [f"{one / 10.0:.1f} %" for one in thousandths]


def _bias(bias: Mapping[str, float] | None) -> str | None:
    return None if bias is None else " / ".join(str(number(value, 1, signed=True)) for value in bias.values())


def _size(amplitude: Amplitude | None) -> str | None:
    if amplitude is None:
        return None
    factor, unit = unit_of_people(amplitude.unit)
    every = (amplitude.q05, amplitude.q50, amplitude.q95)
    spread = min((gap for gap in np.diff(every) if gap > 0.0), default=0.0) / _NINETY  # of the narrower side
    texts = (rounded(factor * value, factor * spread)[0] for value in every)
    low, middle, high = (text.replace("\N{NARROW NO-BREAK SPACE}", "") for text in texts)  # a line may end there
    range_ = " (fixed)" if amplitude.q05 == amplitude.q95 else f" ({low} to {high})"
    return f"{amplitude.parameter} {middle} {unit}".rstrip() + range_


def before_after_table(diagnosis: Diagnosis) -> Table:
    """Errors, moduli in GPa and sizes of what was added; without an addition there is no after."""
    rows: list[Row] = [
        (one.title, one.shown(one.of(diagnosis.before)), one.shown(one.of(diagnosis.after)), None, None)
        for one in MERITS
    ]
    for name, one in diagnosis.elastic_averaged.items():
        rows.append((f"{name}, GPa", *_shifted(diagnosis, name), plus_minus(one, GPA)))
    title = f"Before and after; verdict: {diagnosis.verdict}"
    columns = ("", "before", "after", "shift, sd", "averaged")
    keys = ("quantity", "before", "after", "shift_in_sd", "averaged")
    for added in (one for one in diagnosis.finalists if one.effects == diagnosis.refitted):
        for owner, effect, parameter, spread, factor, unit in _every_size(added):
            words = f"{effect} {parameter}, {owner}" + f", {unit}" * bool(unit)
            rows.append((words, None, number(spread.mean, decimals(spread.sd * factor), factor=factor), None, None))
    kept = range(len(columns)) if diagnosis.is_refitted else (0, 1, 4)
    cells = tuple(tuple(row[i] for i in kept) for row in rows)
    return Table(title, tuple(columns[i] for i in kept), cells, tuple(keys[i] for i in kept))


def _every_size(one: Finalist) -> Iterator[tuple[str, str, str, Spread, float, str]]:
    """Board or setup, effect in words, parameter and spread of each size, with the factor and the unit of people."""
    for owner, effects in one.sizes.items():
        for effect, parameters in effects.items():
            for parameter, spread in parameters.items():
                yield owner, effect_name(effect), parameter, spread, *unit_of_people(spread.unit)


def write_diagnosis_tables(folder: Path, diagnosis: Diagnosis, title: str) -> tuple[Path, ...]:
    """Write errors and constants before and after, and known effects where there are any, as CSV and LaTeX."""
    written: tuple[Path, ...] = ()
    for names, table in ((BEFORE_AFTER, before_after_table(diagnosis)), (KNOWN_EFFECTS, known_table(diagnosis.known))):
        if table is not None:
            told = replace(table, title=f"{table.title}; {title}")
            written += write_tables(folder, names, table, told)
    return written


def html(diagnosis: Diagnosis) -> str:
    """A diagnosis as a notebook shows it: heading, sentences, tables, and what to measure next."""
    advice = [f"What to measure next: {diagnosis.recommendation}"] if diagnosis.recommendation else []
    sentences = [*verdict_sentences(diagnosis), *known_sentences(diagnosis), *warnings(diagnosis), *advice]
    heading = f"{diagnosis.name}: {VERDICTS[diagnosis.verdict].heading}"
    return notebook(heading, sentences, every_table(diagnosis))
