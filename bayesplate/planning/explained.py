"""Beliefs after a search: the surviving explanations, each as normal terms.

Around a cell of an effect's table and at one level of noise

    y = shift + X x + Z z + S t + noise,

with x the logarithms of the free rigidities less their values in the cell, z the standard coordinates of the uncertain
inputs, and t the place within the cell. Given the readings all three are normal, and so is u = (x, z, s), with x
counted from the estimate and s the standard coordinates of the effect's sizes; each such term has the posterior weight
of its cell and its level of noise.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.prior import PriorCard
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import with_forms
from bayesplate.diagnosis.readings import wrong_reading
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult
from bayesplate.diagnosis.terms import normalised_weights
from bayesplate.diagnosis.verdict import ALTERNATIVE_FACTOR, Explanation, explanation_words, rank_explanations
from bayesplate.planning.beliefs import (
    N_TERMS,
    NO_EFFECT,
    Beliefs,
    ExplanationTerms,
    FormTerms,
    KnownBoard,
    ReadingsAtHand,
    log_moduli,
    station_laws,
)
from bayesplate.posterior.statistics import resample

UNEXPLAINED_NOTE = (
    "no effect that is tried explains the readings, so that nothing is said of telling effects apart: what is planned "
    "here takes the model for right, which it is not"
)
_LIKELY_SHARE = 0.05
"""Least share of an explanation's terms with the same forms; terms of rarer forms are given the likeliest ones."""
MOST_EXPLANATIONS = 4
"""Most explanations besides that of no effect; each needs a dozen plates to be solved."""


def search_beliefs(
    result: SearchResult, prior: PriorCard | None, rng: np.random.Generator, among: Sequence[Explanation] | None = None
) -> Beliefs:
    """Beliefs about a board after a search: with the explanations `among` which to choose, or with the surviving ones.

    No effect alone where nothing explains the readings. The prior is for the noise of new stations.
    """
    base, is_failed = result.ground.baseline, among is None and is_unexplained(result)
    if is_failed:
        among = [Explanation((), 0, result.probability_of_none)]
    explanations = explanation_terms(result, surviving_explanations(result) if among is None else among, rng)
    n_fitted = base.slopes.shape[1] + base.input_slopes.shape[1]
    known_board = KnownBoard(base.board, base.values, station_laws(base.board, base.values, prior), np.eye(n_fitted))
    return Beliefs(
        (known_board,),
        explanations,
        notes=(*((UNEXPLAINED_NOTE,) if is_failed else ()), *base.board.notes),
        wrong_reading=wrong_reading(result) if is_failed else None,
    )


def is_unexplained(result: SearchResult) -> bool:
    """Whether the readings have too small a p-value both without an effect and with the best explanation."""
    if not result.ground.n_directions or result.p_value(0) >= LEAST_P_VALUE:
        return False
    explanations = rank_explanations(result)
    return not explanations or result.p_value(explanations[0].index) < LEAST_P_VALUE


def explanation_terms(
    result: SearchResult, explanations: Sequence[Explanation], rng: np.random.Generator
) -> tuple[ExplanationTerms, ...]:
    """Explanations of a search, that of no effect with index 0, as terms; their probabilities sum to one."""
    total = sum(explanation.support for explanation in explanations)
    return tuple(
        _explanation_terms(result, explanation, explanation.support / total, rng) for explanation in explanations
    )


