"""The verdict: one of five words, by rules that are the same for every board."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.parameter import unit_of_people
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.evidence.draws import draw_terms, members_of, standard_sizes_of
from bayesplate.diagnosis.evidence.hypotheses import RELABELLING, are_stated
from bayesplate.diagnosis.evidence.null_control import NullControl
from bayesplate.diagnosis.evidence.predictive import PASSES
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.sensitivity import Variant, variants
from bayesplate.diagnosis.evidence.terms import normalised
from bayesplate.effects.words import effect_name, effect_names, joined

Floats = NDArray[np.float64]
Word = Literal["none needed", "named", "indistinguishable group", "unexplained", "undetectable"]

CLEARLY = 3.0
"""How many times more probable the best must be than the next to be named, and a pair than its better member."""
WITHIN = 10.0
"""Alternatives up to this factor below the best are listed with it."""
_MOST_RIVALS = 3
"""Of a name that does not survive another assumption: the best there are told."""
AT_LIMIT = 0.005
"""Prior probability between the posterior median of a size and a bound below which the size is at its limit."""

_N_DRAWS = 2000

NOTHING_LEFT = "three modes determine the three constants and leave nothing to judge by"
NOTHING_LEFT_OF_ONE = "one mode determines the one constant and leaves nothing to judge by"


@dataclass(frozen=True)
class Answer:
    """One way to explain a residual: a single effect or a pair, with the support that it has.

    Attributes
    ----------
    members : tuple of str
    index : int
        Of its hypothesis.
    support : float
        Its probability, and that of pairs that say little more than it.
    """

    members: tuple[str, ...]
    index: int
    support: float


@dataclass(frozen=True)
class Verdict:
    """What the readings allow to say.

    Attributes
    ----------
    word : str
        "none needed", "named", "indistinguishable group", "unexplained" or "undetectable".
    effects : tuple of str
        Named: all of them are present. Group: each is an alternative.
    index : int
        Hypothesis to refit; 0 if the model stays as it is.
    best : Answer or None
        The most probable answer, whatever the verdict.
    reason : str
    is_needed : bool
        Whether the odds against no effect are larger than the null simulations leave to chance.
    stands_for : tuple of Answer
        The one that is named, or the alternatives of a group, the most probable first.
    """

    word: Word
    effects: tuple[str, ...]
    index: int
    best: Answer | None
    reason: str
    is_needed: bool = False
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
        """What it stands for, or what comes nearest."""
        return self.stands_for if self.nearest is None else (self.nearest,)


def answers(found: Found) -> tuple[Answer, ...]:
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


def decide(found: Found, control: NullControl, others: Iterable[Variant] | None = None) -> Verdict:
    """The verdict on one set of readings.

    Parameters
    ----------
    found : Found
    control : NullControl
        What the search makes of boards without any effect.
    others : iterable of Variant, optional
        The searches that a name has to survive; by default those of `variants`, made only if there is a name.

    Returns
    -------
    Verdict
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


def turned(found: Found, best: Answer, others: Iterable[Variant]) -> tuple[str, tuple[Answer, ...]] | None:
    """The first assumption under which a name no longer stands out, and what rivals it there; None if it always does.

    A rival is told with the probability that it has without the change.
    """
    usual = {one.index: one for one in answers(found)}
    for variant in others:
        there = {one.index: one for one in answers(variant.found)}
        own = there.get(best.index, Answer(best.members, best.index, 0.0))
        rivals = [one for one in there.values() if one.index != best.index and one.support * CLEARLY > own.support]
        if rivals:
            first = sorted(rivals, key=lambda one: -one.support)[:_MOST_RIVALS]
            return variant.words, tuple(usual.get(one.index, one) for one in first)
    return None


def _without(found: Found, best: Answer | None) -> Verdict:
    """No effect is probable enough: the bare model passes, cannot be questioned, or fails without a reason."""
    passed = found.p_value(0)
    if passed < PASSES:
        reason = f"the misfit is too large for the noise ({p_words(passed)}), but no effect is probable enough"
        return Verdict("unexplained", (), 0, best, reason)
    hidden = all(found.ground.is_below_detection_limit(name) for name in found.ground.candidates)
    if found.ground.candidates and hidden:
        return Verdict("undetectable", (), 0, best, "every effect is below what these readings could show")
    return Verdict("none needed", (), 0, best, f"the misfit is what the noise would leave ({p_words(passed)})")


