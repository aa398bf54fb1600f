"""A diagnosis in words and tables that people read; text only, no layout."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bayesplate.effects.words import effect_name, effect_names
from bayesplate.results.tables import Table
from bayesplate.results.words import decimals

_GPA = 1e9
_MEANING = {
    "none needed": "Nothing is lacking that these readings could show",
    "undetectable": "These readings could not show any of the effects, even if they were there",
    "unexplained": "The model misses something, and none of the known effects explains it",
}
_ERRORS = (
    ("in_sample_rms_cents", "error in sample, cents"),
    ("leave_one_out_rms_cents", "error left out, cents"),
    ("nested_leave_one_out_rms_cents", "error left out, effect chosen anew, cents"),
)


def verdict_sentence(diagnosis: Mapping[str, Any]) -> str:
    """The verdict, its reason, and whether a lower error may be claimed."""
    word, effects = diagnosis["verdict"], diagnosis["effects"]
    if word == "named":
        meaning = f"The readings name {effect_names(effects)}"
    elif word == "indistinguishable group":
        meaning = f"The readings ask for one of {effect_names(effects, 'or')}, and cannot tell which"
    else:
        meaning = _MEANING[word]
    sentence = f"Verdict: {word}. {meaning}: {diagnosis['reason']}."
    if diagnosis["refitted"]:
        sentence += (
            " The error is reduced beyond what chance selection gives."
            if diagnosis["claim"]
            else " The change of the error is within what chance selection gives."
        )
    return sentence


def errors_table(diagnosis: Mapping[str, Any]) -> Table:
    """The errors before and after; the second column repeats the first where nothing was added."""
    before, after = diagnosis["before"], diagnosis["after"]
    rows = [(words, _cents(before[key]), _cents(after[key])) for key, words in _ERRORS]
    rows.append(("log score, left out", _cents(before["log_score"]), _cents(after["log_score"])))
    rows.append(("readings within the 90 % band", f"{before['hits_90']:.0%}", f"{after['hits_90']:.0%}"))
    added = effect_names(diagnosis["refitted"]) if diagnosis["refitted"] else "nothing added"
    return Table(f"Error of {diagnosis['name']} before and after", ("", "before", f"after: {added}"), tuple(rows))


def shift_table(diagnosis: Mapping[str, Any]) -> Table:
    """Each constant before and after, GPa."""
    rows = []
    for name, entry in diagnosis["elastic_shift"].items():
        digits = decimals(0.01 * entry["before"] / _GPA)
        before, after = (f"{entry[key] / _GPA:.{digits}f}" for key in ("before", "after"))
        rows.append((name, before, after, f"{entry['shift_in_sd']:+.1f}"))
    return Table("Elastic constants, GPa", ("constant", "before", "after", "shift, sd"), tuple(rows))


def candidates_table(diagnosis: Mapping[str, Any]) -> Table:
    """Every candidate: what it would do, what of it shows, how probable it is, and why it was rejected."""
    ordered = sorted(diagnosis["candidates"], key=lambda one: -one["inclusion_probability"])
    rows = [
        (
            effect_name(one["name"]) + (f" {' / '.join(one['labels'])}" if "labels" in one else ""),
            _cents(one["raw_rms_cents"]),
            _cents(one["visible_rms_cents"]),
            f"{one['inclusion_probability']:.3f}",
            _size(one["amplitude"]),
            _fate(one, diagnosis),
        )
        for one in ordered
    ]
    return Table(
        "Candidates: shift of the frequencies at nominal size, rms in cents, and what of it shows",
        ("effect", "raw", "visible", "probable", "size, 90 %", "fate"),
        tuple(rows),
    )


def _fate(one: Mapping[str, Any], diagnosis: Mapping[str, Any]) -> str:
    """The reason of a rejection in two words; diagnosis.json has the sentence."""
    if one["rejected_because"] is None:
        return "in the verdict"
    if one.get("below_sight"):
        return "below sight"
    return "not needed" if diagnosis["verdict"] in ("none needed", "undetectable") else "less probable"


def _size(amplitude: Mapping[str, Any] | None) -> str:
    if amplitude is None:
        return ""
    unit = "" if amplitude["unit"] == "1" else f" {amplitude['unit']}"
    return f"{amplitude['parameter']} {amplitude['q05']:.3g} to {amplitude['q95']:.3g}{unit}"


def _cents(value: float | None) -> str:
    return "" if value is None else f"{value:.1f}"
