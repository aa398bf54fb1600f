"""What boards lack in common: each board's tables of shifts, joined over the cells of one size for all.

Each effect has one size per board here: one that every setup of a board has at a size of its own is not tried.

Each board's search holds, for every effect, cells of its sizes with the likelihood of the board's readings in each.
Given the size the boards are independent, so that one size for all has the evidence

    sum over cells of  prior(cell) * product over boards of L(cell),

beside each board with a size of its own, one board alone, and no effect at all. It costs nothing more than the boards'
own searches. Cells are the same for all boards in the standard coordinates of the effect's prior. All boards may share
two effects as well, as boards of one species and one sensor do: then a cell is one of each, and their shifts add. Or
they share one, and have another at a size of its own each: that one is summed over on every board first.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.peaks import with_own_labels
from bayesplate.diagnosis.search import LEAST_TRACE, Ground, prepare_search
from bayesplate.diagnosis.terms import log_sum, normalised

Way = Literal["none", "shared", "own", "one board", "shared and own"]
Cell = tuple[float, ...]

PRIOR: Mapping[Way, float] = {"none": 0.5, "shared": 0.25, "one board": 0.15, "own": 0.08, "shared and own": 0.02}
"""Prior probability of each way, divided among the effects, and among the boards, that it may be.

That of two where the boards cannot have two goes to the one effect of a size of its own.
"""
OF_TWO = 0.2
"""Share of what is shared beforehand that is two effects, where the boards can have two."""
_DIGITS = 9


@dataclass(frozen=True)
class Explanation:
    """One thing that the boards may have."""

    # no effect; one size for all boards; a size of its own for each; one board alone; the first effect of one size for
    # all and the second of a size of its own for each
    way: Way
    effects: tuple[str, ...]  # empty for none; two where both are shared or the second is each board's own
    board: str  # the one board; otherwise empty
    log_evidence: float
    probability: float


@dataclass(frozen=True, eq=False)
class BoardSearch:
    """A board's tables, asked for what the boards may have in common."""

    name: str
    ground: Ground  # with the labels of each hypothesis

    def hypothesis(self, effects: tuple[str, ...]) -> Hypothesis | None:
        """The hypothesis of these effects alone; None where the board cannot have them."""
        return next((one for one in self.ground.hypotheses if one.members == effects and one.swap is None), None)

    def log_evidence(self, effects: tuple[str, ...]) -> float:
        """ln of the evidence of an effect of whatever size on this board, or of none."""
        values = self.cells(effects)
        return float(log_sum(np.array([log_prior + log_likelihood for log_prior, log_likelihood in values.values()])))

    def cells(self, effects: tuple[str, ...]) -> dict[Cell, tuple[float, float]]:
        """ln of prior probability and of the likelihood of each cell of the sizes of one effect, of two, or of none."""
        one = self.hypothesis(effects)
        if one is None:
            return {}
        by_cell = one.log_by_cell(self.ground.baseline, self.ground.baseline.residual)
        by_cell = by_cell - one.own.half_log_det + one.log_labels
        with np.errstate(divide="ignore"):
            log_prior = np.log(one.table.weights)
        possible = np.flatnonzero(np.isfinite(log_prior))
        keys = [tuple(float(part) for part in key) for key in _keys(one)[possible]]
        return {
            key: (float(log_prior[i]), float(by_cell[i] - log_prior[i])) for key, i in zip(keys, possible, strict=True)
        }

    def cells_beside(self, shared: str, own: str) -> dict[Cell, tuple[float, float]]:
        """The same of each cell of one effect, another of whatever size being there as well; empty without pairs."""
        one = self.hypothesis((shared, own)) or self.hypothesis((own, shared))
        if one is None:
            return {}
        first = 1 + one.table.parts[0].z.shape[1]
        kept = slice(None, first) if one.members[0] == shared else slice(first, None)
        by_cell: dict[Cell, list[tuple[float, float]]] = {}
        for key, value in self.cells(one.members).items():
            by_cell.setdefault(key[kept], []).append(value)
        return {key: _summed(np.array(values)) for key, values in by_cell.items()}