def _explanation_terms(
    result: SearchResult, explanation: Explanation, probability: float, rng: np.random.Generator
) -> ExplanationTerms:
    """An explanation of a search as terms: cells and levels of noise drawn by their posterior weights."""
    base, hypothesis = result.ground.baseline, result.ground.hypotheses[explanation.index]
    terms = hypothesis.terms
    residuals = hypothesis.residual_under_labels(base, result.residual[None, :])
    picked = resample(normalised_weights(terms.log_densities(residuals)[:, 0]), N_TERMS, rng)
    levels, cells = np.divmod(picked, terms.table.n_cells)
    noise = terms.noise.sd[levels]
    table, terms_baseline = terms.table, terms.baseline
    sides = np.concatenate([terms_baseline.slopes, terms_baseline.input_slopes], axis=1)
    design = np.concatenate([np.tile(sides, (N_TERMS, 1, 1)), table.slopes[cells]], axis=2)
    variance = noise[:, terms_baseline.setup_index] ** 2 + terms_baseline.own_variance
    mean, covariance = _condition_on_readings(
        design, variance, residuals - table.shift[cells], terms_baseline.mode_readings, terms_baseline.slopes.shape[1]
    )
    n, n_u = terms_baseline.slopes.shape[1], mean.shape[1]
    forms, z, step = _effect_sizes(result, explanation, cells, n_u - table.slopes.shape[2])
    first = n_u - z.shape[1]
    # from places in the cells to sizes, and to the constants that move with them: u = start + turn u
    turn, start = np.tile(np.eye(n_u), (N_TERMS, 1, 1)), np.zeros((N_TERMS, n_u))
    turn[:, :n, first:] = table.moved_slopes[cells]
    turn[:, first:, first:] = step[:, :, None] * np.eye(n_u - first)
    start[:, :n], start[:, first:] = table.moved[cells], z
    slopes = design @ np.linalg.inv(turn)
    shift = terms_baseline.middle + table.shift[cells] - np.einsum("tru,tu->tr", slopes, start)
    middle, gradient = log_moduli(base.board, base.log_rigidities)
    return ExplanationTerms(
        members=hypothesis.members,
        words=explanation_words(result, explanation) if explanation.members else NO_EFFECT,
        probability=probability,
        mean=start + np.einsum("tuv,tv->tu", turn, mean),
        covariance=turn @ covariance @ np.swapaxes(turn, 1, 2),
        noise=noise,
        middle=np.tile(middle, (N_TERMS, 1)),
        target_slopes=np.tile(np.pad(gradient, ((0, 0), (0, n_u - first))), (N_TERMS, 1, 1)),
        forms=forms,
        readings_at_hand=_readings_at_hand(terms_baseline, base, shift, slopes),
    )


def _readings_at_hand(terms_baseline: Baseline, base: Baseline, shift: Floats, slopes: Floats) -> ReadingsAtHand:
    """The readings at hand under the labels of a hypothesis, with the expected frequency of each mode."""
    same = (terms_baseline.rows[:, None] == base.rows) & terms_baseline.is_mode[:, None]
    expected = np.where(terms_baseline.is_mode, shift, np.nan)
    return ReadingsAtHand(expected, slopes, np.where(same.any(axis=1), same.argmax(axis=1), -1))


def _effect_sizes(
    result: SearchResult, explanation: Explanation, cells: Indices, first: int
) -> tuple[tuple[FormTerms, ...], Floats, Floats]:
    """The forms of the effects in some cells of an explanation's table; standard coordinates of their sizes, and steps.

    Coordinates and their changes over one standard deviation of the cell are (n_cells, n_tangents) arrays. Unlikely
    forms are replaced by the likeliest.
    """
    ground, joint_table = result.ground, result.ground.hypotheses[explanation.index].table
    candidates = ground.members(explanation.index)
    if not candidates:
        return (), np.zeros((len(cells), 0)), np.zeros((len(cells), 0))
    member_tables = [joint_table.member(i, cells) for i in range(len(candidates))]
    z, step = (
        np.concatenate([getattr(table, name)[cell] for table, cell in member_tables], axis=1)
        for name in ("z", "z_slopes")
    )
    step[step == 0.0] = 1.0  # columns that only other forms have
    starts = first + np.cumsum([0, *(table.z.shape[1] for table, _ in member_tables)])
    index = np.stack([table.form[cell] for table, cell in member_tables])
    keys, which, counts = np.unique(index, axis=1, return_inverse=True, return_counts=True)
    which = np.where(counts[which] < _LIKELY_SHARE * len(cells), counts.argmax(), which)
    forms = []
    for i in np.unique(which):
        likely_forms = [candidate.laws[int(k)].form for candidate, k in zip(candidates, keys[:, i], strict=True)]
        size_columns = [
            (form.effect, free, start + j)
            for form, start in zip(likely_forms, starts, strict=False)
            for j, free in enumerate(form.free)
        ]
        effects, parameters, columns = zip(*size_columns, strict=True) if size_columns else ((), (), ())
        board = with_forms(ground.baseline.board, likely_forms)
        rows = np.flatnonzero(which == i)
        forms.append(FormTerms(rows, board, effects, parameters, np.array(columns, dtype=np.intp)))
    return tuple(forms), z, step


