"""Pairs of effects that are plausible after a first search, solved together: their shifts need not add.

No member of a pair has to do well alone: air that slows all modes and a tension that speeds them up each raise the
error, and both together explain it. Two large shifts of opposite signs are also those whose sum is the worst
approximation, by a fifth of what is left of them, so that the right pair may seem improbable. Where nothing explains
the readings the most probable pairs are therefore solved together however improbable they are.

A pair of known effects of which the card states one is solved together in any case.

Pairs with transverse shear are left to the sampler, which fits whatever is named again: solving them takes minutes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.hypotheses import are_stated
from bayesplate.diagnosis.laws import FormLaw
from bayesplate.diagnosis.peaks import with_own_labels
from bayesplate.diagnosis.search import PASSES, Ground, SearchResult, prepare_search, search
from bayesplate.diagnosis.shifts import JointLaws, joint_law, joint_table

PLAUSIBLE = 0.05
"""Probability from which a pair is solved together where something explains the readings: each costs as much as a
candidate of its own."""
_MOST_PAIRS = 3
_WORTH = 0.05
"""Share of a pair's probability below which two of its forms keep the sum of their shifts."""


def full_search(
    baseline: Baseline, tried: Sequence[str] | None = None, tell: Callable[[float], None] | None = None
) -> tuple[Ground, SearchResult]:
    """The search of a diagnosis, and its ground with the labels of the board: every candidate, each hypothesis with its
    own labels, plausible pairs solved together."""
    ground = prepare_search(baseline, tried=tried, tell=tell)
    found = search(with_own_labels(ground))
    together = with_joint_pairs(found, ground)
    return (ground, found) if together is ground else (together, search(with_own_labels(together)))


def with_joint_pairs(found: SearchResult, ground: Ground) -> Ground:
    """A ground on which the pairs that a search on it finds plausible are solved together; the same where none is."""
    pairs = [i for i in _plausible(found) if not ground.hypotheses[i].joint]
    if not pairs:
        return ground
    every = list(ground.hypotheses)
    for index in pairs:
        one, other = ground.members(index)
        laws: JointLaws = {
            (i, j): joint_law(ground.baseline, one.laws[i].form, other.laws[j].form)
            for i, j in _forms_worth(found, index)
        }
        table = joint_table(ground.baseline, every[index].table, laws)
        every[index] = replace(every[index], table=table, joint=laws)
    return replace(ground, hypotheses=tuple(every))


def _plausible(found: SearchResult) -> list[int]:
    """Indices of the most probable pairs whose effects have laws and leave the plate thin."""
    log_probability = found.log_evidence + np.log([one.prior for one in found.ground.hypotheses])
    is_explained = found.p_value(int(np.argmax(found.probability))) >= PASSES
    board = found.ground.baseline.board
    cheap = [
        int(i)
        for i in np.lexsort((-log_probability, -found.probability))  # by logarithms where they are too small to tell
        if len(members := found.ground.members(int(i))) == 2
        and all(_is_cheap(law) for one in members for law in one.laws)
    ]
    stated = [i for i in cheap if are_stated(board, found.ground.hypotheses[i].members)]
    pairs = [i for i in cheap if i not in stated and (found.probability[i] >= PLAUSIBLE or not is_explained)]
    return [*stated, *pairs[:_MOST_PAIRS]]


def _is_cheap(law: FormLaw) -> bool:
    """Whether an effect leaves the plate thin: a shear-flexible one with a further effect takes minutes to solve."""
    return all(model.system.theory == "thin" for model in law.models)


def _forms_worth(found: SearchResult, index: int) -> list[tuple[int, int]]:
    """Pairs of forms that have a share in the probability of a pair of effects."""
    table = found.ground.hypotheses[index].table
    forms = np.stack([one.form[cells] for one, cells in (table.member(0), table.member(1))])
    by_forms = np.zeros(forms.max(axis=1) + 1)
    np.add.at(by_forms, tuple(forms), found.cells(index))
    return [(int(i), int(j)) for i, j in np.argwhere(by_forms > _WORTH)]
