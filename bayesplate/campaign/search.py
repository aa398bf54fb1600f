"""Effects that boards have in common: each board's tables of shifts, joined over the cells of one size for all boards.

Each effect has one size per board here: an effect with a size for each setup of a board is not tried.

Each board's search holds, for every effect, cells of its sizes with the likelihood of the board's readings in each.
Given the size the boards are independent, so that one size for all has the evidence

    sum over cells of  prior(cell) * product over boards of L(cell),

beside a size of its own for each board, an effect on one board alone, and no effect at all. It costs no more than the
boards' own searches. Cells are the same for all boards in the standard coordinates of the effect's prior. All boards
may share two effects as well, as boards of one species and one sensor do: then a cell is a pair of cells, and their
shifts add. Or they share one effect, and each has another at its own size, which is summed over on each board first.
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
from bayesplate.diagnosis.search import LEAST_TRACE, SearchGround, prepare_search
from bayesplate.diagnosis.terms import log_sum, normalised_weights

SharingPattern = Literal["none", "shared", "own", "one board", "shared and own"]
CellKey = tuple[float, ...]

SHARING_PRIOR: Mapping[SharingPattern, float] = {
    "none": 0.5,
    "shared": 0.25,
    "one board": 0.15,
    "own": 0.08,
    "shared and own": 0.02,
}
"""Prior probability of each pattern, divided among its possible effects and boards.

Where the boards cannot have two effects, the prior of "shared and own" goes to "own".
"""
PRIOR_SHARE_OF_TWO = 0.2
"""Share of the prior of "shared" that pairs of effects have, where the boards can have two."""
_DIGITS = 9


@dataclass(frozen=True)
class CampaignExplanation:
    """An explanation of the boards' residuals: effects, how the boards share them, and its probability."""

    # no effect; one size for all boards; a size of its own for each; one board alone; the first effect of one size for
    # all and the second of a size of its own for each
    way: SharingPattern
    effects: tuple[str, ...]  # empty for none; two where both are shared or the second is each board's own
    board: str  # the one board; otherwise empty
    log_evidence: float
    probability: float


@dataclass(frozen=True, eq=False)
class BoardSearch:
    """A board's tables, and the evidence of effects in them."""

    name: str
    ground: SearchGround  # with the labels of each hypothesis

    def hypothesis(self, effects: tuple[str, ...]) -> Hypothesis | None:
        """The hypothesis of these effects alone; None where the board cannot have them."""
        return next(
            (
                hypothesis
                for hypothesis in self.ground.hypotheses
                if hypothesis.members == effects and hypothesis.swap is None
            ),
            None,
        )

    def log_evidence(self, effects: tuple[str, ...]) -> float:
        """ln of the evidence of effects on this board, of any size, or of no effect."""
        values = self.cells(effects)
        return float(log_sum(np.array([log_prior + log_likelihood for log_prior, log_likelihood in values.values()])))

    def cells(self, effects: tuple[str, ...]) -> dict[CellKey, tuple[float, float]]:
        """ln of the prior and ln of the likelihood of each cell of the sizes of no effect, one or two, by key."""
        hypothesis = self.hypothesis(effects)
        if hypothesis is None:
            return {}
        by_cell = hypothesis.log_by_cell(self.ground.baseline, self.ground.baseline.residual)
        by_cell = by_cell - hypothesis.baseline.half_log_det + hypothesis.log_labels
        with np.errstate(divide="ignore"):
            log_prior = np.log(hypothesis.table.weights)
        possible_cells = np.flatnonzero(np.isfinite(log_prior))
        keys = [tuple(float(coordinate) for coordinate in key) for key in _cell_keys(hypothesis)[possible_cells]]
        return {
            key: (float(log_prior[i]), float(by_cell[i] - log_prior[i]))
            for key, i in zip(keys, possible_cells, strict=True)
        }

    def cells_in_pair(self, shared: str, other: str) -> dict[CellKey, tuple[float, float]]:
        """`cells` of one effect in a pair, summed over the sizes of the other; empty where there is no such pair."""
        hypothesis = self.hypothesis((shared, other)) or self.hypothesis((other, shared))
        if hypothesis is None:
            return {}
        n_first = 1 + hypothesis.table.parts[0].z.shape[1]
        key_columns = slice(None, n_first) if hypothesis.members[0] == shared else slice(n_first, None)
        by_cell: dict[CellKey, list[tuple[float, float]]] = {}
        for key, value in self.cells(hypothesis.members).items():
            by_cell.setdefault(key[key_columns], []).append(value)
        return {key: _sum_cells(np.array(values)) for key, values in by_cell.items()}


