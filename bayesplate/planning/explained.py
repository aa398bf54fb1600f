"""What a search leaves to be believed: the explanations that survive, each as normal terms.

Around a cell of an effect's table and at one level of noise

    y = shift + X x + Z z + S t + noise,

with x the logarithms of the free rigidities beyond what the cell has moved them by, z the standard coordinates of the
uncertain inputs, and t the place within the cell. Given the readings all three are normal, and so is u = (x, z, s), x
counted from the estimate and s the standard coordinates of the effect's sizes; each such term has the weight that its
cell and its level of noise have now.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.prior import PriorCard
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.forms import with_forms
from bayesplate.diagnosis.readings import wrong_reading
from bayesplate.diagnosis.search import PASSES, SearchResult
from bayesplate.diagnosis.terms import normalised
from bayesplate.diagnosis.verdict import WITHIN, Answer, answer_words, answers
from bayesplate.planning.beliefs import (
    N_TERMS,
    NOTHING_LACKS,
    AtHand,
    Belief,
    Beliefs,
    FormTerms,
    KnownBoard,
    Rows,
    laws_of,
    log_moduli,
)
from bayesplate.posterior.statistics import resampled

UNEXPLAINED = (
    "no effect that is tried explains the readings, so that nothing is said of telling effects apart: what is planned "
    "here takes the model for right, which it is not"
)
_LIKELY = 0.05
"""Share of an explanation's terms below which the forms of its effects are taken for the likeliest ones."""
MOST = 4
"""Explanations besides that of no effect; each takes a dozen plates to solve."""


def believed(
    found: SearchResult, prior: PriorCard | None, rng: np.random.Generator, among: Sequence[Answer] | None = None
) -> Beliefs:
    """What a search leaves to be believed of a board: of the explanations among those given, or of those that survive.

    No effect alone where nothing explains the readings. The prior is of the noise where the board was never held.
    """
    base, is_failed = found.ground.baseline, among is None and is_unexplained(found)
    left = [Answer((), 0, found.none)] if is_failed else survivors(found) if among is None else among
    n_fitted, explanations = base.slopes.shape[1] + base.input_slopes.shape[1], explanations_of(found, left, rng)
    known = KnownBoard(base.board, base.values, laws_of(base.board, base.values, prior), np.eye(n_fitted))
    if is_failed:
        return Beliefs((known,), explanations, notes=(UNEXPLAINED, *base.board.notes), wrong=wrong_reading(found))
    return Beliefs((known,), explanations, notes=base.board.notes)


def is_unexplained(found: SearchResult) -> bool:
    """Whether the readings fail the gate without an effect and with the best that was found."""
    if not found.ground.n_directions or found.p_value(0) >= PASSES:
        return False
    ranked = answers(found)
    return not ranked or found.p_value(ranked[0].index) < PASSES


def explanations_of(found: SearchResult, left: Sequence[Answer], rng: np.random.Generator) -> tuple[Belief, ...]:
    """Answers of a search, that of no effect with index 0, as explanations whose probabilities sum to one."""
    total = sum(one.support for one in left)
    return tuple(_explanation(found, one, one.support / total, rng) for one in left)


def _explanation(found: SearchResult, answer: Answer, probability: float, rng: np.random.Generator) -> Belief:
    """An answer of a search as terms: cells and levels of noise drawn by what they weigh now."""
    base, hypothesis = found.ground.baseline, found.ground.hypotheses[answer.index]
    terms = hypothesis.terms
    seen = hypothesis.seen(base, found.residual[None, :])
    picked = resampled(normalised(terms.log_densities(seen)[:, 0]), N_TERMS, rng)
    levels, cells = np.divmod(picked, terms.table.n_cells)
    noise = terms.noise.sd[levels]
    table, own = terms.table, terms.baseline
    sides = np.concatenate([own.slopes, own.input_slopes], axis=1)
    design = np.concatenate([np.tile(sides, (N_TERMS, 1, 1)), table.slopes[cells]], axis=2)
    variance = noise[:, own.setup_index] ** 2 + own.own_variance
    mean, covariance = _conditioned(design, variance, seen - table.shift[cells], own.used, own.slopes.shape[1])
    n, n_u = own.slopes.shape[1], mean.shape[1]
    forms, z, step = _sizes(found, answer, cells, n_u - table.slopes.shape[2])
    first = n_u - z.shape[1]
    # from places in the cells to sizes, and to constants that have moved with them: u = start + turn u
    turn, start = np.tile(np.eye(n_u), (N_TERMS, 1, 1)), np.zeros((N_TERMS, n_u))
    turn[:, :n, first:] = table.moved_slopes[cells]
    turn[:, first:, first:] = step[:, :, None] * np.eye(n_u - first)
    start[:, :n], start[:, first:] = table.moved[cells], z
    slopes = design @ np.linalg.inv(turn)
    shift = own.middle + table.shift[cells] - np.einsum("tru,tu->tr", slopes, start)
    middle, gradient = log_moduli(base.board, base.log_rigidities)
    return Belief(
        members=hypothesis.members,
        words=answer_words(found, answer) if answer.members else NOTHING_LACKS,
        probability=probability,
        mean=start + np.einsum("tuv,tv->tu", turn, mean),
        covariance=turn @ covariance @ np.swapaxes(turn, 1, 2),
        noise=noise,
        middle=np.tile(middle, (N_TERMS, 1)),
        wanted=np.tile(np.pad(gradient, ((0, 0), (0, n_u - first))), (N_TERMS, 1, 1)),
        forms=forms,
        again=_at_hand(own, base, shift, slopes),
    )


