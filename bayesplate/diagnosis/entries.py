"""The entry of each candidate of a diagnosis: its shifts, its probability, its fate and the reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.result import Amplitude, EffectEntry, ExchangeEntry, Fate
from bayesplate.diagnosis.search import LEAST_P_VALUE, Candidate, SearchResult
from bayesplate.diagnosis.signatures import look_alikes
from bayesplate.diagnosis.sizes import likely_form, size_posterior
from bayesplate.diagnosis.verdict import Explanation, Verdict, explanation_words, p_value_words
from bayesplate.effects import EFFECTS, effects_of
from bayesplate.posterior.slips import odds_in_words
from bayesplate.results.contract import finite_or_none

FateAndReason = tuple[Fate, str | None]
"""The fate of a candidate, and the reason; None where it was not rejected."""

_LEAST_INCLUSION = 0.1
"""Inclusion probability from which an effect below its detection limit is judged like any other."""


def effect_entry(
    result: SearchResult,
    verdict: Verdict,
    explanations: Sequence[Explanation],
    candidate: Candidate,
    doubled_inclusion: float,
) -> EffectEntry:
    """The entry of a candidate effect; `doubled_inclusion` is its probability with every prior twice as wide."""
    ground = result.ground
    index = next(i for i, hypothesis in enumerate(ground.hypotheses) if hypothesis.members == (candidate.name,))
    log_bayes_factor = float(result.log_evidence[index] - result.log_evidence[0])
    best_fit = _best_log_density(result, index) - _best_log_density(result, 0)
    fate, reason = fate_of(result, verdict, explanations, candidate.name, index)
    signature, has_directions = candidate.signature, ground.n_directions > 0
    return EffectEntry(
        name=candidate.name,
        setup=_setup_names(candidate),
        raw_rms_cents=finite_or_none(signature.raw_rms),
        visible_rms_cents=finite_or_none(signature.visible_rms) if has_directions else None,
        visible_cents=tuple(finite_or_none(float(value)) if has_directions else None for value in signature.visible),
        below_detection_limit=signature.is_below_detection_limit,
        bias_percent=signature.bias_percent if np.isfinite(list(signature.bias_percent.values())).all() else None,
        inclusion_probability=result.inclusion(candidate.name),
        inclusion_probability_with_doubled_priors=doubled_inclusion,
        log_bayes_factor=log_bayes_factor,
        ockham_log_factor=log_bayes_factor - best_fit,
        p_value=p_value_of(result, index),
        amplitude=_amplitude(result, index, candidate),
        learnt_bits=_learnt_bits(result, index, candidate),
        look_alikes=look_alikes([candidate.signature for candidate in ground.candidates.values()])[candidate.name]
        if has_directions
        else (),
        rejected_because=reason,
        fate=fate,
    )


def exchange_entries(
    result: SearchResult, verdict: Verdict, explanations: Sequence[Explanation]
) -> tuple[ExchangeEntry, ...]:
    """The entry of each exchange of two labels."""
    ground = result.ground
    named_indices = {explanation.index for explanation in verdict.explanations}
    labels = [f"{label}" for setup in ground.baseline.board.setups for label in setup.labels]
    entries = []
    for i, hypothesis in enumerate(ground.hypotheses):
        if hypothesis.swap is None:
            continue
        setup = ground.baseline.board.setups[ground.baseline.setup_index[hypothesis.swap.first]]
        fate, reason = fate_of_exchange(result, verdict, explanations, i, is_accepted=i in named_indices)
        entries.append(
            ExchangeEntry(
                setup=setup.name,
                labels=(labels[hypothesis.swap.first], labels[hypothesis.swap.second]),
                inclusion_probability=float(result.probability[i]),
                log_bayes_factor=float(result.log_evidence[i] - result.log_evidence[0]),
                rejected_because=reason,
                fate=fate,
            )
        )
    return tuple(entries)


def p_value_of(result: SearchResult, index: int) -> float | None:
    """The prior predictive p-value of a hypothesis; None where the constants fit every reading exactly."""
    return result.p_value(index) if result.ground.n_directions else None


def _setup_names(candidate: Candidate) -> str:
    form = candidate.laws[0].form
    if EFFECTS[candidate.name].scope == "board":
        return "board"
    names = [
        setup.name
        for setup in form.board.setups
        if candidate.name in {effect.name for effect in effects_of(form.board, setup)}
    ]
    return ", ".join(names)


def _best_log_density(result: SearchResult, index: int) -> float:
    """ln of the density at the best size, noise averaged: the evidence without the cost of the prior's width."""
    hypothesis = result.ground.hypotheses[index]
    weights, by_cell = hypothesis.table.weights, hypothesis.log_by_cell(result.ground.baseline, result.residual)
    best = float((by_cell[weights > 0] - np.log(weights[weights > 0])).max())
    return best - hypothesis.baseline.half_log_det + hypothesis.log_labels


def _amplitude(result: SearchResult, index: int, candidate: Candidate) -> Amplitude | None:
    """Quantiles of the first free parameter of the most probable form, given that the effect is present.

    Where the card fixes the size of the effect, its first parameter, without spread.
    """
    if not candidate.laws[0].form.free:
        return _fixed_amplitude(candidate)
    form_index = likely_form(result, index, 0)
    free = candidate.laws[form_index].form.free[0]
    share, z = size_posterior(result, index, 0, form_index, 0)
    quantiles = _size_quantiles(free.prior, z, share, (0.05, 0.5, 0.95))
    low, middle, high = (float(free.prior.value(q)) for q in quantiles)
    return Amplitude(
        parameter=free.key, form=candidate.laws[form_index].form.detail, q05=low, q50=middle, q95=high, unit=free.unit
    )


