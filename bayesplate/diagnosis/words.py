"""The sentences of a diagnosis, each written once for terminal, page, figures and files."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.claim import ConditionName
from bayesplate.diagnosis.known_words import known_sentence, stated_sentence
from bayesplate.diagnosis.result import CandidateEntry, Diagnosis, EffectEntry, ExchangeEntry, ModelErrors
from bayesplate.diagnosis.signatures import LOOK_ALIKE_COSINE
from bayesplate.diagnosis.verdict import VerdictWord
from bayesplate.effects.words import as_sentence, effect_name, effect_names, join_words
from bayesplate.estimates.leave_one_out import carrying_sentence
from bayesplate.labels import Label
from bayesplate.results.summary import Summary
from bayesplate.results.words import Value, cents_texts, number, percent

TOO_FEW_MODES = "too few modes are left to choose anew without each of them"


@dataclass(frozen=True)
class VerdictMeaning:
    """A verdict in plain words: a heading, and what it means.

    {effects} stands for the effects of the verdict, {model} for the model before, {further} for "further " where the
    card declares effects.
    """

    heading: str
    sentence: str


VERDICTS: dict[VerdictWord, VerdictMeaning] = {
    "none needed": VerdictMeaning(
        "These readings need no further effect",
        "The readings differ from those of {model} by no more than their noise would make them. No {further}effect is "
        "needed to explain them, which does not prove that there is none.",
    ),
    "named": VerdictMeaning("An effect was found", "The readings point to {effects}."),
    "indistinguishable group": VerdictMeaning(
        "Something is missing, but not which of several",
        "One of these may be what is missing, but the readings cannot tell which: {effects}.",
    ),
    "unexplained": VerdictMeaning(
        "Something is missing that was not found",
        "The readings disagree with the model by more than their noise, and none of the effects that were tried is, at "
        "a possible size, a probable explanation. Check the labels, the sizes, the mass and the place of whatever is "
        "fixed to the board first; then look at the largest errors.",
    ),
    "undetectable": VerdictMeaning(
        "These readings could not show it",
        "The effects that may act here would hide in the constants or in the noise: these readings could not show them "
        "even if they were there. The constants hold only if none of them is.",
    ),
}

_AVERAGED_CONSTANTS = "The table of the constants is of the averaged ones; all else below is of"
IN_PART_HEADING = "Part of what is missing was found"
"""The heading where a verdict names something in part."""


@dataclass(frozen=True)
class FigureOfMerit:
    """A figure of merit."""

    words: str
    value_of: Callable[[ModelErrors], float | None]
    formatted: Callable[[float | None], Value]
    is_rms: bool = False  # whether it is an error, rms cents, so that it can be drawn beside the others

    @property
    def title(self) -> str:
        """The words as a row of a table has them."""
        return f"{self.words}, rms cents" if self.is_rms else self.words


def _cents(value: float | None) -> Value:
    return number(value, 1)


MERITS = (
    FigureOfMerit("error in the fit", lambda errors: errors.in_sample_rms_cents, _cents, True),
    FigureOfMerit("leave-one-out error", lambda errors: errors.leave_one_out_rms_cents, _cents, True),
    FigureOfMerit("nested leave-one-out error", lambda errors: errors.nested_leave_one_out_rms_cents, _cents, True),
    FigureOfMerit("log score", lambda errors: errors.log_score, lambda value: number(value, 2)),
    FigureOfMerit("readings inside their 90 % intervals", lambda errors: errors.hits_90, percent),
)
"""Figures of merit in the order of the tables: the first mostly falls with an effect, the third is the honest one."""


def verdict_heading(diagnosis: Diagnosis) -> str:
    return IN_PART_HEADING if diagnosis.named_in_part else VERDICTS[diagnosis.verdict].heading


def verdict_meaning(diagnosis: Diagnosis) -> str:
    """The meaning of the verdict in a sentence, with the effects that it names."""
    declared = effect_names(diagnosis.declared)
    model, further = ("an ideal plate", "") if not declared else (f"a plate with {declared}", "further ")
    words = {"effects": diagnosis.words, "model": model, "further": further}
    return VERDICTS[diagnosis.verdict].sentence.format_map(words)


def claim_sentence(diagnosis: Diagnosis) -> str:
    """The change of the leave-one-out error, and whether an improvement is claimed; empty where no effect was added."""
    if not diagnosis.is_refitted:
        return ""
    change, is_gain = _error_change(diagnosis)
    if diagnosis.named_in_part:
        return f"The {change}. No improvement is claimed: the misfit that is left is too large."
    if not is_gain:
        return f"The {change}. No improvement is claimed."
    if diagnosis.claim:
        return f"The error of the prediction is reduced: the {change}, and every condition of that claim is met."
    reasons = [
        TOO_FEW_MODES if condition.value is None else CONDITIONS[condition.name].failure
        for condition in diagnosis.conditions
        if not condition.is_met
    ]
    return f"The {change}. No improvement is claimed: {join_words(list(dict.fromkeys(reasons)))}."


@dataclass(frozen=True)
class ConditionWords:
    """A condition of the claim in words: its title, its requirement, and the reason where it is not met."""

    title: str
    requirement: str
    failure: str
    digits: int = 2

    def formatted(self, value: float | None) -> Value:
        return number(value, self.digits)


CONDITIONS: dict[ConditionName, ConditionWords] = {
    "chance selection": ConditionWords(
        "leave-one-out error after over before",
        "below {limit}, what 95 of 100 simulated boards without any effect stay above",
        "an effect chosen by chance may lower the leave-one-out error as much",
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


def _error_change(diagnosis: Diagnosis) -> tuple[str, bool]:
    """The change of the last rms error of `MERITS` that both models have, in words, and whether it is a gain."""
    merits = [
        merit
        for merit in MERITS
        if merit.is_rms and None not in (merit.value_of(diagnosis.before), merit.value_of(diagnosis.after))
    ]
    before, after = (merits[-1].value_of(errors) or 0.0 for errors in (diagnosis.before, diagnosis.after))
    old, new = cents_texts(before, after)
    if old == new and diagnosis.claim:
        old, new = f"{before:.2f}", f"{after:.2f}"
    if old == new:
        return f"{merits[-1].words} stayed at {new} cents", False
    return f"{merits[-1].words} {'fell' if after < before else 'rose'} from {old} to {new} cents", after < before


def candidate_names(candidates: Sequence[CandidateEntry]) -> list[str]:
    """Names of candidates in one list, with the labels of an exchange, and the setup where there are several."""
    are_several = len({candidate.setup for candidate in candidates} - {"board"}) > 1
    labels = [
        f" {' and '.join(candidate.labels)}" if isinstance(candidate, ExchangeEntry) else "" for candidate in candidates
    ]
    setups = [f", {candidate.setup}" if are_several else "" for candidate in candidates]
    return [
        f"{effect_name(candidate.name)}{label_words}{setup_words}"
        for candidate, label_words, setup_words in zip(candidates, labels, setups, strict=True)
    ]


def carrying_words(diagnosis: Diagnosis) -> str:
    """A sentence on the modes that alone carry a constant or a size: no leave-one-out error counts them."""
    sentence = carrying_sentence(diagnosis.carrying_modes)
    if not sentence:
        return ""
    before, after = (errors.leave_one_out_rms_cents for errors in (diagnosis.before, diagnosis.after))
    warning = "" if None not in (before, after) else "; no mode is left to judge by, and nothing can be claimed"
    return f"{sentence[0].upper()}{sentence[1:]}, before and after alike{warning}."


def in_part_sentence(diagnosis: Diagnosis) -> str:
    """A sentence on effects that explain the readings in part; empty where there are none."""
    if not diagnosis.named_in_part:
        return ""
    return f"Named in part: {diagnosis.in_part_words}; something else remains. The constants are not to be trusted."


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict, its meaning, its reason, and whether a lower error is claimed: the closing words of a run."""
    sentences = (
        f"Verdict: {diagnosis.verdict}.",
        in_part_sentence(diagnosis),
        verdict_meaning(diagnosis),
        f"The reason: {diagnosis.reason}.",
        claim_sentence(diagnosis),
    )
    return " ".join(sentence for sentence in sentences if sentence)