def _condition_on_readings(
    design: Floats, variance: Floats, residuals: Floats, used: Indices, n_constants: int
) -> tuple[Floats, Floats]:
    """Mean and covariance of u in some terms, given the residuals of the used readings."""
    design, residuals = design[:, used], residuals[:, used]
    weighted = design / variance[:, used, None]
    prior = np.ones(design.shape[2])
    prior[:n_constants] = 0.0
    covariance = np.asarray(np.linalg.inv(np.swapaxes(weighted, 1, 2) @ design + np.diag(prior)))
    return np.einsum("tuv,tnv,tn->tu", covariance, weighted, residuals), covariance


def surviving_explanations(result: SearchResult, rivals: Collection[tuple[str, ...]] = ()) -> tuple[Explanation, ...]:
    """No effect, and the explanations of a search within a factor ten of the best of them, the most probable first.

    No effect is left out where it is ten times less probable than the best explanation. Rivals survive in any case: a
    verdict lists them because another assumption favours them.
    """
    return survivors_by_support(
        result,
        {explanation.members: explanation.support for explanation in rank_explanations(result)},
        result.probability_of_none,
        rivals,
    )


def survivors_by_support(
    result: SearchResult,
    support: Mapping[tuple[str, ...], float],
    probability_of_none: float,
    rivals: Collection[tuple[str, ...]] = (),
) -> tuple[Explanation, ...]:
    """The surviving explanations by the probabilities of a finished diagnosis: of sets of effects, and of no effect.

    Effects that the search has not tried are left out.
    """
    index: dict[tuple[str, ...], int] = {}
    for i, hypothesis in enumerate(result.ground.hypotheses):
        best = index.get(hypothesis.members)
        if best is None or (hypothesis.swap is None and result.probability[i] > result.probability[best]):
            index[hypothesis.members] = i
    ranked = [Explanation(members, index[members], p) for members, p in support.items() if members in index and p > 0.0]
    ranked.sort(key=lambda explanation: -explanation.support)
    near = [
        explanation
        for explanation in ranked
        if explanation.support * ALTERNATIVE_FACTOR >= ranked[0].support or explanation.members in rivals
    ][:MOST_EXPLANATIONS]
    survivors = (
        near
        if near and probability_of_none * ALTERNATIVE_FACTOR < near[0].support
        else [*near, Explanation((), 0, probability_of_none)]
    )
    return tuple(sorted(survivors, key=lambda explanation: -explanation.support))


def explanations_of_effects(result: SearchResult, effects: Sequence[str]) -> tuple[Explanation, ...]:
    """Explanations by effects that a user names: no effect, each effect alone, and likely pairs of them.

    Their probabilities are those of the search. A pair ten times less probable than the best explanation is left out.
    """
    explanations = [
        Explanation(hypothesis.members, i, float(result.probability[i]))
        for i, hypothesis in enumerate(result.ground.hypotheses)
        if set(hypothesis.members) <= set(effects) and hypothesis.swap is None
    ]
    highest = max(explanation.support for explanation in explanations)
    likely = [
        explanation
        for explanation in explanations
        if len(explanation.members) < 2 or explanation.support * ALTERNATIVE_FACTOR >= highest
    ]
    return tuple(sorted(likely, key=lambda explanation: -explanation.support))