def _at_hand(own: Baseline, base: Baseline, shift: Floats, slopes: Floats) -> AtHand:
    """The readings under the labels of a hypothesis: what is expected of each of these modes is given."""
    same = (own.rows[:, None] == base.rows) & own.is_mode[:, None]
    expected = np.where(own.is_mode, shift, np.nan)
    return AtHand(expected, slopes, np.where(same.any(axis=1), same.argmax(axis=1), -1))


def _sizes(
    found: SearchResult, answer: Answer, cells: Rows, first: int
) -> tuple[tuple[FormTerms, ...], Floats, Floats]:
    """The forms of the effects in some cells of an answer's table; standard coordinates of their sizes, and steps.

    Coordinates and their changes over one standard deviation of the cell are (n_cells, n_tangents) arrays. Forms that
    are not likely are taken for the likeliest.
    """
    ground, whole = found.ground, found.ground.hypotheses[answer.index].table
    candidates = ground.members(answer.index)
    if not candidates:
        return (), np.zeros((len(cells), 0)), np.zeros((len(cells), 0))
    parts = [whole.member(i, cells) for i in range(len(candidates))]
    z, step = (np.concatenate([getattr(table, name)[at] for table, at in parts], axis=1) for name in ("z", "z_slopes"))
    step[step == 0.0] = 1.0  # columns that only other forms have
    starts = first + np.cumsum([0, *(table.z.shape[1] for table, _ in parts)])
    index = np.stack([table.form[at] for table, at in parts])
    keys, which, counts = np.unique(index, axis=1, return_inverse=True, return_counts=True)
    which = np.where(counts[which] < _LIKELY * len(cells), counts.argmax(), which)
    forms = []
    for i in np.unique(which):
        chosen = [one.laws[int(k)].form for one, k in zip(candidates, keys[:, i], strict=True)]
        listed = [
            (form.effect, free, start + j)
            for form, start in zip(chosen, starts, strict=False)
            for j, free in enumerate(form.free)
        ]
        effects, parameters, columns = zip(*listed, strict=True) if listed else ((), (), ())
        board = with_forms(ground.baseline.board, chosen)
        rows = np.flatnonzero(which == i)
        forms.append(FormTerms(rows, board, effects, parameters, np.array(columns, dtype=np.intp)))
    return tuple(forms), z, step


def _conditioned(design: Floats, variance: Floats, seen: Floats, used: Rows, n_constants: int) -> tuple[Floats, Floats]:
    """Mean and covariance of u in some terms, given what is seen of the readings that are used."""
    design, seen = design[:, used], seen[:, used]
    weighted = design / variance[:, used, None]
    prior = np.ones(design.shape[2])
    prior[:n_constants] = 0.0
    covariance = np.asarray(np.linalg.inv(np.swapaxes(weighted, 1, 2) @ design + np.diag(prior)))
    return np.einsum("tuv,tnv,tn->tu", covariance, weighted, seen), covariance


def survivors(found: SearchResult, rivals: Collection[tuple[str, ...]] = ()) -> tuple[Answer, ...]:
    """No effect, and the answers of a search within a factor ten of the best of them, the most probable first.

    No effect is left out where it is ten times less probable than the best answer. Rivals survive in any case: a
    verdict lists them because another assumption favours them.
    """
    return surviving(found, {one.members: one.support for one in answers(found)}, found.none, rivals)


def surviving(
    found: SearchResult, support: Mapping[tuple[str, ...], float], none: float, rivals: Collection[tuple[str, ...]] = ()
) -> tuple[Answer, ...]:
    """The same by probabilities, of answers by their effects and of none, that are known from a finished diagnosis.

    Effects that the search has not tried are left out.
    """
    index: dict[tuple[str, ...], int] = {}
    for i, one in enumerate(found.ground.hypotheses):
        best = index.get(one.members)
        if best is None or (one.swap is None and found.probability[i] > found.probability[best]):
            index[one.members] = i
    ranked = [Answer(members, index[members], p) for members, p in support.items() if members in index and p > 0.0]
    ranked.sort(key=lambda one: -one.support)
    near = [one for one in ranked if one.support * WITHIN >= ranked[0].support or one.members in rivals][:MOST]
    kept = near if near and none * WITHIN < near[0].support else [*near, Answer((), 0, none)]
    return tuple(sorted(kept, key=lambda one: -one.support))


def asked(found: SearchResult, effects: Sequence[str]) -> tuple[Answer, ...]:
    """What a user asks about: no effect, each effect alone, and likely pairs of them, by the search's probabilities.

    A pair that is ten times less probable than the best of all is left out.
    """
    listed = [
        Answer(one.members, i, float(found.probability[i]))
        for i, one in enumerate(found.ground.hypotheses)
        if set(one.members) <= set(effects) and one.swap is None
    ]
    highest = max(one.support for one in listed)
    kept = [one for one in listed if len(one.members) < 2 or one.support * WITHIN >= highest]
    return tuple(sorted(kept, key=lambda one: -one.support))
