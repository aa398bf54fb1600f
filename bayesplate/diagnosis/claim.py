"""The claim that an error is reduced: five conditions, each of which must be met; and what explains it in part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.folds import Nested, carrying, log_score_gains, nested
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import PASSES, SearchResult
from bayesplate.diagnosis.sensitivity import WIDTHS, variants, varied
from bayesplate.diagnosis.sizes import at_limit
from bayesplate.diagnosis.verdict import Verdict, answers, stands_out, turned
from bayesplate.estimates.leave_one_out import indices_of

ConditionName = Literal[
    "chance selection", "log score", "probability of none", "probability of another", "prior predictive"
]

STANDARD_ERRORS = 2.0
"""By how many of them the nested log score has to rise."""
IMPROBABLE = 0.05
"""What the probability of no effect has to stay below, and that of one that is not told."""
_FEWEST_GAINS = 2
"""Modes that count without which their gains have no scatter."""
SURELY = 1e-4
"""What the probability of no effect has to stay below where something explains the readings in part."""
FALLS_TO = 2.0 / 3.0
"""Nested left-out error after over before, at most: it falls by at least a third."""


@dataclass(frozen=True)
class Condition:
    """One condition of the claim."""

    # "chance selection": nested left-out error after over before, to be below that of 95 % of null simulations made to
    # choose. "log score": nested gain, to exceed two standard errors. "probability of none": the largest over the
    # widths of the sizes' priors, to be below 0.05. "probability of another": that something else is lacking than what
    # the verdict tells, the largest over the same widths, to be below 0.05. "prior predictive": p-value with the
    # effect, at least 0.05.
    name: ConditionName
    # value, limit: None where too few readings leave nothing to judge by
    value: float | None
    limit: float | None
    is_met: bool


@dataclass(frozen=True)
class Claim:
    """Whether it may be said that the error is reduced."""

    conditions: tuple[Condition, ...] = ()  # empty if nothing was added to the model

    @property
    def holds(self) -> bool:
        """Whether there is something to claim and every condition is met."""
        return bool(self.conditions) and all(one.is_met for one in self.conditions)


def judge_claim(found: SearchResult, verdict: Verdict, control: NullControl, folded: Nested | None) -> Claim:
    """Judge the five conditions; `folded` and the control do not count readings whose modes alone carry something."""
    if not verdict.index:
        return Claim()
    searches = [found, *(varied(found, width=factor) for factor in WIDTHS.values())]
    told, p_value = {one.index for one in verdict.stands_for}, found.p_value(verdict.index)
    others = [sum(each.support for each in answers(one) if each.index not in told) for one in searches]
    return Claim(
        (
            _beyond_chance(folded, control),
            _better_score(found, folded),
            _below("probability of none", [one.none for one in searches]),
            _below("probability of another", others),
            Condition("prior predictive", p_value, PASSES, p_value >= PASSES),
        )
    )


def named_in_part(
    found: SearchResult,
    verdict: Verdict,
    folded: Nested | None,
    others: Iterable[tuple[str, SearchResult]] | None = None,
) -> tuple[str, ...]:
    """Effects that explain readings in part though something else remains; none where that cannot be said.

    The members of what comes nearest, if it fails the gate and not the limits of its sizes, no effect is less probable
    than `SURELY`, the name survives every other assumption, and the nested left-out error falls to `FALLS_TO` or
    further. The verdict stays what it is, nothing is claimed, and the constants are not to be trusted.
    """
    nearest = verdict.nearest
    if nearest is None or found.none >= SURELY:
        return ()
    if found.p_value(nearest.index) >= PASSES or at_limit(found, nearest.index):
        return ()
    if folded is None or not folded.ratio[0] <= FALLS_TO:  # not a number where no mode is left to judge by
        return ()
    if not stands_out(nearest, answers(found)) or turned(found, nearest, variants(found) if others is None else others):
        return ()
    return nearest.members


def nested_of(found: SearchResult, control: NullControl, index: int = 0) -> Nested | None:
    """The board's own readings left out one by one, an effect added where a fold calls for one.

    Not counted are those whose modes alone carry a constant or a size, without any effect or under a hypothesis.
    """
    folded = nested(found.ground, found.residual[None, :], control.needed_from)
    return folded and folded.without(indices_of(carrying(found, index), found.ground.baseline.board))


def score_gain(gains: Floats | Sequence[float]) -> tuple[float, float]:
    """Sum of paired differences over modes, and its standard error."""
    values = np.asarray(gains, dtype=np.float64)
    return float(values.sum()), float(np.sqrt(values.size) * values.std(ddof=1))


def _beyond_chance(folded: Nested | None, control: NullControl) -> Condition:
    limit = control.ratio_to_beat
    if folded is None or limit is None or not folded.counted.any():
        return Condition("chance selection", None, limit, False)
    ratio = float(folded.ratio[0])
    return Condition("chance selection", ratio, limit, ratio < limit)


def _better_score(found: SearchResult, folded: Nested | None) -> Condition:
    if folded is None:
        return Condition("log score", None, None, False)
    gains = log_score_gains(found.ground, found.residual, folded.chosen[0], folded.carried)
    if gains.size < _FEWEST_GAINS:
        return Condition("log score", None, None, False)
    gain, error = score_gain(gains)
    return Condition("log score", gain, STANDARD_ERRORS * error, gain > STANDARD_ERRORS * error)


def _below(name: ConditionName, probabilities: Sequence[float]) -> Condition:
    largest = float(max(probabilities))
    return Condition(name, largest, IMPROBABLE, largest < IMPROBABLE)
