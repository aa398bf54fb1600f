"""Each candidate of a diagnosis: what it would do, how probable it is, and what became of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.material import MODULI, moduli
from bayesplate.diagnosis.decision.refits import likely_form
from bayesplate.diagnosis.decision.verdict import Answer, Verdict, size_posterior
from bayesplate.diagnosis.evidence.search import Candidate, Found
from bayesplate.diagnosis.shifts.signatures import acts_both_ways, are_alike
from bayesplate.diagnosis.wording.candidates import Amplitude, EffectEntry, ExchangeEntry
from bayesplate.diagnosis.wording.fates import fate_of, fate_of_exchange
from bayesplate.effects import EFFECTS, effects_of
from bayesplate.frequencies.laws import cents
from bayesplate.results.contract import finite

Floats = NDArray[np.float64]


def effect_entry(
    found: Found, verdict: Verdict, ranked: Sequence[Answer], one: Candidate, doubled: float
) -> EffectEntry:
    """What there is to say of a candidate effect.

    Parameters
    ----------
    found : Found
    verdict : Verdict
    ranked : sequence of Answer
        Best first.
    one : Candidate
    doubled : float
        Its inclusion probability with the width of every amplitude prior doubled.
    """
    ground = found.ground
    index = next(i for i, other in enumerate(ground.hypotheses) if other.members == (one.name,))
    gained = float(found.log_evidence[index] - found.log_evidence[0])
    best_fit = _best_fit(found, index) - _best_fit(found, 0)
    fate, because = fate_of(found, verdict, ranked, one.name, index)
    visible = cents(one.visible) if ground.n_directions else np.full(one.visible.size, np.nan)
    return EffectEntry(
        name=one.name,
        setup=_where(one),
        raw_rms_cents=finite(ground.baseline.weighted_rms(cents(one.raw))),
        visible_rms_cents=finite(ground.baseline.weighted_rms(visible)),
        visible_cents=tuple(finite(float(value)) for value in visible),
        below_detection_limit=ground.is_below_detection_limit(one.name),
        bias_percent=_bias(found, one),
        inclusion_probability=found.inclusion(one.name),
        inclusion_probability_with_doubled_priors=doubled,
        log_bayes_factor=gained,
        ockham_log_factor=gained - best_fit,
        p_value=p_value_of(found, index),
        amplitude=_amplitude(found, index, one),
        learnt_bits=_learnt(found, index, one),
        look_alikes=tuple(
            other
            for other, its in ground.candidates.items()
            if other != one.name and are_alike(ground.cosine(one.name, other), _acts_both_ways(one, its))
        ),
        rejected_because=because,
        fate=fate,
    )


def exchange_entries(found: Found, verdict: Verdict, ranked: Sequence[Answer]) -> tuple[ExchangeEntry, ...]:
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


def p_value_of(found: Found, index: int) -> float | None:
    """The prior predictive p-value of a hypothesis; None where constants meet every reading and nothing is left."""
    return found.p_value(index) if found.ground.n_directions else None


def _acts_both_ways(*every: Candidate) -> bool:
    """Whether one of some effects may also be the opposite of what is shown of it."""
    return any(acts_both_ways(one.laws[one.shown].form.free) for one in every)


def _where(one: Candidate) -> str:
    form = one.laws[0].form
    if EFFECTS[one.name].scope == "board":
        return "board"
    there = [setup.name for setup in form.board.setups if one.name in {e.name for e in effects_of(form.board, setup)}]
    return ", ".join(there)


def _bias(found: Found, one: Candidate) -> dict[str, float]:
    """What ignoring the effect at its nominal size does to the moduli, percent."""
    values = found.ground.baseline.values
    thickness, nu_xy = values["thickness"], values["poisson_xy"]
    symmetry = found.ground.baseline.board.symmetry
    free = symmetry.free_of(values)
    fitted, true = (symmetry.rigidities(each, nu_xy) for each in (free, free * np.exp(one.moved)))
    ignoring, knowing = (
        moduli(np.asarray(D["D_x"]), np.asarray(D["D_y"]), np.asarray(D["D_s"]), thickness, nu_xy)
        for D in (fitted, true)
    )
    return {n: 100.0 * float(a / b - 1.0) for n, a, b in zip(MODULI, ignoring, knowing, strict=True)}


def _best_fit(found: Found, index: int) -> float:
    """Log density at the best size, noise averaged: what the evidence would be without the width of the prior."""
    hypothesis = found.ground.hypotheses[index]
    seen = hypothesis.seen(found.ground.baseline, found.residual[None, :])
    terms = hypothesis.terms(found.ground.whole)
    log_density = terms.log_densities(seen)[:, 0]
    by_cell = log_density.reshape(hypothesis.noise.weights.size, -1)
    top = by_cell.max(axis=0)
    with np.errstate(divide="ignore"):
        summed = top + np.log(np.exp(by_cell - top).sum(axis=0)) - np.log(hypothesis.table.weights)
    return float(summed[hypothesis.table.weights > 0].max()) - terms.fold.half_log_det + hypothesis.log_labels


def _amplitude(found: Found, index: int, one: Candidate) -> Amplitude | None:
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


def _learnt(found: Found, index: int, one: Candidate) -> dict[str, float]:
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
