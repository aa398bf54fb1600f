"""What boards lack in common: each board's tables of shifts, joined over the cells of one size for all.

Each effect has one size per board here: one that every setup of a board has at a size of its own is not tried.

Each board's search holds, for every effect, cells of its sizes with the likelihood of the board's readings in each.
Given the size the boards are independent, so that one size for all has the evidence

    sum over cells of  prior(cell) * product over boards of L(cell),

beside each board with a size of its own, one board alone, and no effect at all. It costs nothing more than the boards'
own searches. Cells are the same for all boards in the standard coordinates of the effect's prior.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis
from bayesplate.diagnosis.evidence.search import Ground
from bayesplate.diagnosis.evidence.terms import log_sum

Floats = NDArray[np.float64]
Way = Literal["none", "shared", "own", "one board"]
Cell = tuple[float, ...]

PRIOR: Mapping[Way, float] = {"none": 0.5, "shared": 0.25, "one board": 0.15, "own": 0.1}
"""Prior probability of each way, divided among the effects, and among the boards, that it may be."""
_DIGITS = 9


@dataclass(frozen=True)
class Explanation:
    """One thing that the boards may have.

    Attributes
    ----------
    way : "none", "shared", "own" or "one board"
        No effect; one size for all boards; a size of its own for each; one board alone.
    effect : str
        Empty for none.
    board : str
        The one board; otherwise empty.
    log_evidence : float
    probability : float
    """

    way: Way
    effect: str
    board: str
    log_evidence: float
    probability: float


@dataclass(frozen=True, eq=False)
class BoardSearch:
    """A board's tables, asked for what the boards may have in common.

    Attributes
    ----------
    name : str
    ground : Ground
        With the labels of each hypothesis.
    """

    name: str
    ground: Ground

    def hypothesis(self, effect: str) -> Hypothesis | None:
        """The one of an effect alone, or of none; None where the board cannot have it."""
        members = (effect,) if effect else ()
        return next((one for one in self.ground.hypotheses if one.members == members and one.swap is None), None)

    def log_evidence(self, effect: str) -> float:
        """Of an effect of whatever size on this board; of no effect where the name is empty."""
        values = self.cells(effect)
        return float(log_sum(np.array([log_prior + log_likelihood for log_prior, log_likelihood in values.values()])))

    def cells(self, effect: str) -> dict[Cell, tuple[float, float]]:
        """ln of prior probability and of the likelihood of each cell of an effect's sizes."""
        one = self.hypothesis(effect)
        if one is None:
            return {}
        terms = one.terms(self.ground.whole)
        seen = one.seen(self.ground.baseline, self.ground.baseline.residual[None, :])
        n_cells = one.table.n_cells
        by_cell = (
            log_sum(terms.log_densities(seen)[:, 0].reshape(-1, n_cells)) - terms.fold.half_log_det + one.log_labels
        )
        with np.errstate(divide="ignore"):
            log_prior = np.log(one.table.weights)
        keys = np.column_stack([one.table.form, np.round(one.table.z, _DIGITS)])
        return {
            tuple(float(part) for part in key): (float(prior), float(joint - prior))
            for key, prior, joint in zip(keys, log_prior, by_cell, strict=True)
            if np.isfinite(prior)
        }


def explanations(boards: Sequence[BoardSearch], effects: Sequence[str]) -> tuple[Explanation, ...]:
    """Everything that the boards may have, the most probable first.

    Parameters
    ----------
    boards : sequence of BoardSearch
    effects : sequence of str
        Those of `shareable`.
    """
    none = np.array([one.log_evidence("") for one in boards])
    found: list[tuple[Way, str, str, float, float]] = [("none", "", "", float(none.sum()), PRIOR["none"])]
    for effect in effects:
        alone = np.array([one.log_evidence(effect) for one in boards])
        share = 1.0 / len(effects)
        found.append(("shared", effect, "", log_evidence_shared(boards, effect), share * PRIOR["shared"]))
        found.append(("own", effect, "", float(alone.sum()), share * PRIOR["own"]))
        each = share * PRIOR["one board"] / len(boards)
        found += [
            ("one board", effect, one.name, float(none.sum() - none[i] + alone[i]), each)
            for i, one in enumerate(boards)
        ]
    joint = np.array([log_evidence + np.log(prior) for *_, log_evidence, prior in found])
    probability = np.exp(joint - joint.max())
    probability /= probability.sum()
    order = np.argsort(-probability, kind="stable")
    return tuple(Explanation(*found[int(i)][:4], float(probability[int(i)])) for i in order)


def log_evidence_shared(boards: Sequence[BoardSearch], effect: str) -> float:
    """ln of the evidence of one size for all boards; -inf where they have no cell in common."""
    by_board = [one.cells(effect) for one in boards]
    common = set.intersection(*(set(cells) for cells in by_board))
    if not common:
        return -np.inf
    keys = sorted(common)
    likelihood = np.sum([[cells[key][1] for key in keys] for cells in by_board], axis=0)
    prior = np.array([by_board[0][key][0] for key in keys])
    return float(log_sum(prior + likelihood) - log_sum(prior))
