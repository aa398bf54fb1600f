"""A diagnosis in words and sentences, each written once: terminal, page, figures and files share them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.claim import ConditionName
from bayesplate.diagnosis.known_words import known_sentence, stated_sentence
from bayesplate.diagnosis.result import CandidateEntry, Diagnosis, EffectEntry, Errors, ExchangeEntry
from bayesplate.diagnosis.signatures import LOOK_ALIKE
from bayesplate.diagnosis.verdict import Word
from bayesplate.effects.words import effect_name, effect_names, joined
from bayesplate.estimates.leave_one_out import carrying_sentence
from bayesplate.labels import Label
from bayesplate.results.words import Value, cents_alike, number, percent

TOO_FEW = "the readings are too few to choose anew without each of them"
NONE_LEFT = "hardly a mode is left that does not carry a constant or a size alone"


@dataclass(frozen=True)
class Meaning:
    """A verdict in plain words: a heading, and what it means.

    {effects} stands for what it names, {model} for the one before, {further} for that some effects are declared.
    """

    heading: str
    sentence: str


VERDICTS: dict[Word, Meaning] = {
    "none needed": Meaning(
        "These readings need no further effect",
        "The readings differ from those of {model} by no more than their noise would make them. No {further}effect is "
        "needed to explain them, which does not prove that there is none.",
    ),
    "named": Meaning("An effect was found", "The readings point to {effects}."),
    "indistinguishable group": Meaning(
        "Something is missing, but not which of several",
        "One of these would explain the readings, but the readings cannot tell which: {effects}.",
    ),
    "unexplained": Meaning(
        "Something is missing that was not found",
        "The readings disagree with the model by more than their noise, and no effect that was tried explains "
        "it. Check the labels, the sizes and the mass first; then look at the largest errors.",
    ),
    "undetectable": Meaning(
        "These readings could not show it",
        "The effects that may act here would hide in the constants or in the noise: these readings could not show them "
        "even if they were there. The constants hold only if none of them is.",
    ),
}

_AVERAGED = "The table of the constants is of the averaged ones; all else below is of"
IN_PART = "Part of what is missing was found"
"""The heading where a verdict names something in part."""


@dataclass(frozen=True)
class Merit:
    """A figure of merit."""

    words: str
    of: Callable[[Errors], float | None]
    shown: Callable[[float | None], Value]
    is_rms: bool = False  # whether it is an error, rms cents, so that it can be drawn beside the others

    @property
    def title(self) -> str:
        """The words as a row of a table has them."""
        return f"error {self.words}, rms cents" if self.is_rms else self.words


def _cents(value: float | None) -> Value:
    return number(value, 1)


MERITS = (
    Merit("in the fit", lambda errors: errors.in_sample_rms_cents, _cents, True),
    Merit("of a mode left out", lambda errors: errors.leave_one_out_rms_cents, _cents, True),
    Merit("left out, the search repeated", lambda errors: errors.nested_leave_one_out_rms_cents, _cents, True),
    Merit("log score", lambda errors: errors.log_score, lambda value: number(value, 2)),
    Merit("readings inside their 90 % intervals", lambda errors: errors.hits_90, percent),
)
"""In the order of the tables: the first falls with every effect that is added, the third is the honest one."""


def meaning(diagnosis: Diagnosis) -> str:
    """What the verdict means, with the effects that it names."""
    declared = effect_names(diagnosis.declared)
    model, further = ("an ideal plate", "") if not declared else (f"a plate with {declared}", "further ")
    words = {"effects": diagnosis.words, "model": model, "further": further}
    return VERDICTS[diagnosis.verdict].sentence.format_map(words)


def claim_sentence(diagnosis: Diagnosis) -> str:
    """How the left-out error changed, beside chance, and what is claimed; empty where nothing was added."""
    if not diagnosis.is_refitted:
        return ""
    change, is_gain = _change(diagnosis)
    if diagnosis.named_in_part:
        return f"The {change}. No improvement is claimed: the misfit that is left is too large."
    if not is_gain:
        return f"The {change}. No improvement is claimed."
    if diagnosis.claim:
        return f"The error of the prediction is reduced: the {change}, and every condition of that claim is met."
    missed = [
        (NONE_LEFT if diagnosis.carrying_modes else TOO_FEW) if one.value is None else CONDITIONS[one.name].lacking
        for one in diagnosis.conditions
        if not one.is_met
    ]
    return f"The {change}. No improvement is claimed: {joined(list(dict.fromkeys(missed)))}."


@dataclass(frozen=True)
class ConditionWords:
    """A condition of the claim in words: what it asks for, what to say where it is not met, and its numbers."""

    title: str
    wanted: str
    lacking: str
    digits: int = 2

    def shown(self, value: float | None) -> Value:
        return number(value, self.digits)


CONDITIONS: dict[ConditionName, ConditionWords] = {
    "chance selection": ConditionWords(
        "left-out error after over before",
        "below {limit}, what 95 of 100 simulated boards without any effect stay above",
        "an effect chosen by chance may lower the left-out error as much",
    ),
    "log score": ConditionWords(
        "gain in log score of readings left out",
        "above {limit}, two standard errors",
        "the readings left out are not predicted better beyond two standard errors",
    ),
    "probability of none": ConditionWords(
        "probability that nothing is lacking, at its largest with the sizes' priors halved or doubled",
        "below {limit}",
        "the probability that nothing is lacking is too large",
        3,
    ),
    "probability of another": ConditionWords(
        "probability of what is not named here, at its largest with the sizes' priors halved or doubled",
        "below {limit}",
        "the probability of another effect is too large",
        3,
    ),
    "prior predictive": ConditionWords(
        "p-value of the misfit that is left", "at least {limit}", "the misfit that is left is too large", 3
    ),
}


def _change(diagnosis: Diagnosis) -> tuple[str, bool]:
    """The change of the most honest error that both models have, in words, and whether it is a gain."""
    rms = [one for one in MERITS if one.is_rms and None not in (one.of(diagnosis.before), one.of(diagnosis.after))]
    before, after = (rms[-1].of(errors) or 0.0 for errors in (diagnosis.before, diagnosis.after))
    old, new = cents_alike(before, after)
    name = "left-out error" if len(rms) > 1 else "error in the fit"
    if old == new:
        return f"{name} stayed at {new} cents", False
    return f"{name} {'fell' if after < before else 'rose'} from {old} to {new} cents", after < before


def names_of(candidates: Sequence[CandidateEntry]) -> list[str]:
    """Names of candidates that stand together, with the labels that one would exchange, and the setup among several."""
    are_several = len({one.setup for one in candidates} - {"board"}) > 1
    labels = [f" {' and '.join(one.labels)}" if isinstance(one, ExchangeEntry) else "" for one in candidates]
    setups = [f", {one.setup}" if are_several else "" for one in candidates]
    return [
        f"{effect_name(one.name)}{each}{where}" for one, each, where in zip(candidates, labels, setups, strict=True)
    ]


def carrying_words(diagnosis: Diagnosis) -> str:
    """Which modes alone carry a constant or a size, and so count in no left-out error; empty where none does."""
    told = carrying_sentence(diagnosis.carrying_modes)
    if not told:
        return ""
    before, after = (one.leave_one_out_rms_cents for one in (diagnosis.before, diagnosis.after))
    no_more = "" if None not in (before, after) else "; no mode is left to judge by, and nothing can be claimed"
    return f"{told[0].upper()}{told[1:]}, before and after alike{no_more}."


def in_part_sentence(diagnosis: Diagnosis) -> str:
    """What explains the readings in part, and that something else remains; empty where nothing does."""
    if not diagnosis.named_in_part:
        return ""
    return f"Named in part: {diagnosis.in_part_words}; something else remains. The constants are not to be trusted."


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict, what it means, its reason, and whether a lower error may be claimed: the closing words of a run."""
    parts = (
        f"Verdict: {diagnosis.verdict}.",
        in_part_sentence(diagnosis),
        meaning(diagnosis),
        f"The reason: {diagnosis.reason}.",
        claim_sentence(diagnosis),
    )
    return " ".join(part for part in parts if part)


def verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict for a page: what it means, what each effect is, what else looks like it, and what may be claimed."""
    told = [
        in_part_sentence(diagnosis),
        meaning(diagnosis),
        *diagnosis.sentences,
        alike_sentence(diagnosis),
        claim_sentence(diagnosis),
        carrying_words(diagnosis),
    ]
    return [sentence for sentence in told if sentence]


def known_sentences(diagnosis: Diagnosis) -> list[str]:
    """What known effects do to the error, and what may be claimed of those that the card states."""
    told = (known_sentence(diagnosis.known), *map(stated_sentence, diagnosis.stated_claims))
    return [sentence for sentence in told if sentence]


def alike_sentence(diagnosis: Diagnosis) -> str:
    """Effects outside the verdict that look like the one that is named; empty if there are none."""
    if diagnosis.verdict != "named":
        return ""
    inside = [one for one in diagnosis.candidates if isinstance(one, EffectEntry) and one.name in diagnosis.effects]
    alike = dict.fromkeys(name for one in inside for name in one.look_alikes if name not in diagnosis.effects)
    if not alike:
        return ""
    return (
        f"{effect_names(list(alike)).capitalize()} would look much the same (likeness above {LOOK_ALIKE}): less than a "
        "third of the trace tells them apart."
    )


def shown_model(diagnosis: Diagnosis) -> str:
    """Which model the figures and tables below a verdict belong to; empty where it is the only one."""
    if not diagnosis.is_refitted:
        return "" if diagnosis.verdict == "unexplained" else f"{_AVERAGED} the fit without a further effect."
    model = f"the model with {diagnosis.refitted_words}"
    if diagnosis.named_in_part:
        return f"The constants and all else below are of {model}, which does not explain the readings either."
    told = f"{_AVERAGED} {model}"
    if diagnosis.verdict == "named":
        return f"{told}."
    return f"{told}, which is only one of the explanations. Quote the averaged constants."


def headline_sentence(diagnosis: Diagnosis) -> str:
    """What the constants that are shown first are."""
    if diagnosis.verdict == "unexplained":
        return ""
    return "These constants are averaged over everything that may be the case, each by its probability."


def warnings(diagnosis: Diagnosis) -> list[str]:
    """What a reader must know before using the constants."""
    if diagnosis.verdict != "unexplained":
        return list(diagnosis.notes)
    doubt = "The model does not explain the readings: the intervals of the constants are too narrow."
    return [doubt, *diagnosis.notes]


def remarks(diagnosis: Diagnosis) -> list[str]:
    """The reason of the verdict, and notes of the run."""
    return [f"The reason: {diagnosis.reason}.", *diagnosis.notes]


def relabelled_sentence(before: Board, after: Board, words: str) -> str:
    """Which peaks have another label in the model after than in the one before; empty where none has."""
    first, second = _labels(before), _labels(after)
    changed = []
    for key in sorted(first.keys() | second.keys(), key=lambda each: (each[0], each[1].mean)):
        one, other = first.get(key), second.get(key)
        if one != other:
            where = f" in setup {key[0]}" if len(before.setups) > 1 else ""
            instead = "no likely mode" if other is None else str(other)
            was = "had no likely mode" if one is None else f"was {one}"
            changed.append(f"{key[1].mean:.5g} Hz{where} is {instead} (it {was})")
    return f"With {words} some peaks are other modes: {joined(changed)}." if changed else ""


def _labels(board: Board) -> dict[tuple[str, Quantity], Label]:
    """Labels by setup and frequency of the peak."""
    return {(setup.name, reading.frequency): reading.label for setup in board.setups for reading in setup.readings}
