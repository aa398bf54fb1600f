"""The claim that an error is reduced: five conditions, each of which must be met; and effects that explain a part."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.folds import NestedErrors, find_carrying_modes, log_score_gains, nested_leave_one_out
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult
from bayesplate.diagnosis.sensitivity import PRIOR_WIDTH_FACTORS, variant_searches, vary_priors
from bayesplate.diagnosis.sizes import size_at_limit
from bayesplate.diagnosis.verdict import Verdict, find_rivals, rank_explanations, stands_out
from bayesplate.estimates.leave_one_out import indices_of

ConditionName = Literal[
    "chance selection", "log score", "probability of none", "probability of another", "prior predictive"
]

STANDARD_ERRORS = 2.0
"""Standard errors by which the nested log score has to rise."""
IMPROBABLE_BELOW = 0.05
"""Bound on the probability of no effect, and on that of an effect that the verdict does not name."""
_FEWEST_SCORED_MODES = 2
"""Modes that must have a gain in log score, for the gains to have a scatter."""
IMPROBABLE_IN_PART_BELOW = 1e-4
"""Bound on the probability of no effect where an effect is named in part."""
LARGEST_ERROR_RATIO = 2.0 / 3.0
"""Nested leave-one-out error after over before, at most, where an effect is named in part."""


@dataclass(frozen=True)
class Condition:
    """One condition of the claim."""

    # "chance selection": nested leave-one-out error after over before, to be below that of 95 % of null simulations
    # made to choose. "log score": nested gain, to exceed two standard errors. "probability of none": the largest over
    # the widths of the sizes' priors, to be below 0.05. "probability of another": that something else is lacking than
    # what the verdict tells, the largest over the same widths, to be below 0.05. "prior predictive": p-value with the
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
        return bool(self.conditions) and all(condition.is_met for condition in self.conditions)


def judge_claim(
    result: SearchResult, verdict: Verdict, control: NullControl, nested_errors: NestedErrors | None
) -> Claim:
    """Judge the five conditions.

    `nested_errors` and the control do not count readings whose modes alone carry a constant or a size.
    """
    if not verdict.index:
        return Claim()
    searches = [result, *(vary_priors(result, width=factor) for factor in PRIOR_WIDTH_FACTORS.values())]
    named_indices, p_value = {explanation.index for explanation in verdict.explanations}, result.p_value(verdict.index)
    other_probabilities = [
        sum(explanation.support for explanation in rank_explanations(search) if explanation.index not in named_indices)
        for search in searches
    ]
    return Claim(
        (
            _chance_condition(nested_errors, control),
            _score_condition(result, nested_errors),
            _probability_condition("probability of none", [search.probability_of_none for search in searches]),
            _probability_condition("probability of another", other_probabilities),
            Condition("prior predictive", p_value, LEAST_P_VALUE, p_value >= LEAST_P_VALUE),
        )
    )


def effects_named_in_part(
    result: SearchResult,
    verdict: Verdict,
    nested_errors: NestedErrors | None,
    variants: Iterable[tuple[str, SearchResult]] | None = None,
) -> tuple[str, ...]:
    """Effects that explain the readings in part though something else remains; empty where that cannot be said.

    These are the effects of the nearest explanation, if its p-value is too small and none of its sizes is at a limit,
    the probability of no effect is below `IMPROBABLE_IN_PART_BELOW`, it stands out under every other assumption, and
    the nested leave-one-out error falls to `LARGEST_ERROR_RATIO` or further. The verdict stays what it is, nothing is
    claimed, and the constants are not to be trusted.
    """
    nearest = verdict.nearest
    if nearest is None or result.probability_of_none >= IMPROBABLE_IN_PART_BELOW:
        return ()
    if result.p_value(nearest.index) >= LEAST_P_VALUE or size_at_limit(result, nearest.index):
        return ()
    # the ratio is not a number where no mode is left to judge by
    if nested_errors is None or not nested_errors.ratio[0] <= LARGEST_ERROR_RATIO:
        return ()
    if not stands_out(nearest, rank_explanations(result)) or find_rivals(
        result, nearest, variant_searches(result) if variants is None else variants
    ):
        return ()
    return nearest.members


def nested_errors_of_board(result: SearchResult, control: NullControl, index: int = 0) -> NestedErrors | None:
    """Nested errors of the board's own readings, an effect added in each fold whose odds call for one.

    Readings whose modes alone carry a constant or a size, without any effect or under a hypothesis, do not count.
    """
    errors = nested_leave_one_out(result.ground, result.residual[None, :], control.needed_from)
    return errors and errors.without(indices_of(find_carrying_modes(result, index), result.ground.baseline.board))


def score_gain(gains: Floats | Sequence[float]) -> tuple[float, float]:
    """Sum of paired differences over modes, and its standard error."""
    values = np.asarray(gains, dtype=np.float64)
    return float(values.sum()), float(np.sqrt(values.size) * values.std(ddof=1))


def _chance_condition(errors: NestedErrors | None, control: NullControl) -> Condition:
    limit = (
        None if control.ratio_to_beat is None else min(control.ratio_to_beat, 1.0)
    )  # an error that rises is not reduced
    if errors is None or limit is None or not errors.is_counted.any():
        return Condition("chance selection", None, limit, False)
    ratio = float(errors.ratio[0])
    return Condition("chance selection", ratio, limit, ratio < limit)


def _score_condition(result: SearchResult, errors: NestedErrors | None) -> Condition:
    if errors is None:
        return Condition("log score", None, None, False)
    gains = log_score_gains(result.ground, result.residual, errors.choices[0], errors.carrying_readings)
    if gains.size < _FEWEST_SCORED_MODES:
        return Condition("log score", None, None, False)
    gain, error = score_gain(gains)
    return Condition("log score", gain, STANDARD_ERRORS * error, gain > STANDARD_ERRORS * error)


def _probability_condition(name: ConditionName, probabilities: Sequence[float]) -> Condition:
    largest = float(max(probabilities))
    return Condition(name, largest, IMPROBABLE_BELOW, largest < IMPROBABLE_BELOW)
