"""The verdict: one of five words, by rules that are the same for every board."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bayesplate.diagnosis.hypotheses import RELABELLING, are_stated
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult
from bayesplate.diagnosis.sensitivity import variant_searches
from bayesplate.diagnosis.sizes import size_at_limit
from bayesplate.effects.words import effect_name, effect_names, join_words

VerdictWord = Literal["none needed", "named", "indistinguishable group", "unexplained", "undetectable"]

CLEAR_FACTOR = 3.0
"""How many times more probable the best must be than the next to be named, and a pair than its better member."""
ALTERNATIVE_FACTOR = 10.0
"""Alternatives up to this factor below the best are listed with it."""
_MOST_RIVALS = 3
"""Rivals that are listed where an explanation does not stand out under another assumption."""

NO_MODE_TO_JUDGE_BY = "three modes determine the three constants and leave nothing to judge by"
NO_MODE_TO_JUDGE_BY_OF_ISOTROPIC = "one mode determines the one constant and leaves nothing to judge by"


@dataclass(frozen=True)
class Explanation:
    """An explanation of a residual: a single effect, a pair or an exchange of labels, with its support."""

    members: tuple[str, ...]
    index: int  # of its hypothesis
    support: float  # its probability, with that of pairs which are hardly more probable than this effect alone


@dataclass(frozen=True)
class Verdict:
    """The verdict on a set of readings, and its reason."""

    word: VerdictWord
    effects: tuple[str, ...]  # named: all of them are present. Group: each is an alternative.
    index: int  # hypothesis to refit; 0 if the model stays as it is
    best: Explanation | None  # the most probable explanation, whatever the verdict
    reason: str
    is_needed: bool = False  # whether the odds against no effect are larger than the null simulations leave to chance
    # the explanation that is named, or the alternatives of a group, the most probable first
    explanations: tuple[Explanation, ...] = ()

    @property
    def nearest(self) -> Explanation | None:
        """The best explanation of an "unexplained" verdict; None where no effect is needed or one is named."""
        return self.best if self.word == "unexplained" and self.is_needed else None

    @property
    def judged_index(self) -> int:
        """Index of the hypothesis judged beside that of no effect: that of the best refitted explanation, or 0."""
        return self.refitted_explanations[0].index if self.refitted_explanations else 0

    @property
    def refitted_explanations(self) -> tuple[Explanation, ...]:
        """Explanations to refit: those of the verdict, or the nearest."""
        return self.explanations if self.nearest is None else (self.nearest,)


def rank_explanations(result: SearchResult) -> tuple[Explanation, ...]:
    """Explanations by their support, best first.

    A pair is an explanation of its own only if it is three times as probable as its better effect alone, or if its
    effects are known ones that the card states; otherwise the better effect gets its probability.
    """
    support: dict[int, float] = {}
    board = result.ground.baseline.board
    singles = {
        hypothesis.members[0]: i
        for i, hypothesis in enumerate(result.ground.hypotheses)
        if len(hypothesis.members) == 1 and not hypothesis.swap
    }
    swaps = [i for i, hypothesis in enumerate(result.ground.hypotheses) if hypothesis.swap]
    for i in (*singles.values(), *swaps):
        support[i] = float(result.probability[i])
    for i, hypothesis in enumerate(result.ground.hypotheses):
        if len(hypothesis.members) != 2:
            continue
        better = max((singles[name] for name in hypothesis.members), key=lambda j: float(result.probability[j]))
        share = float(result.probability[i])
        if share >= CLEAR_FACTOR * float(result.probability[better]) or are_stated(board, hypothesis.members):
            support[i] = share
        else:
            support[better] += share
    explanations = [Explanation(result.ground.hypotheses[i].members, i, value) for i, value in support.items()]
    return tuple(sorted(explanations, key=lambda explanation: -explanation.support))


def decide_verdict(
    result: SearchResult, control: NullControl, variants: Iterable[tuple[str, SearchResult]] | None = None
) -> Verdict:
    """The verdict on one set of readings, with the null simulations of the same search.

    An explanation is named only if it stands out in the `variants` too, searches with the words of their assumptions;
    by default those of `variant_searches`, which are run only if it stands out in the first.
    """
    explanations = rank_explanations(result)
    best = explanations[0] if explanations else None
    if not result.ground.n_directions:
        is_isotropic = result.ground.baseline.board.isotropic
        return Verdict(
            "undetectable", (), 0, best, NO_MODE_TO_JUDGE_BY_OF_ISOTROPIC if is_isotropic else NO_MODE_TO_JUDGE_BY
        )
    if best is None or result.log_odds <= control.needed_from:
        return _verdict_without_effect(result, best)
    p_value = result.p_value(best.index)
    if p_value < LEAST_P_VALUE:
        reason = f"with {explanation_words(result, best)} the misfit is still too large ({p_value_words(p_value)})"
        return Verdict("unexplained", (), 0, best, reason, is_needed=True)
    limit = size_at_limit(result, best.index)
    if limit:
        reason = f"{explanation_words(result, best)} fits only at the limit of its range: {limit}"
        return Verdict("unexplained", (), 0, best, reason, is_needed=True)
    contenders = alternatives(result, explanations)
    if stands_out(best, explanations):
        rivalry = find_rivals(result, best, variant_searches(result) if variants is None else variants)
        if not rivalry:
            reason = (
                f"{explanation_words(result, best)} has no rival within a factor 3 under any assumption that was tried"
            )
            return Verdict("named", best.members, best.index, best, reason, True, (best,))
        words, rivals = rivalry
        reason = f"{words} {alternatives_words(result, rivals)} comes within a factor 3 of it"
        contenders = (best, *rivals)
    else:
        reason = "no explanation is three times as probable as every other"
    effects = tuple(dict.fromkeys(name for explanation in contenders for name in explanation.members))
    return Verdict("indistinguishable group", effects, best.index, best, reason, True, contenders)


def stands_out(explanation: Explanation, explanations: Sequence[Explanation]) -> bool:
    """Whether an explanation is three times as probable as every other one."""
    return all(
        explanation.support >= CLEAR_FACTOR * other.support
        for other in explanations
        if other.index != explanation.index
    )


def find_rivals(
    result: SearchResult, best: Explanation, variants: Iterable[tuple[str, SearchResult]]
) -> tuple[str, tuple[Explanation, ...]] | None:
    """The first assumption under which an explanation no longer stands out, and its rivals there; None if it always
    does.

    Rivals have the support of the first search.
    """
    usual_explanations = {explanation.index: explanation for explanation in rank_explanations(result)}
    for words, other in variants:
        other_explanations = {explanation.index: explanation for explanation in rank_explanations(other)}
        own_explanation = other_explanations.get(best.index, Explanation(best.members, best.index, 0.0))
        rivals = [
            explanation
            for explanation in other_explanations.values()
            if explanation.index != best.index and explanation.support * CLEAR_FACTOR > own_explanation.support
        ]
        if rivals:
            strongest = sorted(rivals, key=lambda explanation: -explanation.support)[:_MOST_RIVALS]
            return words, tuple(usual_explanations.get(explanation.index, explanation) for explanation in strongest)
    return None


def _verdict_without_effect(result: SearchResult, best: Explanation | None) -> Verdict:
    """The verdict where no effect is probable enough: the bare model fits, effects are undetectable, or the misfit is
    unexplained."""
    p_value = result.p_value(0)
    if p_value < LEAST_P_VALUE:
        reason = f"the misfit is too large for the noise ({p_value_words(p_value)}), but no effect is probable enough"
        return Verdict("unexplained", (), 0, best, reason)
    all_hidden = all(candidate.signature.is_below_detection_limit for candidate in result.ground.candidates.values())
    if result.ground.candidates and all_hidden:
        return Verdict("undetectable", (), 0, best, "every effect is below what these readings could show")
    return Verdict("none needed", (), 0, best, f"the misfit is what the noise would leave ({p_value_words(p_value)})")


def explanation_words(result: SearchResult, explanation: Explanation) -> str:
    """An explanation in words: its effects, or the labels that it exchanges."""
    swap = result.ground.hypotheses[explanation.index].swap
    if swap is None:
        return effect_names(explanation.members)
    return f"{effect_name(RELABELLING)} {swap.words(result.ground.baseline)}"


def alternatives_words(result: SearchResult, explanations: Sequence[Explanation]) -> str:
    """Alternative explanations in words; the two effects of a pair stay together."""
    words = [explanation_words(result, explanation) for explanation in explanations]
    return (
        ", or ".join(words)
        if any(len(explanation.members) > 1 for explanation in explanations)
        else join_words(words, "or")
    )


def p_value_words(p_value: float) -> str:
    """A p-value with three decimals, or "p < 0.001"."""
    return f"p = {p_value:.3f}" if p_value >= 0.001 else "p < 0.001"


def alternatives(result: SearchResult, explanations: Sequence[Explanation]) -> tuple[Explanation, ...]:
    """Explanations within a factor ten of the best."""
    return tuple(
        explanation
        for explanation in explanations
        if explanation.support * ALTERNATIVE_FACTOR >= explanations[0].support
    )
