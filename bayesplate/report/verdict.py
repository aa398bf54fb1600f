"""What a page says of a diagnosis: the verdict in plain words, candidates, error before and after, what to do next."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

from bayesplate.effects.words import effect_name, joined
from bayesplate.report.signatures import candidate_name, has_several_setups, is_refitted, worth_showing
from bayesplate.report.words import effect_sentence
from bayesplate.results.exports import ERROR_WORDS
from bayesplate.results.tables import Table
from bayesplate.results.words import GPA, MISSING, interval, number, percent, plus_minus

HEADINGS = {
    "none needed": "These readings need no further effect",
    "named": "An effect was found",
    "indistinguishable group": "Something is missing, but not which of several",
    "unexplained": "Something is missing that was not found",
    "undetectable": "These readings could not show it",
}
_WORDS = {
    "none needed": (
        "The readings differ from those of an ideal plate by no more than their noise would make them. No effect is "
        "needed to explain them, which does not prove that there is none."
    ),
    "unexplained": (
        "The readings disagree with the ideal plate by more than their noise, and no effect that was tried explains "
        "it. Check the labels, the sizes and the mass first; then look at the largest errors below."
    ),
    "undetectable": (
        "The effects that may act here would hide in the constants or in the noise: these readings could not show them "
        "even if they were there. The constants below hold only if none of them is."
    ),
}


def verdict_sentences(diagnosis: Mapping[str, Any]) -> list[str]:
    """The verdict, what it names, and whether the error is claimed to be reduced."""
    word = diagnosis["verdict"]
    names = [effect_name(str(name)) for name in diagnosis.get("effects") or ()]
    if word == "named":
        sentences = [f"The readings point to {joined(names)}.", *_explained(diagnosis)]
    elif word == "indistinguishable group":
        told = f"One of these would explain the readings, but the readings cannot tell which: {joined(names, 'or')}."
        sentences = [told, *_explained(diagnosis)]
    else:
        sentences = [_WORDS.get(word, f"Verdict: {word}.")]
    return [*sentences, *_included(diagnosis), *_claim(diagnosis)]


def _included(diagnosis: Mapping[str, Any]) -> list[str]:
    """Which effects the constants on the page take into account, where the diagnosis says it."""
    names = [effect_name(str(name)) for name in diagnosis.get("refitted") or ()]
    if names:
        return [f"The constants below take {joined(names)} into account."]
    if diagnosis.get("effects"):
        return ["The constants below are those of the ideal plate."] if "refitted" in diagnosis else []
    return []


def _explained(diagnosis: Mapping[str, Any]) -> list[str]:
    found = [effect_sentence(str(name)) for name in diagnosis.get("effects") or ()]
    return [sentence for sentence in found if sentence]


def _claim(diagnosis: Mapping[str, Any]) -> list[str]:
    """Whether the error is reduced, and how the gain compares with chance."""
    if not is_refitted(diagnosis):
        return []
    share = diagnosis.get("gain_null_percentile")
    of_boards = "of simulated boards without any effect"
    chance = "" if share is None else f": the gain is larger than on {share:.0f} % {of_boards}"
    if diagnosis.get("claim"):
        return [f"The error of the prediction is reduced{chance}."]
    return [f"The error changes by no more than chance selection may give{chance}. No improvement is claimed."]


def diagnosis_section(diagnosis: Mapping[str, Any]) -> dict[str, Any]:
    """Everything the page shows of a diagnosis besides its pictures.

    Parameters
    ----------
    diagnosis : dict
        As in diagnosis.json.

    Returns
    -------
    dict
        heading, sentences, tables (error before and after, shift of the constants), candidates, recommendation.
    """
    tables = [before_after_table(diagnosis), shift_table(diagnosis), averaged_table(diagnosis)]
    recommendation = diagnosis.get("recommendation") or ()
    likely = diagnosis.get("probability_of_none")
    told = "" if likely is None else f"Probability that no effect of the library is at work: {percent(likely)}."
    return {
        "heading": HEADINGS.get(diagnosis["verdict"], diagnosis["verdict"]),
        "sentences": verdict_sentences(diagnosis),
        "tables": [table for table in tables if table is not None],
        "notes": [str(note) for note in (told, diagnosis.get("reason") or "", *(diagnosis.get("notes") or ())) if note],
        "candidates": candidates_table(diagnosis),
        "recommendation": [recommendation] if isinstance(recommendation, str) else [str(one) for one in recommendation],
    }


def before_after_table(diagnosis: Mapping[str, Any]) -> Table | None:
    """Every figure of merit, before and after where something was added; None where there is none."""
    before, after = diagnosis.get("before"), diagnosis.get("after")
    if not before:
        return None
    columns = {"before": before, "after": after} if after and is_refitted(diagnosis) else {"as it is": before}
    rows = tuple(
        (words, *(_merit(name, entry.get(name)) for entry in columns.values()))
        for name, words in ERROR_WORDS.items()
        if any(name in entry for entry in columns.values())
    )
    title = "Error before and after" if len(columns) > 1 else "Error"
    return Table(title, ("", *columns), rows)


def _merit(name: str, value: Any) -> str:
    if value is None:
        return MISSING
    if name == "hits_90":
        return percent(value) if isinstance(value, float) and value <= 1 else str(value)
    return number(float(value), 1 if name.endswith("cents") else 2)


def shift_table(diagnosis: Mapping[str, Any]) -> Table | None:
    """The constants before and after; None if they are not given."""
    shifts = diagnosis.get("elastic_shift")
    if not shifts or not is_refitted(diagnosis):
        return None
    rows = tuple(
        (
            name,
            _constant(one.get("before")),
            _constant(one.get("after")),
            number(one.get("shift_in_sd"), 1, signed=True),
        )
        for name, one in shifts.items()
    )
    return Table("Shift of the constants, GPa", ("constant", "before", "after", "shift, sd"), rows)


def averaged_table(diagnosis: Mapping[str, Any]) -> Table | None:
    """The constants averaged over every model that was weighed; None if they are not given."""
    averaged = diagnosis.get("elastic_averaged")
    if not averaged:
        return None
    spreads = ((name, SimpleNamespace(**one)) for name, one in averaged.items())
    rows = tuple((name, plus_minus(one, GPA), interval(one, GPA)) for name, one in spreads)
    title = "The constants if any of the effects may be there, each by its probability, GPa"
    return Table(title, ("constant", "mean ± sd", "90 % interval"), rows)


def _constant(value: Any) -> str:
    """A modulus, alone or with its sd."""
    if value is None:
        return MISSING
    if isinstance(value, Mapping):
        sd = value.get("sd")
        return f"{value['mean'] * GPA:.3f}" + ("" if sd is None else f" ± {sd * GPA:.3f}")
    return f"{float(value) * GPA:.3f}"


def candidates_table(diagnosis: Mapping[str, Any]) -> Table | None:
    """Every candidate with what it would do, how probable it is, and why it was rejected."""
    candidates = worth_showing(diagnosis)
    if not candidates:
        return None
    several = has_several_setups(candidates)
    rows = tuple(
        (
            candidate_name(one, several),
            f"{number(one.get('raw_rms_cents'), 0)} / {number(one.get('visible_rms_cents'), 1)}",
            _bias(one.get("bias_percent")),
            percent(one.get("inclusion_probability")),
            _amplitude(one.get("amplitude")),
            ", ".join(effect_name(str(name)) for name in one.get("look_alikes") or ()) or MISSING,
            str(one.get("rejected_because") or MISSING),
        )
        for one in candidates
    )
    columns = (
        "effect", "shift / visible, cents", "E_x / E_y / G_xy off by, %", "probability", "size (90 %)", "looks like",
        "rejected because",
    )  # fmt: skip
    return Table("Candidates", columns, rows)


def _bias(bias: Mapping[str, float] | None) -> str:
    if not bias:
        return MISSING
    return " / ".join(number(bias.get(name), 1, signed=True) for name in ("E_x", "E_y", "G_xy"))


def _amplitude(amplitude: Mapping[str, Any] | None) -> str:
    if not amplitude or amplitude.get("q50") is None:
        return MISSING
    unit = "" if amplitude.get("unit") in (None, "1") else f" {amplitude['unit']}"
    return f"{amplitude['q50']:.3g} ({amplitude['q05']:.3g} to {amplitude['q95']:.3g}){unit}"
