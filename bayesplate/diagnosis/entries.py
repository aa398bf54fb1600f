"""Each candidate of a diagnosis: what it would do, how probable it is, what became of it and why."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.diagnosis.result import Amplitude, EffectEntry, ExchangeEntry, Fate
from bayesplate.diagnosis.search import PASSES, Candidate, SearchResult
from bayesplate.diagnosis.signatures import look_alikes
from bayesplate.diagnosis.sizes import likely_form, size_posterior
from bayesplate.diagnosis.verdict import Answer, Verdict, answer_words, p_words
from bayesplate.effects import EFFECTS, effects_of
from bayesplate.posterior.slips import times
from bayesplate.results.contract import finite

Told = tuple[Fate, str | None]
"""What became of a candidate, and the reason; None for what was not rejected."""

_LIKELY = 0.1
"""Probability from which on an effect that is hardly visible by itself is told as any other."""


def effect_entry(
    found: SearchResult, verdict: Verdict, ranked: Sequence[Answer], one: Candidate, doubled: float
) -> EffectEntry:
    """All of a candidate effect; `doubled` is its inclusion probability with every prior twice as wide."""
    ground = found.ground
    index = next(i for i, other in enumerate(ground.hypotheses) if other.members == (one.name,))
    gained = float(found.log_evidence[index] - found.log_evidence[0])
    best_fit = _best_fit(found, index) - _best_fit(found, 0)
    fate, because = fate_of(found, verdict, ranked, one.name, index)
    shown, is_seen = one.signature, ground.n_directions > 0
    return EffectEntry(
        name=one.name,
        setup=_where(one),
        raw_rms_cents=finite(shown.raw_rms),
        visible_rms_cents=finite(shown.visible_rms) if is_seen else None,
        visible_cents=tuple(finite(float(value)) if is_seen else None for value in shown.visible),
        below_detection_limit=shown.is_below_detection_limit,
        bias_percent=shown.bias_percent,
        inclusion_probability=found.inclusion(one.name),
        inclusion_probability_with_doubled_priors=doubled,
        log_bayes_factor=gained,
        ockham_log_factor=gained - best_fit,
        p_value=p_value_of(found, index),
        amplitude=_amplitude(found, index, one),
        learnt_bits=_learnt(found, index, one),
        look_alikes=look_alikes([each.signature for each in ground.candidates.values()])[one.name] if is_seen else (),
        rejected_because=because,
        fate=fate,
    )


def exchange_entries(found: SearchResult, verdict: Verdict, ranked: Sequence[Answer]) -> tuple[ExchangeEntry, ...]:
    """Exchanged labels, as one candidate each."""
    ground = found.ground
    taken = {one.index for one in verdict.stands_for}
    labels = [f"{label}" for setup in ground.baseline.board.setups for label in setup.labels]
    entries = []
    for i, one in enumerate(ground.hypotheses):
        if one.swap is None:
            continue
        setup = ground.baseline.board.setups[ground.baseline.setup_index[one.swap.first]]
        fate, because = fate_of_exchange(found, verdict, ranked, i, is_accepted=i in taken)
        entries.append(
            ExchangeEntry(
                setup=setup.name,
                labels=(labels[one.swap.first], labels[one.swap.second]),
                inclusion_probability=float(found.probability[i]),
                log_bayes_factor=float(found.log_evidence[i] - found.log_evidence[0]),
                rejected_because=because,
                fate=fate,
            )
        )
    return tuple(entries)


def p_value_of(found: SearchResult, index: int) -> float | None:
    """The prior predictive p-value of a hypothesis; None where constants meet every reading and nothing is left."""
    return found.p_value(index) if found.ground.n_directions else None


def _where(one: Candidate) -> str:
    form = one.laws[0].form
    if EFFECTS[one.name].scope == "board":
        return "board"
    there = [setup.name for setup in form.board.setups if one.name in {e.name for e in effects_of(form.board, setup)}]
    return ", ".join(there)


def _best_fit(found: SearchResult, index: int) -> float:
    """Log density at the best size, noise averaged: what the evidence would be without the width of the prior."""
    hypothesis = found.ground.hypotheses[index]
    weights, by_cell = hypothesis.table.weights, hypothesis.log_by_cell(found.ground.baseline, found.residual)
    best = float((by_cell[weights > 0] - np.log(weights[weights > 0])).max())
    return best - hypothesis.own.half_log_det + hypothesis.log_labels


def _amplitude(found: SearchResult, index: int, one: Candidate) -> Amplitude | None:
    """Quantiles of the first free parameter of the most probable form, given that the effect is there.

    Of an effect whose size the card fixes: the first of its parameters, without spread.
    """
    if not one.laws[0].form.free:
        return _fixed(one)
    best = likely_form(found, index, 0)
    free = one.laws[best].form.free[0]
    share, z = size_posterior(found, index, 0, best, 0)
    order = np.argsort(z)
    cumulated = np.cumsum(share[order]) - 0.5 * share[order]
    quantiles = np.interp([0.05, 0.5, 0.95], cumulated / share.sum(), z[order])
    low, middle, high = (float(free.prior.value(q)) for q in quantiles)
    return Amplitude(parameter=free.key, form=one.laws[best].form.detail, q05=low, q50=middle, q95=high, unit=free.unit)


def _learnt(found: SearchResult, index: int, one: Candidate) -> dict[str, float]:
    """How far the posterior of each size left its prior, given that the effect is there: bits, by parameter.

    Of the most probable form. A size of which nothing is learnt says nothing against its null value either.
    """
    table = found.ground.hypotheses[index].table
    form = likely_form(found, index, 0)
    prior = table.weights[table.form == form]
    result = {}
    for i, free in enumerate(one.laws[form].form.free):
        share, z = size_posterior(found, index, 0, form, i)
        _, cells = np.unique(z, return_inverse=True)
        after, before = (np.bincount(cells, weights=part / part.sum()) for part in (share, prior))
        seen = after > 0.0
        result[free.key] = float(np.sum(after[seen] * np.log2(after[seen] / before[seen])))
    return result


def _fixed(one: Candidate) -> Amplitude | None:
    form = one.laws[0].form
    for parameter in form.board.parameters:
        if parameter.effect == one.name and parameter.prior.is_exact:
            size = parameter.prior.mean
            return Amplitude(
                parameter=parameter.key, form=form.detail, q05=size, q50=size, q95=size, unit=parameter.unit
            )
    return None


def fate_of(found: SearchResult, verdict: Verdict, ranked: Sequence[Answer], name: str, index: int) -> Told:
    """What became of a candidate effect; `index` is that of the hypothesis that it acts alone."""
    if name in verdict.effects:
        return "in the verdict", None
    if (
        verdict.is_needed
        and verdict.word == "unexplained"
        and verdict.best is not None
        and name in verdict.best.members
    ):
        return "does not fit", verdict.reason
    if found.ground.candidates[name].signature.is_below_detection_limit and not (
        verdict.is_needed and found.inclusion(name) >= _LIKELY
    ):
        return "not detectable", "its visible part is below what these readings could show"
    return _without_need(found, verdict) or _misfit(found, index) or _less_probable(found, ranked, name, index)


def fate_of_exchange(
    found: SearchResult, verdict: Verdict, ranked: Sequence[Answer], index: int, *, is_accepted: bool
) -> Told:
    """What became of two labels that may have been exchanged, with the likelihood ratio of the exchange."""
    if is_accepted:
        return "in the verdict", None
    fate, because = _without_need(found, verdict) or _misfit(found, index) or _less_probable(found, ranked, None, index)
    return fate, f"{because}; {ratio_words(found, index)}"


def _without_need(found: SearchResult, verdict: Verdict) -> Told | None:
    if verdict.is_needed:
        return None
    fate: Fate = "not established" if verdict.word == "unexplained" else "not needed"
    return fate, f"{fate}: nothing lacking has a probability of {found.none:.2f}"


def _misfit(found: SearchResult, index: int) -> Told | None:
    """ "does not fit" where the misfit is too large with the candidate alone."""
    p_value = found.p_value(index)
    if p_value >= PASSES:
        return None
    return "does not fit", f"with it alone the misfit is still too large ({p_words(p_value)})"


def _less_probable(found: SearchResult, ranked: Sequence[Answer], name: str | None, index: int) -> Told:
    """ "less probable", with the support of its best answer beside that of the best of all."""
    best = ranked[0]
    own = max((one.support for one in ranked if one.index == index or name in one.members), default=0.0)
    mine, others = f"{own:.3f}", f"{best.support:.3f}"
    word = "less probable" if mine != others else "no more probable"
    return "less probable", f"{word} ({mine}) than {answer_words(found, best)} ({others})"


def ratio_words(found: SearchResult, index: int) -> str:
    """How much likelier the readings are under a hypothesis that exchanges two labels than as they are called."""
    gained = float(found.log_evidence[index] - found.log_evidence[0])
    likelier = "likelier" if gained > 0 else "less likely"
    return f"with these labels exchanged the readings are {times(abs(gained))} {likelier}"
