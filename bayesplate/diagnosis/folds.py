"""Leave one mode out, choose again, predict it: what a chosen effect is worth where it has not been fitted.

A mode is one reading; of several sessions of one setup it is its readings in all of them, for each tells of the others.
A mode that alone carries a constant or a size says nothing when it is left out, and is not counted.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.diagnosis.baseline import Rows
from bayesplate.diagnosis.hypotheses import Hypothesis, odds_against_none, probabilities
from bayesplate.diagnosis.search import Ground, SearchResult
from bayesplate.estimates.leave_one_out import CarryingMode, carrying_modes, leverages_of, united

NEEDED = 0.1
"""Probability of no effect below which one is needed, whatever the null simulations say."""
CERTAINLY_NEEDED = float(np.log((1.0 - NEEDED) / NEEDED))
"""The same as ln odds against no effect."""
ALWAYS = -np.inf
"""Odds from which on an effect is chosen by whoever is made to choose one."""
FEWEST = 5
"""Modes without which a fold has no direction left to choose by."""


@dataclass(frozen=True, eq=False)
class Nested:
    """Errors of predicting readings that were left out, for many data sets."""

    before: Floats  # (n_sets, n_modes) array: ln measured less predicted, without any effect
    # (n_sets, n_modes) array: with the effect that the remaining readings choose, or none; not a number where the
    # reading is no mode then
    after: Floats
    # (n_sets, n_modes) array of int: index of the hypothesis that the fold of each reading chose
    chosen: Rows
    # readings that count neither before nor after, for their mode alone carries a constant or a size
    carried: tuple[int, ...] = ()

    def without(self, carried: Sequence[int]) -> Nested:
        """The same errors, some readings not counted."""
        return replace(self, carried=tuple(sorted({*self.carried, *carried})))

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Which errors count, (n_sets, n_modes): of readings that are a mode before and after and not carried."""
        counted = np.isfinite(self.before) & np.isfinite(self.after)
        counted[:, list(self.carried)] = False
        return counted

    @property
    def ratio(self) -> Floats:
        """Rms after over rms before, over the readings that count: (n_sets,) array, not a number where none does."""
        after, before = (np.where(self.counted, part, 0.0) for part in (self.after, self.before))
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(np.sum(after**2, axis=1) / np.sum(before**2, axis=1)))


def nested(ground: Ground, residuals: Floats, needed_from: float = CERTAINLY_NEEDED) -> Nested | None:
    """Leave each mode out in turn, search again, predict its readings by what was chosen; None where readings are too
    few.

    Residuals are an (n_sets, n_modes) array. A fold adds the most probable effect where the ln odds against none exceed
    `needed_from`; `ALWAYS` makes every fold choose.
    """
    if len(ground.baseline.same_modes) < FEWEST:
        return None
    evidences, errors = [], []
    for one in ground.hypotheses:
        log_evidence, missed = one.terms.left_out(one.seen(ground.baseline, residuals))
        evidences.append(log_evidence + one.log_labels)
        errors.append(missed)
    chosen = choices(ground.hypotheses, np.stack(evidences), needed_from)[ground.baseline.mode_index]
    after = np.take_along_axis(np.stack(errors), chosen[None], axis=0)[0]
    return Nested(errors[0].T, after.T, chosen.T)


def choices(found: Sequence[Hypothesis], evidences: Floats, needed_from: float = CERTAINLY_NEEDED) -> Rows:
    """The most probable effect by each evidence, or none where the odds against none are too low.

    From an (n_hypotheses, ...) array one of the same shape but for its first axis.
    """
    if len(evidences) == 1:
        return np.zeros(evidences.shape[1:], dtype=np.intp)
    best = 1 + np.argmax(probabilities(found, evidences)[1:], axis=0)
    return np.where(odds_against_none(found, evidences) > needed_from, best, 0)


def log_score(ground: Ground, index: int, residual: Floats, carried: Collection[int] = ()) -> float:
    """Sum over the modes of the log density of the readings of each given the others, under one hypothesis.

    A ratio of two restricted densities each, noise and sizes averaged; without the modes of readings that are carried.
    """
    return float(_log_scores(ground, index, residual)[_foretold(ground, carried)].sum())


def log_score_gains(ground: Ground, residual: Floats, chosen: Rows, carried: Collection[int] = ()) -> Floats:
    """What each fold's choice adds to the log density of the readings left out: one per mode that counts."""
    scores = {int(index): _log_scores(ground, int(index), residual) for index in {0, *chosen}}
    gains = [scores[int(chosen[mode[0]])][i] - scores[0][i] for i, mode in enumerate(ground.baseline.same_modes)]
    return np.array(gains)[_foretold(ground, carried)]


def _foretold(ground: Ground, carried: Collection[int]) -> NDArray[np.bool_]:
    """Which modes others foretell: all but those that alone carry a constant or a size."""
    return np.array([not set(mode) & set(carried) for mode in ground.baseline.same_modes])


def _log_scores(ground: Ground, index: int, residual: Floats) -> Floats:
    """Log density of the readings of each mode given the others, under one hypothesis: (n_same_modes,) array."""
    one = ground.hypotheses[index]
    seen = one.seen(ground.baseline, residual[None, :])
    alone = [sum(one.own.log_alone(i) for i in mode if not one.own.is_mode[i]) for mode in one.own.same_modes]
    return np.array(alone) + one.terms.log_evidence(seen)[0] - one.terms.left_out(seen)[0][:, 0]


def carrying(found: SearchResult, index: int) -> tuple[CarryingMode, ...]:
    """Modes that alone carry something without any effect or under a hypothesis: both are judged without them."""
    return united(*(_under(found, one) for one in dict.fromkeys((0, index))))


def _under(found: SearchResult, index: int) -> tuple[CarryingMode, ...]:
    """Carrying modes under one hypothesis, at its most probable sizes: each prior counts as one more observation."""
    terms, whole = found.ground.hypotheses[index].terms, found.ground.hypotheses[index].table
    baseline, board = terms.baseline, terms.baseline.board
    cell = int(np.argmax(found.cells(index)))
    owners, widths = [], np.zeros(whole.slopes.shape[2])
    for which, one in enumerate(found.ground.members(index)):
        table, cells = whole.member(which)
        tangents = whole.tangents(which)
        owners += [one.name] * (tangents.stop - tangents.start)
        widths[tangents] = table.z_slopes[cells[cell]]  # zero of tangents that the form of the effect does not have
    tangents_there = terms.table.slopes[cell]
    sizes = np.divide(tangents_there, widths, out=np.zeros_like(tangents_there), where=widths > 0.0)
    columns = np.hstack([baseline.slopes, baseline.input_slopes, sizes])
    scales = np.where(baseline.is_mode, baseline.scales, np.inf)
    names = (*board.symmetry.moduli, *(one.effect or one.name for one in board.uncertain), *owners)
    leverages = leverages_of(columns, scales, baseline.same_modes, board.symmetry.n)
    return carrying_modes(board, leverages, names)
