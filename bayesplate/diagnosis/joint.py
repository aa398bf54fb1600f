"""Plausible pairs of effects are solved together after a first search: their shifts need not add.

Each effect of a pair may fail alone: air that lowers all frequencies and a tension that raises them each raise the
error, and both together explain it. The sum of two large shifts of opposite signs is also a poor approximation, wrong
by a fifth of the remaining shift, so that the right pair may seem improbable. Where nothing explains the readings the
most probable pairs are therefore solved together however improbable they are.

A pair of known effects of which the card states one is always solved together.

Pairs with transverse shear are left to the sampler, which fits every named effect again: solving them takes minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.hypotheses import are_stated
from bayesplate.diagnosis.laws import FormLaw
from bayesplate.diagnosis.peaks import with_own_labels
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchGround, SearchResult, prepare_search, run_search
from bayesplate.diagnosis.shifts import JointLaws, joint_law, joint_table

PLAUSIBLE_FROM = 0.05
"""Probability from which a pair is solved together where some hypothesis explains the readings: each costs as much as
a candidate."""
_MOST_PAIRS = 3
_LEAST_SHARE = 0.05
"""Share of a pair's probability below which two of its forms keep the sum of their shifts."""


def full_search(
    baseline: Baseline, effects: Sequence[str] | None = None, tell: Callable[[float], None] | None = None
) -> tuple[SearchGround, SearchResult]:
    """The ground of a diagnosis, with the labels of the board, and its search: all candidates, each hypothesis with
    labels of its own, plausible pairs solved together."""
    ground = prepare_search(baseline, effects=effects, tell=tell)
    result = run_search(with_own_labels(ground))
    joint_ground = with_joint_pairs(result, ground)
    return (ground, result) if joint_ground is ground else (joint_ground, run_search(with_own_labels(joint_ground)))


def with_joint_pairs(result: SearchResult, ground: SearchGround) -> SearchGround:
    """The ground with the plausible pairs of its search solved together; the same ground if there is none."""
    pairs = [i for i in _plausible_pairs(result) if not ground.hypotheses[i].joint]
    if not pairs:
        return ground
    hypotheses = list(ground.hypotheses)
    for index in pairs:
        first, second = ground.members(index)
        laws: JointLaws = {
            (i, j): joint_law(ground.baseline, first.laws[i].form, second.laws[j].form)
            for i, j in _probable_forms(result, index)
        }
        table = joint_table(ground.baseline, hypotheses[index].table, laws)
        hypotheses[index] = replace(hypotheses[index], table=table, joint=laws)
    return replace(ground, hypotheses=tuple(hypotheses))


def _plausible_pairs(result: SearchResult) -> list[int]:
    """Indices of the most probable pairs of candidates whose plate is thin; pairs of stated effects first."""
    log_probability = result.log_evidence + np.log([hypothesis.prior for hypothesis in result.ground.hypotheses])
    is_explained = result.p_value(int(np.argmax(result.probability))) >= LEAST_P_VALUE
    board = result.ground.baseline.board
    thin_pairs = [
        int(i)
        for i in np.lexsort((-log_probability, -result.probability))  # by logarithms where they are too small to tell
        if len(members := result.ground.members(int(i))) == 2
        and all(_is_thin(law) for candidate in members for law in candidate.laws)
    ]
    stated_pairs = [i for i in thin_pairs if are_stated(board, result.ground.hypotheses[i].members)]
    probable_pairs = [
        i for i in thin_pairs if i not in stated_pairs and (result.probability[i] >= PLAUSIBLE_FROM or not is_explained)
    ]
    return [*stated_pairs, *probable_pairs[:_MOST_PAIRS]]


def _is_thin(law: FormLaw) -> bool:
    """Whether the plate with an effect is thin: a shear-flexible one with a further effect takes minutes to solve."""
    return all(model.system.theory == "thin" for model in law.models)


def _probable_forms(result: SearchResult, index: int) -> list[tuple[int, int]]:
    """Indices of the pairs of forms that have a large enough share of the probability of a pair of effects."""
    table = result.ground.hypotheses[index].table
    forms = np.stack([member_table.form[cells] for member_table, cells in (table.member(0), table.member(1))])
    by_forms = np.zeros(forms.max(axis=1) + 1)
    np.add.at(by_forms, tuple(forms), result.cells(index))
    return [(int(i), int(j)) for i, j in np.argwhere(by_forms > _LEAST_SHARE)]
