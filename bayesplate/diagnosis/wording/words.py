"""The words for verdicts, errors and candidates, each written once: terminal, page, figures and files share them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from bayesplate.diagnosis.decision.verdict import Word
from bayesplate.diagnosis.wording.candidates import CandidateEntry, ExchangeEntry
from bayesplate.diagnosis.wording.diagnosis import Diagnosis, Errors
from bayesplate.effects.words import effect_name, effect_names

MISSING = "–"
_UNLIKELY = 0.01
"""Probability below which an exchange of two labels is not worth showing: any two neighbours are a candidate."""


@dataclass(frozen=True)
class Meaning:
    """A verdict in plain words: a heading, and what it means; {and} and {or} stand for the effects as a list."""

    heading: str
    sentence: str


VERDICTS: dict[Word, Meaning] = {
    "none needed": Meaning(
        "These readings need no further effect",
        "The readings differ from those of an ideal plate by no more than their noise would make them. No effect is "
        "needed to explain them, which does not prove that there is none.",
    ),
    "named": Meaning("An effect was found", "The readings point to {and}."),
    "indistinguishable group": Meaning(
        "Something is missing, but not which of several",
        "One of these would explain the readings, but the readings cannot tell which: {or}.",
    ),
    "unexplained": Meaning(
        "Something is missing that was not found",
        "The readings disagree with the ideal plate by more than their noise, and no effect that was tried explains "
        "it. Check the labels, the sizes and the mass first; then look at the largest errors.",
    ),
    "undetectable": Meaning(
        "These readings could not show it",
        "The effects that may act here would hide in the constants or in the noise: these readings could not show them "
        "even if they were there. The constants hold only if none of them is.",
    ),
}


@dataclass(frozen=True)
class Merit:
    """A figure of merit.

    Attributes
    ----------
    words : str
    of : callable
        Takes it from the errors of a model.
    shown : callable
        The number as people read it.
    is_rms : bool
        Whether it is an error, rms cents, so that it can be drawn beside the others.
    """

    words: str
    of: Callable[[Errors], float | None]
    shown: Callable[[float], str]
    is_rms: bool = False

    @property
    def title(self) -> str:
        """The words as a row of a table has them."""
        return f"error {self.words}, rms cents" if self.is_rms else self.words


MERITS = (
    Merit("in the fit", lambda errors: errors.in_sample_rms_cents, "{:.1f}".format, True),
    Merit("of a mode left out", lambda errors: errors.leave_one_out_rms_cents, "{:.1f}".format, True),
    Merit("left out, search and all", lambda errors: errors.nested_leave_one_out_rms_cents, "{:.1f}".format, True),
    Merit("log score", lambda errors: errors.log_score, "{:.2f}".format),
    Merit("readings inside their 90 % intervals", lambda errors: errors.hits_90, lambda share: f"{100 * share:.0f} %"),
)
"""In the order of the tables: the first falls with every effect that is added, the third is the honest one."""


def meaning(diagnosis: Diagnosis) -> str:
    """What the verdict means, with the effects that it names."""
    lists = {"and": effect_names(diagnosis.effects), "or": effect_names(diagnosis.effects, "or")}
    return VERDICTS[diagnosis.verdict].sentence.format_map(lists)


def claim_sentence(diagnosis: Diagnosis) -> str:
    """Whether the error is reduced, and how the gain compares with chance; empty where nothing was added."""
    if not diagnosis.is_refitted:
        return ""
    share = diagnosis.gain_null_percentile
    of_boards = "of simulated boards without any effect"
    chance = "" if share is None else f": the gain is larger than on {share:.0f} % {of_boards}"
    if diagnosis.claim:
        return f"The error of the prediction is reduced{chance}."
    return f"The error changes by no more than chance selection may give{chance}. No improvement is claimed."


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