def verdict_sentences(diagnosis: Diagnosis) -> list[str]:
    """The verdict for a page: its meaning, its effects, their look-alikes, and whether a lower error is claimed."""
    sentences = [
        in_part_sentence(diagnosis),
        verdict_meaning(diagnosis),
        *diagnosis.sentences,
        alike_sentence(diagnosis),
        claim_sentence(diagnosis),
        carrying_words(diagnosis),
    ]
    return [sentence for sentence in sentences if sentence]


def known_sentences(diagnosis: Diagnosis) -> list[str]:
    """How known effects change the error, and whether a lower error is claimed of stated effects."""
    sentences = (known_sentence(diagnosis.known), *map(stated_sentence, diagnosis.stated_claims))
    return [sentence for sentence in sentences if sentence]


def alike_sentence(diagnosis: Diagnosis) -> str:
    """A sentence on effects outside the verdict that look like the named ones; empty if there are none."""
    if diagnosis.verdict != "named":
        return ""
    named_entries = [
        entry for entry in diagnosis.candidates if isinstance(entry, EffectEntry) and entry.name in diagnosis.effects
    ]
    look_alikes = dict.fromkeys(
        name for entry in named_entries for name in entry.look_alikes if name not in diagnosis.effects
    )
    if not look_alikes:
        return ""
    return (
        f"{as_sentence(effect_names(list(look_alikes)))} would look much the same (likeness above "
        f"{LOOK_ALIKE_COSINE}): less than a third of the visible part tells them apart."
    )