def _keys(one: Hypothesis) -> Floats:
    """What a cell is on any board: form and standard coordinates of each of its effects, (n_cells, n) array."""
    keys = np.zeros((1, 0))
    for table in one.table.parts or (one.table,):
        own = np.column_stack([table.form, np.round(table.z, _DIGITS)])
        keys = np.column_stack([np.repeat(keys, len(own), axis=0), np.tile(own, (len(keys), 1))])
    return keys


def search_board(
    name: str, baseline: Baseline, effects: Sequence[str], tell: Callable[[float], None] | None = None
) -> BoardSearch:
    """Tabulate effects on a board, and every pair of them: what one board would not show several may."""
    ground = prepare_search(baseline, tried=effects, tell=tell)
    return BoardSearch(name, with_own_labels(ground.with_hypotheses(effects)))


def shown(boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Single effects, and those pairs both of which would show at nominal size on all boards together.

    A pair costs nothing for one that cannot be seen, so that every effect would seem to come with it.
    """
    traces = {
        name: np.hypot.reduce([one.ground.candidates[name].trace for one in boards])
        for each in effects
        for name in each
    }
    return tuple(each for each in effects if len(each) == 1 or not min(traces[name] for name in each) < LEAST_TRACE)


def explanations(boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]) -> tuple[Explanation, ...]:
    """Everything that the boards may have of single effects and pairs, the most probable first."""
    none = np.array([one.log_evidence(()) for one in boards])
    shared = {each: log_evidence_shared(boards, each) for each in effects}
    single = [each for each in effects if len(each) == 1]
    pairs = [each for each in effects if len(each) == 2 and np.isfinite(shared[each])]
    beside = [each for one, other in pairs for each in ((one, other), (other, one))]
    of_two, mixed = (OF_TWO * PRIOR["shared"], PRIOR["shared and own"]) if pairs else (0.0, 0.0)
    found: list[tuple[Way, tuple[str, ...], str, float, float]] = [
        ("none", (), "", float(none.sum()), PRIOR["none"]),
        *(("shared", pair, "", shared[pair], of_two / len(pairs)) for pair in pairs),
        *(
            ("shared and own", each, "", _over_common([one.cells_beside(*each) for one in boards]), mixed / len(beside))
            for each in beside
        ),
    ]
    for effect in single:
        alone = np.array([one.log_evidence(effect) for one in boards])
        share = 1.0 / len(single)
        found.append(("shared", effect, "", shared[effect], share * (PRIOR["shared"] - of_two)))
        found.append(("own", effect, "", float(alone.sum()), share * (PRIOR["own"] + PRIOR["shared and own"] - mixed)))
        each = share * PRIOR["one board"] / len(boards)
        found += [
            ("one board", effect, one.name, float(none.sum() - none[i] + alone[i]), each)
            for i, one in enumerate(boards)
        ]
    probability = normalised(np.array([log_evidence + np.log(prior) for *_, log_evidence, prior in found]))
    order = np.argsort(-probability, kind="stable")
    return tuple(Explanation(*found[int(i)][:4], float(probability[int(i)])) for i in order)


def log_evidence_shared(boards: Sequence[BoardSearch], effects: tuple[str, ...]) -> float:
    """ln of the evidence of one size for all boards, of each effect; -inf where they have no cell in common."""
    return _over_common([one.cells(effects) for one in boards])


def _summed(values: Floats) -> tuple[float, float]:
    """ln of prior probability and likelihood of several cells together, from those of each: (n_cells, 2) array."""
    log_prior = float(log_sum(values[:, 0]))
    return log_prior, float(log_sum(values.sum(axis=1))) - log_prior


def _over_common(by_board: Sequence[Mapping[Cell, tuple[float, float]]]) -> float:
    """ln of the evidence of cells that all boards have alike; -inf where there is none."""
    common = set.intersection(*(set(cells) for cells in by_board))
    if not common:
        return -np.inf
    keys = sorted(common)
    likelihood = np.sum([[cells[key][1] for key in keys] for cells in by_board], axis=0)
    prior = np.array([by_board[0][key][0] for key in keys])
    return float(log_sum(prior + likelihood) - log_sum(prior))