def _cell_keys(hypothesis: Hypothesis) -> Floats:
    """Keys of the cells, the same on all boards: form and standard coordinates of each effect, (n_cells, n) array."""
    keys = np.zeros((1, 0))
    for table in hypothesis.table.parts or (hypothesis.table,):
        table_keys = np.column_stack([table.form, np.round(table.z, _DIGITS)])
        keys = np.column_stack([np.repeat(keys, len(table_keys), axis=0), np.tile(table_keys, (len(keys), 1))])
    return keys


def search_board(
    name: str, baseline: Baseline, effects: Sequence[str], tell: Callable[[float], None] | None = None
) -> BoardSearch:
    """Tabulate effects on a board, and all pairs: several boards together may show what one board does not."""
    ground = prepare_search(baseline, effects=effects, tell=tell)
    return BoardSearch(name, with_own_labels(ground.with_hypotheses(effects)))


def visible_effects(boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], ...]:
    """Single effects, and pairs of effects that are both visible at nominal size on all boards together.

    An effect that cannot be seen would cost a pair nothing, so that every effect would seem to come with it. Effects
    that leave no plate on one of the boards are not among them.
    """
    effects = [names for names in effects if all({*names} <= board.ground.candidates.keys() for board in boards)]
    traces = {
        name: np.hypot.reduce([board.ground.candidates[name].trace for board in boards])
        for combination in effects
        for name in combination
    }
    return tuple(
        combination
        for combination in effects
        if len(combination) == 1 or not min(traces[name] for name in combination) < LEAST_TRACE
    )


def rank_campaign_explanations(
    boards: Sequence[BoardSearch], effects: Sequence[tuple[str, ...]]
) -> tuple[CampaignExplanation, ...]:
    """All explanations of the boards by single effects and pairs, the most probable first."""
    log_none = np.array([board.log_evidence(()) for board in boards])
    shared = {combination: log_evidence_shared(boards, combination) for combination in effects}
    single = [combination for combination in effects if len(combination) == 1]
    pairs = [combination for combination in effects if len(combination) == 2 and np.isfinite(shared[combination])]
    ordered_pairs = [pair for first, second in pairs for pair in ((first, second), (second, first))]
    two_prior, mixed_prior = (
        (PRIOR_SHARE_OF_TWO * SHARING_PRIOR["shared"], SHARING_PRIOR["shared and own"]) if pairs else (0.0, 0.0)
    )
    rows: list[tuple[SharingPattern, tuple[str, ...], str, float, float]] = [
        ("none", (), "", float(log_none.sum()), SHARING_PRIOR["none"]),
        *(("shared", pair, "", shared[pair], two_prior / len(pairs)) for pair in pairs),
        *(
            (
                "shared and own",
                pair,
                "",
                _log_evidence_of_common_cells([board.cells_in_pair(*pair) for board in boards]),
                mixed_prior / len(ordered_pairs),
            )
            for pair in ordered_pairs
        ),
    ]
    for effect in single:
        log_alone = np.array([board.log_evidence(effect) for board in boards])
        share = 1.0 / len(single)
        rows.append(("shared", effect, "", shared[effect], share * (SHARING_PRIOR["shared"] - two_prior)))
        rows.append(
            (
                "own",
                effect,
                "",
                float(log_alone.sum()),
                share * (SHARING_PRIOR["own"] + SHARING_PRIOR["shared and own"] - mixed_prior),
            )
        )
        board_prior = share * SHARING_PRIOR["one board"] / len(boards)
        rows += [
            ("one board", effect, board.name, float(log_none.sum() - log_none[i] + log_alone[i]), board_prior)
            for i, board in enumerate(boards)
        ]
    probability = normalised_weights(np.array([log_evidence + np.log(prior) for *_, log_evidence, prior in rows]))
    order = np.argsort(-probability, kind="stable")
    return tuple(CampaignExplanation(*rows[int(i)][:4], float(probability[int(i)])) for i in order)


def log_evidence_shared(boards: Sequence[BoardSearch], effects: tuple[str, ...]) -> float:
    """ln of the evidence of effects with one size for all boards; -inf where the boards have no cell in common."""
    return _log_evidence_of_common_cells([board.cells(effects) for board in boards])


def _sum_cells(values: Floats) -> tuple[float, float]:
    """ln of the prior and ln of the likelihood of several cells together, from those of each: (n_cells, 2) array."""
    log_prior = float(log_sum(values[:, 0]))
    return log_prior, float(log_sum(values.sum(axis=1))) - log_prior


def _log_evidence_of_common_cells(by_board: Sequence[Mapping[CellKey, tuple[float, float]]]) -> float:
    """ln of the evidence of the cells that all boards have in common; -inf where there are none."""
    common = set.intersection(*(set(cells) for cells in by_board))
    if not common:
        return -np.inf
    keys = sorted(common)
    likelihood = np.sum([[cells[key][1] for key in keys] for cells in by_board], axis=0)
    prior = np.array([by_board[0][key][0] for key in keys])
    return float(log_sum(prior + likelihood) - log_sum(prior))
