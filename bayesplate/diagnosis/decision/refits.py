"""The board that a verdict asks to be fitted again, and what the refit says of the size of the effect."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.decision.verdict import size_posterior
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.forms import Form, with_forms, with_labels_exchanged
from bayesplate.plate.board import Board
from bayesplate.posterior.draws import Draws

Floats = NDArray[np.float64]

_NEARLY_ZERO = 0.05


def likely_forms(found: Found, index: int) -> tuple[Form, ...]:
    """For each effect of a hypothesis the form that is most probable."""
    hypothesis = found.ground.hypotheses[index]
    chosen = []
    for member, name in enumerate(hypothesis.members):
        if name not in found.ground.candidates:
            continue
        laws = found.ground.candidates[name].laws
        shares = [_form_share(found, index, member, form) for form in range(len(laws))]
        chosen.append(laws[int(np.argmax(shares))].form)
    return tuple(chosen)


def refit_board(found: Found, index: int) -> Board:
    """The board under a hypothesis: with its effects declared, or with two labels exchanged."""
    hypothesis = found.ground.hypotheses[index]
    board = found.ground.baseline.board
    if hypothesis.swap is not None:
        return with_labels_exchanged(board, hypothesis.swap.first, hypothesis.swap.second)
    return with_forms(board, likely_forms(found, index))


def excludes_zero(board: Board, forms: tuple[Form, ...], draws: Draws) -> bool:
    """Whether the shortest 95 % interval of each effect's first parameter stays clear of zero.

    An interval that starts within a twentieth of its width above a zero that is the prior's bound counts as one that
    reaches it. An effect whose size the card fixes cannot be zero.
    """
    for form in forms:
        if not form.free:
            continue
        first = [one.name for one in form.free if one.key == form.free[0].key]
        values = [draws.inputs[name] for name in first if name in draws.inputs]
        if not any(_is_clear_of_zero(np.ravel(value)) for value in values):
            return False
    return True


def _is_clear_of_zero(values: Floats) -> bool:
    ordered = np.sort(values)
    n = int(np.ceil(0.95 * ordered.size))
    starts = ordered[: ordered.size - n + 1]
    ends = ordered[n - 1 :]
    i = int(np.argmin(ends - starts))
    margin = _NEARLY_ZERO * float(ends[i] - starts[i])
    return bool(starts[i] > margin or ends[i] < -margin)


def _form_share(found: Found, index: int, member: int, form: int) -> float:
    hypothesis = found.ground.hypotheses[index]
    if not found.ground.candidates[hypothesis.members[member]].laws[form].form.free:
        return 1.0
    return float(size_posterior(found, index, member, form, 0)[0].sum())
