"""The result of a diagnosis: verdict, errors before and after, candidates, recommendation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI, RIGIDITIES
from bayesplate.diagnosis.claim import Claim
from bayesplate.diagnosis.entries import effect_entry, exchange_entries, exchange_ratio_words, p_value_of
from bayesplate.diagnosis.folds import NestedErrors, log_score
from bayesplate.diagnosis.hypotheses import RELABELLING, are_stated
from bayesplate.diagnosis.known import KnownFit
from bayesplate.diagnosis.known_words import known_models
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.result import (
    Diagnosis,
    ElasticShift,
    ExplanationSummary,
    Finalist,
    Histogram,
    ModelErrors,
    NullControlSummary,
    PValues,
)
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult
from bayesplate.diagnosis.sensitivity import PRIOR_WIDTH_FACTORS, draw_constants, vary_priors
from bayesplate.diagnosis.sizes import likely_forms, size_at_limit
from bayesplate.diagnosis.stated import StatedClaim
from bayesplate.diagnosis.verdict import (
    Explanation,
    Verdict,
    alternatives_words,
    explanation_words,
    p_value_words,
    rank_explanations,
)
from bayesplate.effects import EFFECTS, effect_faults
from bayesplate.effects.words import as_sentence, join_words
from bayesplate.estimates.leave_one_out import CarryingMode, indices_of
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import Spread, finite_or_none, rms
from bayesplate.results.modes import drop_carrying_modes
from bayesplate.results.summary import Summary

_AVERAGE_LINE = 11
_N_AVERAGED = 8000
_N_BINS = 30


@dataclass(frozen=True, eq=False)
class FittedModel:
    """The model before or after: its hypothesis, its summary and its draws, and its labelled readings, Hz."""

    index: int  # of its hypothesis
    summary: Summary
    draws: Draws
    measured: Floats


@dataclass(frozen=True, eq=False)
class Case:
    """The search, fits and decisions of a diagnosis, from which its result is made."""

    result: SearchResult
    verdict: Verdict
    control: NullControl
    nested_errors: NestedErrors | None
    # before, after: the same where nothing was added
    before: FittedModel
    after: FittedModel
    claim: Claim  # of the explanation that was fitted again
    recommendation: str
    known_fits: Sequence[KnownFit] = ()  # the board as it stands first
    stated_claims: Sequence[StatedClaim] = ()
    # explanations that were fitted again, best first, or the one that comes nearest where none is enough
    finalists: Sequence[tuple[Explanation, FittedModel]] = ()
    has_slip: bool = False  # whether the fit without an effect names a reading or two that a slip explains
    notes: tuple[str, ...] = ()
    effects_in_part: tuple[str, ...] = ()  # effects that explain the readings in part
    # modes that count in no leave-one-out error or score, before and after alike
    carrying_modes: tuple[CarryingMode, ...] = ()

    @property
    def carrying_readings(self) -> tuple[int, ...]:
        """Indices of the readings of these modes."""
        return indices_of(self.carrying_modes, self.result.ground.baseline.board)


def diagnosis_of(case: Case) -> Diagnosis:
    """The result of a diagnosis."""
    result, verdict, control = case.result, case.verdict, case.control
    explanations = rank_explanations(result)
    halved_search, doubled_search = (
        vary_priors(result, width=PRIOR_WIDTH_FACTORS[word]) for word in ("halved", "doubled")
    )
    effects = result.ground.candidates.values()
    averaged_constants = _averaged_constants(case)
    verdict_explanations = verdict.explanations
    refitted_explanations = verdict.refitted_explanations if case.after.index else ()
    return Diagnosis(
        name=case.before.summary.name,
        seed=case.before.summary.seed,
        card_sha256=case.before.summary.card_sha256,
        verdict=verdict.word,
        claim=case.claim.holds,
        conditions=case.claim.conditions,
        effects=verdict.effects,
        words=_verdict_words(case, verdict_explanations),
        refitted=result.ground.hypotheses[case.after.index].members,
        refitted_words=next(
            (
                explanation_words(result, explanation)
                for explanation in refitted_explanations
                if explanation.index == case.after.index
            ),
            "",
        ),
        reason=verdict.reason,
        sentences=_sentences(case, verdict_explanations),
        declared=result.ground.baseline.board.effects,
        known=known_models(case.known_fits, case.carrying_readings),
        stated_claims=tuple(case.stated_claims),
        probability_of_none=result.probability_of_none,
        probability_of_none_with_halved_priors=halved_search.probability_of_none,
        probability_of_none_with_doubled_priors=doubled_search.probability_of_none,
        p_value=PValues(before=p_value_of(result, 0), after=p_value_of(result, case.after.index)),
        before=_model_errors(case, case.before),
        after=_model_errors(case, case.after),
        gain_null_percentile=None if (log_odds := _log_odds(result)) is None else control.log_odds_percentile(log_odds),
        null_control=_null_control_summary(case),
        elastic_shift=_elastic_shift(case),
        finalists=tuple(_finalist(case, explanation, model.summary) for explanation, model in case.finalists),
        elastic_averaged={name: averaged_constants[name] for name in MODULI},
        rigidity_averaged={name: averaged_constants[name] for name in RIGIDITIES},
        explanations=tuple(
            ExplanationSummary(
                effects=explanation.members,
                probability=explanation.support,
                words=explanation_words(result, explanation),
                is_stated=are_stated(result.ground.baseline.board, explanation.members),
            )
            for explanation in explanations
        ),
        candidates=(
            *(
                effect_entry(result, verdict, explanations, candidate, doubled_search.inclusion(candidate.name))
                for candidate in effects
            ),
            *exchange_entries(result, verdict, explanations),
        ),
        recommendation=case.recommendation,
        notes=case.notes,
        named_in_part=case.effects_in_part,
        in_part_words=explanation_words(result, verdict.nearest) if case.effects_in_part and verdict.nearest else "",
        carrying_modes=case.carrying_modes,
    )


def _model_errors(case: Case, model: FittedModel) -> ModelErrors:
    nested_errors = case.nested_errors
    nested_rms_cents = None
    if nested_errors is not None:
        nested_rms_cents = rms(
            cents((nested_errors.after if model.index else nested_errors.before)[0, nested_errors.is_counted[0]])
        )
    measured = model.measured
    low, high = np.quantile(model.draws.predictive.reshape(-1, measured.size), [0.05, 0.95], axis=0)
    return ModelErrors(
        in_sample_rms_cents=model.summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=left_out_rms_cents(model.summary, case.carrying_modes),
        nested_leave_one_out_rms_cents=nested_rms_cents,
        log_score=_log_score(case, model),
        hits_90=float(np.mean((measured >= low) & (measured <= high))),
    )


def left_out_rms_cents(summary: Summary, carrying_modes: Sequence[CarryingMode]) -> float | None:
    """Leave-one-out error of a fit, rms cents, without the modes that alone carry a constant or a size in a model."""
    if set(carrying_modes) <= set(summary.carrying_modes):
        return summary.error.leave_one_out_rms_cents
    return rms([row.left_out_cents for row in drop_carrying_modes(summary.modes, carrying_modes)])


def _log_score(case: Case, model: FittedModel) -> float | None:
    """The log score of a model; None where there are too few modes, or none that the others predict."""
    if case.nested_errors is None or not case.nested_errors.is_counted.any():
        return None
    return log_score(case.result.ground, model.index, case.result.residual, case.nested_errors.carrying_readings)


def _null_control_summary(case: Case) -> NullControlSummary:
    ratio = None if case.nested_errors is None else finite_or_none(float(case.nested_errors.ratio[0]))
    control, result = case.control, case.result
    return NullControlSummary(
        n_sets=int(control.log_odds.size),
        flagged_percent=100.0 * control.flagged_share,
        log_odds=_log_odds(result),
        log_odds_needed=control.needed_from,
        log_odds_of_sets=_histogram(control.log_odds),
        nested_ratio=ratio,
        nested_ratio_to_beat=control.ratio_to_beat,
        nested_ratio_percentile=None if ratio is None else control.ratio_percentile(ratio),
        nested_ratio_of_sets=_histogram(np.array([np.nan]) if control.ratio is None else control.ratio),
    )


def _log_odds(result: SearchResult) -> float | None:
    """ln of the odds that an effect is lacking; None where the constants fit every reading, or no effect could act."""
    return finite_or_none(result.log_odds) if result.ground.n_directions else None


def _histogram(values: Floats) -> Histogram | None:
    """Histogram of a value over simulated sets; None where it is not finite, for want of hypotheses."""
    if not np.isfinite(values).all():
        return None
    counts, edges = np.histogram(values, bins=_N_BINS)
    return Histogram(edges=tuple(float(edge) for edge in edges), counts=tuple(int(count) for count in counts))


def _elastic_shift(case: Case) -> dict[str, ElasticShift]:
    pairs = zip(case.before.summary.elastic.items(), case.after.summary.elastic.items(), strict=True)
    return {
        name: ElasticShift(before=old.mean, after=new.mean, shift_in_sd=(new.mean - old.mean) / old.sd)
        for (name, old), (_, new) in pairs
    }


def _averaged_constants(case: Case) -> dict[str, Spread]:
    """The constants to quote, by name, Pa and N m.

    Averaged over all hypotheses by their probability under the exact law, from the sampler's draws where a model was
    sampled, else from those of the search, weighted to the exact law. Where nothing explains the readings there is no
    average: the constants are those of the fit with the effects named in part, else of the first fit.
    """
    if case.verdict.word == "unexplained":
        summary = case.after.summary if case.effects_in_part else case.before.summary
        return dict((*summary.elastic.items(), *summary.rigidity.items()))
    models = (case.before, *(model for _, model in case.finalists))
    sampler_draws = {model.index: {**model.draws.moduli, **model.draws.rigidities} for model in models}
    rng = np.random.default_rng([case.before.summary.seed, _AVERAGE_LINE])
    constants = draw_constants(case.result, rng, _N_AVERAGED, sampler_draws=sampler_draws)
    units = dict.fromkeys(MODULI, "Pa") | dict.fromkeys(RIGIDITIES, "N m")
    return {name: Spread.of(constants[name], unit) for name, unit in units.items()}


def _verdict_words(case: Case, verdict_explanations: Sequence[Explanation]) -> str:
    """The explanations of a verdict in words: all of them if it is "named", otherwise as alternatives."""
    if case.verdict.word == "named":
        return join_words([explanation_words(case.result, explanation) for explanation in verdict_explanations])
    return alternatives_words(case.result, verdict_explanations)


def _sentences(case: Case, verdict_explanations: Sequence[Explanation]) -> tuple[str, ...]:
    """Sentences on each effect of the verdict, exchanges of labels, the nearest explanation and stated effects."""
    effect_sentences = [EFFECTS[name].sentence for name in case.verdict.effects if name in EFFECTS]
    exchange_sentences = [
        f"The labels {swap.words(case.result.ground.baseline)} may have been exchanged: "
        f"{exchange_ratio_words(case.result, explanation.index)}. Compare their figures, and correct the card if it is "
        "so."
        for explanation in verdict_explanations
        if (swap := case.result.ground.hypotheses[explanation.index].swap) is not None
    ]
    nearest_sentences = [
        _nearest_sentence(case, explanation, model.summary)
        for explanation, model in case.finalists
        if explanation == case.verdict.nearest
    ]
    return (*effect_sentences, *exchange_sentences, *nearest_sentences, *_stated_sentences(case, verdict_explanations))


def _stated_sentences(case: Case, verdict_explanations: Sequence[Explanation]) -> list[str]:
    """Sentences on pairs of known effects, stated and not declared, that explain the readings too."""
    board = case.result.ground.baseline.board
    sentences = []
    for explanation in rank_explanations(case.result):
        p_value = case.result.p_value(explanation.index)
        is_told = explanation in verdict_explanations or not are_stated(board, explanation.members)
        if is_told or p_value < LEAST_P_VALUE or size_at_limit(case.result, explanation.index):
            continue
        effects = ",".join((*board.effects, *explanation.members))
        too = "" if case.verdict.word == "unexplained" else " as well"
        sentences.append(
            f"{as_sentence(explanation_words(case.result, explanation))}, which are known to be there, explain the "
            f"readings together{too} ({p_value_words(p_value)}): --effects {effects} fits the constants with both."
        )
    return sentences


def _nearest_sentence(case: Case, explanation: Explanation, summary: Summary) -> str:
    """The change of the errors by the nearest explanation, which is not enough, and the next step."""
    before, after = case.before.summary, summary
    comes, it = ("come", "them") if len(explanation.members) > 1 else ("comes", "it")
    sentence = (
        f"{as_sentence(explanation_words(case.result, explanation))} {comes} nearest: with {it} the error goes from "
        f"{before.error.in_sample_rms_cents:.1f} to {after.error.in_sample_rms_cents:.1f} cents in the fit"
    )
    left_out_before, left_out_after = (left_out_rms_cents(fit, case.carrying_modes) for fit in (before, after))
    if left_out_before is not None and left_out_after is not None:
        sentence += f", and from {left_out_before:.1f} to {left_out_after:.1f} for a mode left out"
    if RELABELLING in explanation.members:
        return f"{sentence}."
    if case.has_slip:
        return f"{sentence}. Before you declare {it}, look at the readings that are told below."
    # A card declares just the effects that it lists, so that those declared already are in the list too.
    effects = (*case.result.ground.baseline.board.effects, *explanation.members)
    names = ", ".join(f'"{name}"' for name in effects)
    board = replace(case.result.ground.baseline.board, effects=effects)
    lacking = "".join(f"; before that the card must say more: {fault.got}" for fault in effect_faults(board))
    return (
        f"{sentence}. If you can see {it} on the board, declare {it}, effects = [{names}], and diagnose again to look "
        f"for what else is lacking{lacking}."
    )


def _finalist(case: Case, explanation: Explanation, summary: Summary) -> Finalist:
    return Finalist(
        effects=explanation.members,
        forms={form.effect: form.detail for form in likely_forms(case.result, explanation.index) if form.detail},
        probability=explanation.support,
        in_sample_rms_cents=summary.error.in_sample_rms_cents,
        leave_one_out_rms_cents=left_out_rms_cents(summary, case.carrying_modes),
        elastic=dict(summary.elastic.items()),
        sizes={
            owner: {name: sizes for name, sizes in effects.items() if name in explanation.members}
            for owner, effects in summary.effects.items()
        },
    )
