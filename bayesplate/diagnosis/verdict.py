"""The verdict: one of five words, by rules that are the same for every board."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bayesplate.diagnosis.hypotheses import RELABELLING, are_stated
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import PASSES, SearchResult
from bayesplate.diagnosis.sensitivity import variants
from bayesplate.diagnosis.sizes import at_limit
from bayesplate.effects.words import effect_name, effect_names, joined

Word = Literal["none needed", "named", "indistinguishable group", "unexplained", "undetectable"]

CLEARLY = 3.0
"""How many times more probable the best must be than the next to be named, and a pair than its better member."""
WITHIN = 10.0
"""Alternatives up to this factor below the best are listed with it."""
_MOST_RIVALS = 3
"""Of a name that does not survive another assumption: the best there are told."""

NOTHING_LEFT = "three modes determine the three constants and leave nothing to judge by"
NOTHING_LEFT_OF_ONE = "one mode determines the one constant and leaves nothing to judge by"


@dataclass(frozen=True)
class Answer:
    """One way to explain a residual: a single effect or a pair, with the support that it has."""

    members: tuple[str, ...]
    index: int  # of its hypothesis
    support: float  # its probability, and that of pairs that say little more than it


@dataclass(frozen=True)
class Verdict:
    """What the readings allow to say."""

    word: Word
    effects: tuple[str, ...]  # named: all of them are present. Group: each is an alternative.
    index: int  # hypothesis to refit; 0 if the model stays as it is
    best: Answer | None  # the most probable answer, whatever the verdict
    reason: str
    is_needed: bool = False  # whether the odds against no effect are larger than the null simulations leave to chance
    # the one that is named, or the alternatives of a group, the most probable first
    stands_for: tuple[Answer, ...] = ()

    @property
    def nearest(self) -> Answer | None:
        """The answer that explains the readings best and yet not well enough; None where there is no such thing."""
        return self.best if self.word == "unexplained" and self.is_needed else None

    @property
    def tried(self) -> int:
        """Hypothesis that is judged beside that of no effect: the best of those that are fitted again, or 0."""
        return self.fitted_again[0].index if self.fitted_again else 0

    @property
    def fitted_again(self) -> tuple[Answer, ...]:
        """Answers to fit again: those that the verdict stands for, or the nearest one."""
        return self.stands_for if self.nearest is None else (self.nearest,)


def answers(found: SearchResult) -> tuple[Answer, ...]:
    """Single effects and pairs by their support, best first.

    A pair stands for itself only if it is three times as probable as its better member alone, or if its members are
    known ones that the card states; otherwise it says no more than that member, which gets its probability.
    """
    support: dict[int, float] = {}
    board = found.ground.baseline.board
    singles = {
        one.members[0]: i for i, one in enumerate(found.ground.hypotheses) if len(one.members) == 1 and not one.swap
    }
    swaps = [i for i, one in enumerate(found.ground.hypotheses) if one.swap]
    for i in (*singles.values(), *swaps):
        support[i] = float(found.probability[i])
    for i, one in enumerate(found.ground.hypotheses):
        if len(one.members) != 2:
            continue
        better = max((singles[name] for name in one.members), key=lambda j: float(found.probability[j]))
        share = float(found.probability[i])
        if share >= CLEARLY * float(found.probability[better]) or are_stated(board, one.members):
            support[i] = share
        else:
            support[better] += share
    listed = [Answer(found.ground.hypotheses[i].members, i, value) for i, value in support.items()]
    return tuple(sorted(listed, key=lambda answer: -answer.support))


def decide(
    found: SearchResult, control: NullControl, others: Iterable[tuple[str, SearchResult]] | None = None
) -> Verdict:
    """The verdict on one set of readings, by what the search makes of boards without any effect.

    A name has to survive other searches, each with what is assumed there; by default those of `variants`, made only if
    there is a name.
    """
    ranked = answers(found)
    best = ranked[0] if ranked else None
    if not found.ground.n_directions:
        is_one = found.ground.baseline.board.isotropic
        return Verdict("undetectable", (), 0, best, NOTHING_LEFT_OF_ONE if is_one else NOTHING_LEFT)
    if best is None or found.against_none <= control.needed_from:
        return _without(found, best)
    passed = found.p_value(best.index)
    if passed < PASSES:
        reason = f"with {answer_words(found, best)} the misfit is still too large ({p_words(passed)})"
        return Verdict("unexplained", (), 0, best, reason, is_needed=True)
    limit = at_limit(found, best.index)
    if limit:
        reason = f"{answer_words(found, best)} fits only at the limit of its range: {limit}"
        return Verdict("unexplained", (), 0, best, reason, is_needed=True)
    near = alternatives(found, ranked)
    if stands_out(best, ranked):
        changed = turned(found, best, variants(found) if others is None else others)
        if not changed:
            reason = f"{answer_words(found, best)} has no rival within a factor 3, whatever is assumed"
            return Verdict("named", best.members, best.index, best, reason, True, (best,))
        words, rivals = changed
        reason = f"{words} {alternatives_words(found, rivals)} may be as probable"
        near = (best, *rivals)
    else:
        reason = "several explanations are about equally probable"
    group = tuple(dict.fromkeys(name for one in near for name in one.members))
    return Verdict("indistinguishable group", group, best.index, best, reason, True, near)


def stands_out(one: Answer, ranked: Sequence[Answer]) -> bool:
    """Whether an answer is three times as probable as every other one."""
    return all(one.support >= CLEARLY * other.support for other in ranked if other.index != one.index)


def turned(
    found: SearchResult, best: Answer, others: Iterable[tuple[str, SearchResult]]
) -> tuple[str, tuple[Answer, ...]] | None:
    """The first assumption under which a name no longer stands out, and what rivals it there; None if it always does.

    A rival is told with the probability that it has without the change.
    """
    usual = {one.index: one for one in answers(found)}
    for words, other in others:
        there = {one.index: one for one in answers(other)}
        own = there.get(best.index, Answer(best.members, best.index, 0.0))
        rivals = [one for one in there.values() if one.index != best.index and one.support * CLEARLY > own.support]
        if rivals:
            first = sorted(rivals, key=lambda one: -one.support)[:_MOST_RIVALS]
            return words, tuple(usual.get(one.index, one) for one in first)
    return None


def _without(found: SearchResult, best: Answer | None) -> Verdict:
    """No effect is probable enough: the bare model passes, cannot be questioned, or fails without a reason."""
    passed = found.p_value(0)
    if passed < PASSES:
        reason = f"the misfit is too large for the noise ({p_words(passed)}), but no effect is probable enough"
        return Verdict("unexplained", (), 0, best, reason)
    hidden = all(one.signature.is_below_detection_limit for one in found.ground.candidates.values())
    if found.ground.candidates and hidden:
        return Verdict("undetectable", (), 0, best, "every effect is below what these readings could show")
    return Verdict("none needed", (), 0, best, f"the misfit is what the noise would leave ({p_words(passed)})")


def answer_words(found: SearchResult, answer: Answer) -> str:
    """An answer in words: its effects, or the labels that it exchanges."""
    swap = found.ground.hypotheses[answer.index].swap
    if swap is None:
        return effect_names(answer.members)
    return f"{effect_name(RELABELLING)} {swap.words(found.ground.baseline)}"


def alternatives_words(found: SearchResult, told: Sequence[Answer]) -> str:
    """Alternative answers in words; the two effects of a pair stay together."""
    words = [answer_words(found, one) for one in told]
    return ", or ".join(words) if any(len(one.members) > 1 for one in told) else joined(words, "or")


def p_words(p_value: float) -> str:
    """A p-value with three decimals, or as smaller than they show."""
    return f"p = {p_value:.3f}" if p_value >= 0.001 else "p < 0.001"


def alternatives(found: SearchResult, ranked: Sequence[Answer]) -> tuple[Answer, ...]:
    """Answers within a factor ten of the best."""
    return tuple(one for one in ranked if one.support * WITHIN >= ranked[0].support)
