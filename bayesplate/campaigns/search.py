"""What boards lack in common: each board's tables of shifts, joined over the cells of one size for all.

Each effect has one size per board here: one that every setup of a board has at a size of its own is not tried.

Each board's search holds, for every effect, cells of its sizes with the likelihood of the board's readings in each.
Given the size the boards are independent, so that one size for all has the evidence

    sum over cells of  prior(cell) * product over boards of L(cell),

beside each board with a size of its own, one board alone, and no effect at all. It costs nothing more than the boards'
own searches. Cells are the same for all boards in the standard coordinates of the effect's prior. All boards may share
two effects as well, as boards of one species and one sensor do: then a cell is one of each, and their shifts add.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import Hypothesis, hypotheses
from bayesplate.diagnosis.evidence.peaks import with_own_labels
from bayesplate.diagnosis.evidence.search import LEAST_TRACE, Ground, prepare_search
from bayesplate.diagnosis.evidence.terms import log_sum
from bayesplate.diagnosis.shifts.baseline import Baseline

Floats = NDArray[np.float64]
Way = Literal["none", "shared", "own", "one board"]
Cell = tuple[float, ...]

PRIOR: Mapping[Way, float] = {"none": 0.5, "shared": 0.25, "one board": 0.15, "own": 0.1}
"""Prior probability of each way, divided among the effects, and among the boards, that it may be."""
OF_TWO = 0.2
"""Share of what is shared beforehand that is two effects, where the boards can have two."""
_DIGITS = 9


@dataclass(frozen=True)
class Explanation:
    """One thing that the boards may have.

    Attributes
    ----------
    way : "none", "shared", "own" or "one board"
        No effect; one size for all boards; a size of its own for each; one board alone.
    effects : tuple of str
        Empty for none; two only where both are shared.
    board : str
        The one board; otherwise empty.
    log_evidence : float
    probability : float
    """

    way: Way
    effects: tuple[str, ...]
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

    def hypothesis(self, effects: tuple[str, ...]) -> Hypothesis | None:
        """The one of these effects alone; None where the board cannot have them."""
        return next((one for one in self.ground.hypotheses if one.members == effects and one.swap is None), None)

    def log_evidence(self, effects: tuple[str, ...]) -> float:
        """Of an effect of whatever size on this board, or of none."""
        values = self.cells(effects)
        return float(log_sum(np.array([log_prior + log_likelihood for log_prior, log_likelihood in values.values()])))

    def cells(self, effects: tuple[str, ...]) -> dict[Cell, tuple[float, float]]:
        """ln of prior probability and of the likelihood of each cell of the sizes of one effect, of two, or of none."""
        one = self.hypothesis(effects)
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
        keys = self._keys(one)
        return {
            tuple(float(part) for part in key): (float(prior), float(joint - prior))
            for key, prior, joint in zip(keys, log_prior, by_cell, strict=True)
            if np.isfinite(prior)
        }

    def _keys(self, one: Hypothesis) -> Floats:
        """What a cell is on any board: form and standard coordinates of each of its effects, (n_cells, n) array."""
        tables = [self.ground.candidates[name].coarse for name in one.members] if len(one.members) > 1 else [one.table]
        keys = np.zeros((1, 0))
        for table in tables:
            own = np.column_stack([table.form, np.round(table.z, _DIGITS)])
            keys = np.column_stack([np.repeat(keys, len(own), axis=0), np.tile(own, (len(keys), 1))])
        return keys


def search_board(
    name: str, baseline: Baseline, effects: Sequence[str], tell: Callable[[float], None] | None = None
) -> BoardSearch:
    """Tabulate effects on a board, and every pair of them: what one board would not show several may.

    Parameters
    ----------
    name : str
    baseline : Baseline
    effects : sequence of str
    tell : callable, optional
        Told which share of the effects is done.
    """
    ground = prepare_search(baseline, tried=effects, tell=tell)
    fine = {effect: one.fine for effect, one in ground.candidates.items()}
    coarse = {effect: one.coarse for effect, one in ground.candidates.items()}
    every = hypotheses(baseline, fine, coarse, paired=effects)
    return BoardSearch(name, with_own_labels(replace(ground, hypotheses=every)))


def shown(boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Single effects, and those pairs both of which would show at nominal size on all boards together.

    A pair costs nothing for one that cannot be seen, so that every effect would seem to come with it.
    """
    traces = {name: np.hypot.reduce([one.ground.trace(name) for one in boards]) for each in effects for name in each}
    return tuple(each for each in effects if len(each) == 1 or not min(traces[name] for name in each) < LEAST_TRACE)


def explanations(boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]) -> tuple[Explanation, ...]:
    """Everything that the boards may have, the most probable first.

    Parameters
    ----------
    boards : sequence of BoardSearch
    effects : sequence of tuple of str
        Those of `shareable`: single ones, and pairs.
    """
    none = np.array([one.log_evidence(()) for one in boards])
    shared = {each: log_evidence_shared(boards, each) for each in effects}
    single = [each for each in effects if len(each) == 1]
    pairs = [each for each in effects if len(each) == 2 and np.isfinite(shared[each])]
    of_two = OF_TWO * PRIOR["shared"] if pairs else 0.0
    found: list[tuple[Way, tuple[str, ...], str, float, float]] = [
        ("none", (), "", float(none.sum()), PRIOR["none"]),
        *(("shared", pair, "", shared[pair], of_two / len(pairs)) for pair in pairs),
    ]
    for effect in single:
        alone = np.array([one.log_evidence(effect) for one in boards])
        share = 1.0 / len(single)
        found.append(("shared", effect, "", shared[effect], share * (PRIOR["shared"] - of_two)))
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


def log_evidence_shared(boards: Sequence[BoardSearch], effects: tuple[str, ...]) -> float:
    """ln of the evidence of one size for all boards, of each effect; -inf where they have no cell in common."""
    by_board = [one.cells(effects) for one in boards]
    common = set.intersection(*(set(cells) for cells in by_board))
    if not common:
        return -np.inf
    keys = sorted(common)
    likelihood = np.sum([[cells[key][1] for key in keys] for cells in by_board], axis=0)
    prior = np.array([by_board[0][key][0] for key in keys])
    return float(log_sum(prior + likelihood) - log_sum(prior))