def shown_model_sentence(diagnosis: Diagnosis) -> str:
    """A sentence on the model of the figures and tables below a verdict; empty where it is the only model."""
    if not diagnosis.is_refitted:
        return "" if diagnosis.verdict == "unexplained" else f"{_AVERAGED_CONSTANTS} the fit without a further effect."
    model = f"the model with {diagnosis.refitted_words}"
    if diagnosis.named_in_part:
        return f"The constants and all else below are of {model}, which does not explain the readings either."
    sentence = f"{_AVERAGED_CONSTANTS} {model}"
    if diagnosis.verdict == "named":
        return f"{sentence}."
    return f"{sentence}, which is only one of the explanations. Quote the averaged constants."


def headline_sentence(diagnosis: Diagnosis) -> str:
    """A sentence on the constants that are shown first."""
    if diagnosis.verdict == "unexplained":
        return ""
    return "These constants are averaged over everything that may be the case, each by its probability."


def warnings(diagnosis: Diagnosis) -> list[str]:
    """Warnings to read before using the constants."""
    if diagnosis.verdict != "unexplained":
        return list(diagnosis.notes)
    doubt = "The model does not explain the readings: the intervals of the constants are too narrow."
    return [doubt, *diagnosis.notes]


def reason_and_notes(diagnosis: Diagnosis) -> list[str]:
    """The reason of the verdict, and notes of the run."""
    return [f"The reason: {diagnosis.reason}.", *diagnosis.notes]


def worse_fit_sentence(before: Summary, after: Summary, words: str) -> str:
    """A sentence on a fit with an effect that misses the readings by more than that without; empty if none does."""
    old, new = before.error.in_sample_rms_cents, after.error.in_sample_rms_cents
    if new <= old:
        return ""
    return (
        f"the fit with {words} misses the readings by {new:.1f} cents, that without by {old:.1f}: under it their "
        "labels look wrong, and it is left out"
    )


def relabelled_sentence(before: Board, after: Board, words: str) -> str:
    """A sentence on the peaks with another label in the model after than before; empty where there are none."""
    labels_before, labels_after = _labels(before), _labels(after)
    changed = []
    for key in sorted(labels_before.keys() | labels_after.keys(), key=lambda key: (key[0], key[1].mean)):
        old_label, new_label = labels_before.get(key), labels_after.get(key)
        if old_label != new_label:
            setup_words = f" in setup {key[0]}" if len(before.setups) > 1 else ""
            instead = "no likely mode" if new_label is None else str(new_label)
            was = "had no likely mode" if old_label is None else f"was {old_label}"
            changed.append(f"{key[1].mean:.5g} Hz{setup_words} is {instead} (it {was})")
    return f"With {words} some peaks are other modes: {join_words(changed)}." if changed else ""


def _labels(board: Board) -> dict[tuple[str, Quantity], Label]:
    """Labels by setup and frequency of the peak."""
    return {(setup.name, reading.frequency): reading.label for setup in board.setups for reading in setup.readings}