def at_limit(found: Found, index: int) -> str:
    """Which size of a hypothesis sits at the limit of its range; empty if none does.

    A size that may be zero is not at a limit there: zero is no effect. The size is looked at by draws, for a cell of a
    table may be wider than what counts as the limit.
    """
    drawn = draw_terms(found, index, np.random.default_rng(0), _N_DRAWS)
    for member in range(len(members_of(found, index))):
        for law, rows, z in standard_sizes_of(found, drawn, member):
            if 2 * rows.size < drawn.n_draws:
                continue
            for free, column in zip(law.form.free, z.T, strict=True):
                median = _median_within(free.prior, column)
                if _is_extreme(free.prior, median):
                    factor, unit = unit_of_people(free.unit)
                    return f"{free.key} = {factor * float(free.prior.value(median)):.3g} {unit}".rstrip()
    return ""


def _median_within(prior: Quantity, z: Floats) -> float:
    """Median of the draws that lie within the bounds of a prior; the bound next to them where none does."""
    low, high = float(prior.standard(prior.lower)), float(prior.standard(prior.upper))
    inside = z[(low <= z) & (z <= high)]
    return float(np.median(inside) if inside.size else np.clip(np.median(z), low, high))


def size_posterior(found: Found, index: int, member: int, form: int, parameter: int) -> tuple[Floats, Floats]:
    """Probability and standard coordinate of each cell of a member's form, under one hypothesis.

    Parameters
    ----------
    found : Found
    index : int
        Of the hypothesis.
    member : int
        0 or 1: which of its effects.
    form, parameter : int
        Which form of that effect, and which of its parameters.
    """
    ground, hypothesis = found.ground, found.ground.hypotheses[index]
    terms = hypothesis.terms(ground.whole)
    log_density = terms.log_densities(hypothesis.seen(ground.baseline, found.residual[None, :]))[:, 0]
    by_cell = normalised(log_density).reshape(hypothesis.noise.weights.size, -1).sum(axis=0)
    if len(hypothesis.members) == 1:
        own = hypothesis.table
    else:
        tables = [ground.candidates[name].coarse for name in hypothesis.members]
        by_cell = by_cell.reshape(tables[0].n_cells, tables[1].n_cells).sum(axis=1 - member)
        own = tables[member]
    of_form = own.form == form
    return by_cell[of_form], own.z[of_form, parameter]


def _is_extreme(prior: Quantity, z: float) -> bool:
    """Whether hardly any of a prior lies between a size and a bound; a zero that means no effect is no bound."""
    from scipy.special import ndtr

    low, high = float(prior.standard(prior.lower)), float(prior.standard(prior.upper))
    whole = ndtr(high) - ndtr(low)
    starts_at_nothing = prior.lower == 0.0 and prior.mean == 0.0
    near_top = np.isfinite(high) and (ndtr(high) - ndtr(z)) / whole < AT_LIMIT
    near_bottom = np.isfinite(low) and not starts_at_nothing and (ndtr(z) - ndtr(low)) / whole < AT_LIMIT
    return bool(near_top or near_bottom)


def answer_words(found: Found, answer: Answer) -> str:
    """An answer in words: its effects, or the labels that it exchanges."""
    swap = found.ground.hypotheses[answer.index].swap
    if swap is None:
        return effect_names(answer.members)
    return f"{effect_name(RELABELLING)} {swap.words(found.ground.baseline)}"


def alternatives_words(found: Found, told: Sequence[Answer]) -> str:
    """Answers of which one is the case, in words; two effects that are one answer stay together."""
    words = [answer_words(found, one) for one in told]
    return ", or ".join(words) if any(len(one.members) > 1 for one in told) else joined(words, "or")


def p_words(p_value: float) -> str:
    """A p-value with three decimals, or as smaller than they show."""
    return f"p = {p_value:.3f}" if p_value >= 0.001 else "p < 0.001"


def alternatives(found: Found, ranked: Sequence[Answer]) -> tuple[Answer, ...]:
    """Answers within a factor ten of the best."""
    return tuple(one for one in ranked if one.support * WITHIN >= ranked[0].support)
