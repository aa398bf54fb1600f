"""The board that a verdict asks to be fitted again."""

from __future__ import annotations

import numpy as np

from bayesplate.board.board import Board
from bayesplate.diagnosis.decision.verdict import size_posterior
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.diagnosis.shifts.forms import Form, with_forms, with_labels_exchanged


def likely_forms(found: Found, index: int) -> tuple[Form, ...]:
    """For each effect of a hypothesis the form that is most probable."""
    hypothesis = found.ground.hypotheses[index]
    candidates = found.ground.candidates
    return tuple(
        candidates[name].laws[likely_form(found, index, member)].form
        for member, name in enumerate(hypothesis.members)
        if name in candidates
    )


def likely_form(found: Found, index: int, member: int) -> int:
    """Which form of one effect of a hypothesis is most probable."""
    laws = found.ground.candidates[found.ground.hypotheses[index].members[member]].laws
    return int(np.argmax([_form_share(found, index, member, form) for form in range(len(laws))]))


def refit_board(found: Found, index: int) -> Board:
    """The board under a hypothesis: with its effects declared, or with two labels exchanged."""
    hypothesis = found.ground.hypotheses[index]
    board = found.ground.baseline.board
    if hypothesis.swap is not None:
        return with_labels_exchanged(board, hypothesis.swap.first, hypothesis.swap.second)
    return with_forms(board, likely_forms(found, index))


def _form_share(found: Found, index: int, member: int, form: int) -> float:
    hypothesis = found.ground.hypotheses[index]
    if not found.ground.candidates[hypothesis.members[member]].laws[form].form.free:
        return 1.0
    return float(size_posterior(found, index, member, form, 0)[0].sum())