def _learnt_bits(result: SearchResult, index: int, candidate: Candidate) -> dict[str, float]:
    """Information gain on each size of the most probable form, given that the effect is present: bits, by parameter.

    A size with no gain says nothing against its null value either.
    """
    table = result.ground.hypotheses[index].table
    form = likely_form(result, index, 0)
    prior = table.weights[table.form == form]
    bits = {}
    for i, free in enumerate(candidate.laws[form].form.free):
        share, z = size_posterior(result, index, 0, form, i)
        _, cells = np.unique(z, return_inverse=True)
        after, before = (np.bincount(cells, weights=shares / shares.sum()) for shares in (share, prior))
        is_possible = after > 0.0
        bits[free.key] = float(np.sum(after[is_possible] * np.log2(after[is_possible] / before[is_possible])))
    return bits


def _size_quantiles(prior: Quantity, z: Floats, share: Floats, levels: Sequence[float]) -> Floats:
    """Quantiles of a size from the shares of its nodes, each spread half-way to its neighbours.

    Of many sizes each has a single node, which says nothing: the quantiles are those of the prior.
    """
    nodes, places = np.unique(z, return_inverse=True)  # cells of several sizes have one node more than once
    if nodes.size == 1:
        return np.asarray(prior.standard_quantile(levels))
    shares = np.bincount(places, weights=share) / share.sum()
    ends = nodes[[0, -1]] + 0.5 * (nodes[[0, -1]] - nodes[[1, -2]])
    cumulated = np.cumsum(shares) - 0.5 * shares
    return np.interp(levels, [0.0, *cumulated, 1.0], [ends[0], *nodes, ends[1]])


def _fixed_amplitude(candidate: Candidate) -> Amplitude | None:
    form = candidate.laws[0].form
    for parameter in form.board.parameters:
        if parameter.effect == candidate.name and parameter.prior.is_exact:
            size = parameter.prior.mean
            return Amplitude(
                parameter=parameter.key, form=form.detail, q05=size, q50=size, q95=size, unit=parameter.unit
            )
    return None


def fate_of(
    result: SearchResult, verdict: Verdict, explanations: Sequence[Explanation], name: str, index: int
) -> FateAndReason:
    """The fate of a candidate effect, and the reason; `index` is that of the hypothesis that it acts alone."""
    if name in verdict.effects:
        return "in the verdict", None
    if (
        verdict.is_needed
        and verdict.word == "unexplained"
        and verdict.best is not None
        and name in verdict.best.members
    ):
        return "does not fit", verdict.reason
    if result.ground.candidates[name].signature.is_below_detection_limit and not (
        verdict.is_needed and result.inclusion(name) >= _LEAST_INCLUSION
    ):
        return "not detectable", "its visible part is below what these readings could show"
    return (
        _fate_without_need(result, verdict)
        or _fate_of_misfit(result, index)
        or _fate_of_less_probable(result, explanations, name, index)
    )


def fate_of_exchange(
    result: SearchResult, verdict: Verdict, explanations: Sequence[Explanation], index: int, *, is_accepted: bool
) -> FateAndReason:
    """The fate of an exchange of two labels, and the reason with its likelihood ratio."""
    if is_accepted:
        return "in the verdict", None
    fate, reason = (
        _fate_without_need(result, verdict)
        or _fate_of_misfit(result, index)
        or _fate_of_less_probable(result, explanations, None, index)
    )
    return fate, f"{reason}; {exchange_ratio_words(result, index)}"


def _fate_without_need(result: SearchResult, verdict: Verdict) -> FateAndReason | None:
    if verdict.is_needed:
        return None
    fate: Fate = "not established" if verdict.word == "unexplained" else "not needed"
    return fate, f"{fate}: that nothing is missing has a probability of {result.probability_of_none:.2f}"


def _fate_of_misfit(result: SearchResult, index: int) -> FateAndReason | None:
    """ "does not fit" where the misfit is too large with the candidate alone."""
    p_value = result.p_value(index)
    if p_value >= LEAST_P_VALUE:
        return None
    return "does not fit", f"with it alone the misfit is still too large ({p_value_words(p_value)})"


def _fate_of_less_probable(
    result: SearchResult, explanations: Sequence[Explanation], name: str | None, index: int
) -> FateAndReason:
    """ "less probable", with the support of its best explanation beside that of the best of all."""
    best = explanations[0]
    support = max(
        (
            explanation.support
            for explanation in explanations
            if explanation.index == index or name in explanation.members
        ),
        default=0.0,
    )
    support_text, best_text = f"{support:.3f}", f"{best.support:.3f}"
    comparison = "less probable" if support_text != best_text else "no more probable"
    return "less probable", f"{comparison} ({support_text}) than {explanation_words(result, best)} ({best_text})"


def exchange_ratio_words(result: SearchResult, index: int) -> str:
    """How much likelier the readings are with two labels exchanged than with the labels of the card, in words."""
    log_ratio = float(result.log_evidence[index] - result.log_evidence[0])
    likelier = "likelier" if log_ratio > 0 else "less likely"
    return f"with these labels exchanged the readings are {odds_in_words(abs(log_ratio))} {likelier}"
