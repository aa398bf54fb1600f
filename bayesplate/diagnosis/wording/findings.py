"""From all that a diagnosis found to its result: verdict, errors before and after, candidates, what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.diagnosis.decision.constants import draw_constants
from bayesplate.diagnosis.decision.verdict import Answer, Verdict, answers
from bayesplate.diagnosis.evidence.folds import Nested, log_score
from bayesplate.diagnosis.evidence.null_control import NullControl, gain
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.evidence.sensitivity import inclusion_with_width
from bayesplate.diagnosis.wording.diagnosis import (
    Diagnosis,
    ElasticShift,
    Errors,
    Explanation,
    Finalist,
    NullControlSummary,
    PValues,
)
from bayesplate.diagnosis.wording.entries import effect_entry, exchange_entries, p_value_of, rms
from bayesplate.effects import EFFECTS
from bayesplate.frequencies.laws import cents
from bayesplate.plate.material import MODULI
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import Spread
from bayesplate.results.summary import Summary

_AVERAGE_LINE = 11
_N_AVERAGED = 8000
_MOST_ANSWERS = 8


@dataclass(frozen=True, eq=False)
class Side:
    """The model before or after: its hypothesis, its summary and its draws."""

    index: int
    summary: Summary
    draws: Draws


@dataclass(frozen=True, eq=False)
class Case:
    """Everything that the report of a diagnosis is made of.

    Attributes
    ----------
    found : Found
    verdict : Verdict
    control : NullControl
    folded : Nested or None
    before, after : Side
        The same where nothing was added.
    is_clear_of_zero : bool
        Whether every effect that was added has a size whose 95 % interval excludes zero.
    recommendation : str
    finalists : sequence of (Answer, Summary)
        Explanations that were fitted again, best first, each with the summary of its fit.
    notes : tuple of str
    """

    found: Found
    verdict: Verdict
    control: NullControl
    folded: Nested | None
    before: Side
    after: Side
    is_clear_of_zero: bool
    recommendation: str
    finalists: Sequence[tuple[Answer, Summary]] = ()
    notes: tuple[str, ...] = ()

    @property
    def claim(self) -> bool:
        """Whether "error reduced" may be said: beyond chance selection, size clear of zero, p-value large enough."""
        to_beat = self.control.ratio_to_beat
        if self.verdict.index == 0 or self.folded is None or to_beat is None:
            return False
        return bool(float(self.folded.ratio[0]) < to_beat and self.is_clear_of_zero)


def diagnosis_of(case: Case) -> Diagnosis:
    """The result of a diagnosis.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Diagnosis
    """
    found, verdict, control = case.found, case.verdict, case.control
    priors = np.array([one.prior for one in found.ground.hypotheses])
    observed = float(gain(found.log_evidence[:, None], priors)[0])
    ranked = answers(found)
    doubled = inclusion_with_width(found, 2.0)
    effects = found.ground.candidates.values()
    return Diagnosis(
        name=case.before.summary.name,
        seed=case.before.summary.seed,
        card_sha256=case.before.summary.card_sha256,
        verdict=verdict.word,
        claim=case.claim,
        effects=verdict.effects,
        refitted=found.ground.hypotheses[case.after.index].members,
        reason=verdict.reason,
        sentences=tuple(EFFECTS[name].sentence for name in verdict.effects if name in EFFECTS),
        declared=found.ground.baseline.board.effects,
        probability_of_none=found.none,
        probability_of_none_with_doubled_priors=doubled[""],
        p_value=PValues(before=p_value_of(found, 0), after=p_value_of(found, verdict.index)),
        before=_errors(case, case.before),
        after=_errors(case, case.after),
        gain_null_percentile=control.percentile_of_gain(observed) if found.ground.n_directions else None,
        null_control=_null_control(case),
        elastic_shift=_elastic_shift(case),
        finalists=tuple(_finalist(answer, figures) for answer, figures in case.finalists),
        elastic_averaged=_elastic_averaged(case),
        answers=tuple(Explanation(effects=one.members, probability=one.support) for one in ranked[:_MOST_ANSWERS]),
        candidates=(
            *(effect_entry(found, verdict, ranked, one, doubled[one.name]) for one in effects),
            *exchange_entries(found, verdict),
        ),
        recommendation=case.recommendation,
        notes=case.notes,
    )


def _errors(case: Case, side: Side) -> Errors:
    found, folded = case.found, case.folded
    nested = None
    if folded is not None:
        nested = rms(cents(folded.after[0] if side.index else folded.before[0]))
    low, high = np.quantile(side.draws.predictive.reshape(-1, found.ground.baseline.n_modes), [0.05, 0.95], axis=0)
    measured = np.concatenate([setup.measured for setup in found.ground.baseline.board.setups])
    return Errors(
        in_sample_rms_cents=side.summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=side.summary.error.leave_one_out_rms_cents,
        nested_leave_one_out_rms_cents=nested,
        log_score=log_score(found.ground, side.index, found.residual) if folded is not None else None,
        hits_90=float(np.mean((measured >= low) & (measured <= high))),
    )


def _null_control(case: Case) -> NullControlSummary:
    return NullControlSummary(
        n_sets=int(case.control.gain.size),
        flagged_percent=100.0 * case.control.flagged,
        nested_ratio=None if case.folded is None else float(case.folded.ratio[0]),
        nested_ratio_to_beat=case.control.ratio_to_beat,
    )


def _elastic_shift(case: Case) -> dict[str, ElasticShift]:
    both = zip(case.before.summary.elastic.items(), case.after.summary.elastic.items(), strict=True)
    return {
        name: ElasticShift(before=old.mean, after=new.mean, shift_in_sd=(new.mean - old.mean) / old.sd)
        for (name, old), (_, new) in both
    }


def _elastic_averaged(case: Case) -> dict[str, Spread]:
    """The constants averaged over everything that may be the case, in the linear approximation of the search."""
    rng = np.random.default_rng([case.before.summary.seed, _AVERAGE_LINE])
    drawn = draw_constants(case.found, rng, _N_AVERAGED)
    return {name: Spread.of(drawn.values[name], "Pa") for name in MODULI}


def _finalist(answer: Answer, summary: Summary) -> Finalist:
    return Finalist(
        effects=answer.members,
        probability=answer.support,
        in_sample_rms_cents=summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=summary.error.leave_one_out_rms_cents,
        elastic=dict(summary.elastic.items()),
        sizes={
            owner: {name: sizes for name, sizes in effects.items() if name in answer.members}
            for owner, effects in summary.effects.items()
        },
    )
