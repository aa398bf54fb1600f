"""The words for verdicts, errors and candidates, each written once: terminal, page, figures and files share them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from bayesplate.diagnosis.candidates import CandidateEntry, ExchangeEntry
from bayesplate.diagnosis.claim import ConditionName
from bayesplate.diagnosis.result import Diagnosis, Errors
from bayesplate.diagnosis.verdict import Word
from bayesplate.effects.words import effect_name, effect_names, joined
from bayesplate.results.words import Value, number, percent

TOO_FEW = "the readings are too few to choose anew without each of them"
NONE_LEFT = "hardly a mode is left that does not carry a constant or a size alone"
_UNLIKELY = 0.01
"""Probability below which an exchange of two labels is not worth showing: any two neighbours are a candidate."""


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
    Merit("left out, search and all", lambda errors: errors.nested_leave_one_out_rms_cents, _cents, True),
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
        """A number of it as people read it."""
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
    old, new = (f"{value:.0f}" if min(before, after) >= 10.0 else f"{value:.1f}" for value in (before, after))
    name = "left-out error" if len(rms) > 1 else "error in the fit"
    if old == new:
        return f"{name} stayed at {new} cents", False
    return f"{name} {'fell' if after < before else 'rose'} from {old} to {new} cents", after < before


def worth_showing(diagnosis: Diagnosis) -> tuple[CandidateEntry, ...]:
    """Every effect, and of the exchanged labels those that are not out of the question."""
    return tuple(
        one
        for one in diagnosis.candidates
        if not isinstance(one, ExchangeEntry) or one.inclusion_probability >= _UNLIKELY
    )


def candidate_name(one: CandidateEntry, several: bool) -> str:
    """Name of a candidate; with its setup where there are several, with the labels that it would exchange."""
    name = effect_name(one.name)
    if isinstance(one, ExchangeEntry):
        name += f" {' and '.join(one.labels)}"
    return f"{name}, {one.setup}" if several else name


def has_several_setups(candidates: Iterable[CandidateEntry]) -> bool:
    """Whether candidates act in different setups, so that their names must say in which."""
    return len({one.setup for one in candidates} - {"board"}) > 1


def names_of(candidates: Sequence[CandidateEntry]) -> list[str]:
    """Names of candidates that stand together in a table or a figure."""
    several = has_several_setups(candidates)
    return [candidate_name(one, several) for one in candidates]
