"""From all that a diagnosis found to its result: verdict, errors before and after, candidates, what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.diagnosis.claim import Claim
from bayesplate.diagnosis.entries import effect_entry, exchange_entries, p_value_of, ratio_words
from bayesplate.diagnosis.folds import Nested, log_score
from bayesplate.diagnosis.hypotheses import RELABELLING, are_stated
from bayesplate.diagnosis.known import KnownFit
from bayesplate.diagnosis.known_words import known_models
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.result import (
    Diagnosis,
    ElasticShift,
    Errors,
    Explanation,
    Finalist,
    Histogram,
    NullControlSummary,
    PValues,
)
from bayesplate.diagnosis.search import PASSES, SearchResult
from bayesplate.diagnosis.sensitivity import WIDTHS, draw_constants, varied
from bayesplate.diagnosis.stated import StatedClaim
from bayesplate.diagnosis.verdict import Answer, Verdict, alternatives_words, answer_words, answers, p_words
from bayesplate.effects import EFFECTS
from bayesplate.effects.words import joined
from bayesplate.estimates.leave_one_out import CarryingMode, indices_of
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import Spread, finite, rms
from bayesplate.results.modes import foretold
from bayesplate.results.summary import Summary

_AVERAGE_LINE = 11
_N_AVERAGED = 8000
_N_BINS = 30


@dataclass(frozen=True, eq=False)
class Side:
    """The model before or after: its hypothesis, its summary and its draws, and its labelled readings, Hz."""

    index: int
    summary: Summary
    draws: Draws
    measured: Floats


@dataclass(frozen=True, eq=False)
class Case:
    """Everything that the report of a diagnosis is made of."""

    found: SearchResult
    verdict: Verdict
    control: NullControl
    folded: Nested | None
    # before, after: the same where nothing was added
    before: Side
    after: Side
    claim: Claim  # of the explanation that was fitted again
    recommendation: str
    known: Sequence[KnownFit] = ()  # the board as it stands first
    stated_claims: Sequence[StatedClaim] = ()
    # explanations that were fitted again, best first, or the one that comes nearest where none is enough
    finalists: Sequence[tuple[Answer, Side]] = ()
    has_slip: bool = False  # whether the fit without an effect names a reading or two that a slip explains
    notes: tuple[str, ...] = ()
    in_part: tuple[str, ...] = ()  # effects that explain the readings in part
    carrying: tuple[CarryingMode, ...] = ()  # modes that count in no left-out error or score, before and after alike

    @property
    def carried(self) -> tuple[int, ...]:
        """Indices of the readings of these modes."""
        return indices_of(self.carrying, self.found.ground.baseline.board)


def diagnosis_of(case: Case) -> Diagnosis:
    """The result of a diagnosis."""
    found, verdict, control = case.found, case.verdict, case.control
    ranked = answers(found)
    halved, doubled = (varied(found, width=WIDTHS[word]) for word in ("halved", "doubled"))
    effects = found.ground.candidates.values()
    averaged = _averaged(case)
    taken = verdict.stands_for
    added = verdict.fitted_again if case.after.index else ()
    return Diagnosis(
        name=case.before.summary.name,
        seed=case.before.summary.seed,
        card_sha256=case.before.summary.card_sha256,
        verdict=verdict.word,
        claim=case.claim.holds,
        conditions=case.claim.conditions,
        effects=verdict.effects,
        words=_words(case, taken),
        refitted=found.ground.hypotheses[case.after.index].members,
        refitted_words=next((answer_words(found, one) for one in added if one.index == case.after.index), ""),
        reason=verdict.reason,
        sentences=_sentences(case, taken),
        declared=found.ground.baseline.board.effects,
        known=known_models(case.known, case.carried),
        stated_claims=tuple(case.stated_claims),
        probability_of_none=found.none,
        probability_of_none_with_halved_priors=halved.none,
        probability_of_none_with_doubled_priors=doubled.none,
        p_value=PValues(before=p_value_of(found, 0), after=p_value_of(found, case.after.index)),
        before=_errors(case, case.before),
        after=_errors(case, case.after),
        gain_null_percentile=None if (odds := _log_odds(found)) is None else control.percentile_of(odds),
        null_control=_null_control(case),
        elastic_shift=_elastic_shift(case),
        finalists=tuple(_finalist(case, answer, side.summary) for answer, side in case.finalists),
        elastic_averaged={name: averaged[name] for name in MODULI},
        rigidity_averaged={name: averaged[name] for name in RIGIDITIES},
        answers=tuple(
            Explanation(
                effects=one.members,
                probability=one.support,
                words=answer_words(found, one),
                is_stated=are_stated(found.ground.baseline.board, one.members),
            )
            for one in ranked
        ),
        candidates=(
            *(effect_entry(found, verdict, ranked, one, doubled.inclusion(one.name)) for one in effects),
            *exchange_entries(found, verdict, ranked),
        ),
        recommendation=case.recommendation,
        notes=case.notes,
        named_in_part=case.in_part,
        in_part_words=answer_words(found, verdict.nearest) if case.in_part and verdict.nearest else "",
        carrying_modes=case.carrying,
    )


def _errors(case: Case, side: Side) -> Errors:
    folded = case.folded
    nested = None
    if folded is not None:
        nested = rms(cents((folded.after if side.index else folded.before)[0, folded.counted[0]]))
    measured = side.measured
    low, high = np.quantile(side.draws.predictive.reshape(-1, measured.size), [0.05, 0.95], axis=0)
    return Errors(
        in_sample_rms_cents=side.summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=left_out_rms_cents(side.summary, case.carrying),
        nested_leave_one_out_rms_cents=nested,
        log_score=_log_score(case, side),
        hits_90=float(np.mean((measured >= low) & (measured <= high))),
    )


def left_out_rms_cents(summary: Summary, carrying: Sequence[CarryingMode]) -> float | None:
    """Error of a fit for modes left out, but of those that alone carry something in any of the models compared."""
    if set(carrying) <= set(summary.carrying_modes):
        return summary.error.leave_one_out_rms_cents
    return rms([one.left_out_cents for one in foretold(summary.modes, carrying)])


def _log_score(case: Case, side: Side) -> float | None:
    """The log score of a model; None where too few modes are left, or none that others foretell."""
    if case.folded is None or not case.folded.counted.any():
        return None
    return log_score(case.found.ground, side.index, case.found.residual, case.folded.carried)


def _null_control(case: Case) -> NullControlSummary:
    ratio = None if case.folded is None else finite(float(case.folded.ratio[0]))
    control, found = case.control, case.found
    return NullControlSummary(
        n_sets=int(control.against.size),
        flagged_percent=100.0 * control.flagged,
        log_odds=_log_odds(found),
        log_odds_needed=control.needed_from,
        log_odds_of_sets=_histogram(control.against),
        nested_ratio=ratio,
        nested_ratio_to_beat=control.ratio_to_beat,
        nested_ratio_percentile=None if ratio is None else control.place_of(ratio),
        nested_ratio_of_sets=_histogram(np.array([np.nan]) if control.ratio is None else control.ratio),
    )


def _log_odds(found: SearchResult) -> float | None:
    """ln of the odds that something is lacking; None where nothing is left to judge by, or nothing could be lacking."""
    return finite(found.against_none) if found.ground.n_directions else None


def _histogram(values: Floats) -> Histogram | None:
    """Values of simulated sets by number; None where they have none, for there are no hypotheses."""
    if not np.isfinite(values).all():
        return None
    counts, edges = np.histogram(values, bins=_N_BINS)
    return Histogram(edges=tuple(float(edge) for edge in edges), counts=tuple(int(count) for count in counts))


def _elastic_shift(case: Case) -> dict[str, ElasticShift]:
    both = zip(case.before.summary.elastic.items(), case.after.summary.elastic.items(), strict=True)
    return {
        name: ElasticShift(before=old.mean, after=new.mean, shift_in_sd=(new.mean - old.mean) / old.sd)
        for (name, old), (_, new) in both
    }


def _averaged(case: Case) -> dict[str, Spread]:
    """The constants to quote, by name, Pa and N m.

    Averaged over everything that may be the case, each by its probability under the exact law: by the sampler's draws
    where a model was sampled, else by those of the search, weighted for the exact law. Where nothing explains the
    readings there is nothing to average over: they are those of the fit with what explains them in part, else of the
    first.
    """
    if case.verdict.word == "unexplained":
        summary = case.after.summary if case.in_part else case.before.summary
        return dict((*summary.elastic.items(), *summary.rigidity.items()))
    sides = (case.before, *(side for _, side in case.finalists))
    sampled = {one.index: {**one.draws.moduli, **one.draws.rigidities} for one in sides}
    rng = np.random.default_rng([case.before.summary.seed, _AVERAGE_LINE])
    drawn = draw_constants(case.found, rng, _N_AVERAGED, sampled=sampled)
    units = dict.fromkeys(MODULI, "Pa") | dict.fromkeys(RIGIDITIES, "N m")
    return {name: Spread.of(drawn[name], unit) for name, unit in units.items()}


def _words(case: Case, taken: Sequence[Answer]) -> str:
    """What a verdict stands for, as people read it: all of it if it is named, otherwise the alternatives."""
    if case.verdict.word == "named":
        return joined([answer_words(case.found, one) for one in taken])
    return alternatives_words(case.found, taken)


def _sentences(case: Case, taken: Sequence[Answer]) -> tuple[str, ...]:
    """What each effect of the verdict is, and what speaks for an exchange of labels."""
    effects = [EFFECTS[name].sentence for name in case.verdict.effects if name in EFFECTS]
    exchanged = [
        f"The labels {swap.words(case.found.ground.baseline)} may have been exchanged: "
        f"{ratio_words(case.found, one.index)}. Compare their figures, and correct the card if it is so."
        for one in taken
        if (swap := case.found.ground.hypotheses[one.index].swap) is not None
    ]
    nearest = [
        _nearest_sentence(case, one, side.summary) for one, side in case.finalists if one == case.verdict.nearest
    ]
    return (*effects, *exchanged, *nearest, *_stated_sentences(case, taken))


def _stated_sentences(case: Case, taken: Sequence[Answer]) -> list[str]:
    """Which known effects, stated and not declared, would explain the readings too, and how to fit them."""
    board = case.found.ground.baseline.board
    told = []
    for one in answers(case.found):
        p_value = case.found.p_value(one.index)
        if one in taken or not are_stated(board, one.members) or p_value < PASSES:
            continue
        every = ",".join((*board.effects, *one.members))
        told.append(
            f"{answer_words(case.found, one).capitalize()}, which are known to be there, explain the readings together "
            f"as well ({p_words(p_value)}): --effects {every} fits the constants with both."
        )
    return told


def _nearest_sentence(case: Case, answer: Answer, summary: Summary) -> str:
    """What the most probable explanation does to the errors though it is not enough, and how to go on from it."""
    before, after = case.before.summary, summary
    comes, it = ("come", "them") if len(answer.members) > 1 else ("comes", "it")
    told = (
        f"{answer_words(case.found, answer).capitalize()} {comes} nearest: with {it} the error goes from "
        f"{before.error.in_sample_rms_cents:.1f} to {after.error.in_sample_rms_cents:.1f} cents in the fit"
    )
    first, last = (left_out_rms_cents(one, case.carrying) for one in (before, after))
    if first is not None and last is not None:
        told += f", and from {first:.1f} to {last:.1f} for a mode left out"
    if RELABELLING in answer.members:
        return f"{told}."
    if case.has_slip:
        return f"{told}. Before you declare {it}, look at the readings that are told below."
    every = (*case.found.ground.baseline.board.effects, *answer.members)  # what a card lists is all that it declares
    names = ", ".join(f'"{name}"' for name in every)
    return f"{told}. Declare {it}, effects = [{names}], and diagnose again to look for what else is lacking."


def _finalist(case: Case, answer: Answer, summary: Summary) -> Finalist:
    return Finalist(
        effects=answer.members,
        probability=answer.support,
        in_sample_rms_cents=summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=left_out_rms_cents(summary, case.carrying),
        elastic=dict(summary.elastic.items()),
        sizes={
            owner: {name: sizes for name, sizes in effects.items() if name in answer.members}
            for owner, effects in summary.effects.items()
        },
    )
