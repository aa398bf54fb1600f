"""Nested leave-one-out: leave one mode out, choose an effect by the others, predict the mode left out.

A mode is one reading; with several sessions of one setup it is its readings in all of them, because each of these
predicts the others. A mode that alone carries a constant or a size cannot be predicted, and is not counted.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats, Indices
from bayesplate.board.sessions import discrepancy_columns
from bayesplate.diagnosis.hypotheses import Hypothesis, odds_against_none, probabilities
from bayesplate.diagnosis.search import SearchGround, SearchResult
from bayesplate.estimates.leave_one_out import CarryingMode, carrying_modes, leverages_of, unite_carrying_modes

NEEDED_BELOW = 0.1
"""Probability of no effect below which one is needed, whatever the null simulations say."""
NEEDED_LOG_ODDS = float(np.log((1.0 - NEEDED_BELOW) / NEEDED_BELOW))
"""The same as ln odds against no effect."""
NOT_NEEDED_ABOVE = 0.25
"""Probability of no effect above which none is needed, whatever the null simulations say: odds of three to one."""
NOT_NEEDED_LOG_ODDS = float(np.log((1.0 - NOT_NEEDED_ABOVE) / NOT_NEEDED_ABOVE))
"""The same as ln odds against no effect."""
ANY_LOG_ODDS = -np.inf
"""Least ln odds against no effect where every fold has to choose one."""
FEWEST_MODES = 5
"""Modes that a board must have for a fold to have a direction left to choose by."""


@dataclass(frozen=True, eq=False)
class NestedErrors:
    """Errors of predicting readings that were left out, for many sets of readings."""

    before: Floats  # (n_sets, n_modes) array: ln measured less predicted, without any effect
    # (n_sets, n_modes) array: with the effect that the remaining readings choose, or none; not a number where the
    # reading is no mode then
    after: Floats
    # (n_sets, n_modes) array of int: index of the hypothesis that the fold of each reading chose
    choices: Indices
    # readings that count neither before nor after, because their mode alone carries a constant or a size
    carrying_readings: tuple[int, ...] = ()

    def without(self, carrying_readings: Sequence[int]) -> NestedErrors:
        """The same errors, some readings not counted."""
        return replace(self, carrying_readings=tuple(sorted({*self.carrying_readings, *carrying_readings})))

    @property
    def is_counted(self) -> NDArray[np.bool_]:
        """Which errors count, (n_sets, n_modes): of readings that are a mode before and after and not carried."""
        is_counted = np.isfinite(self.before) & np.isfinite(self.after)
        is_counted[:, list(self.carrying_readings)] = False
        return is_counted

    @property
    def ratio(self) -> Floats:
        """Rms after over rms before, over the readings that count: (n_sets,) array, not a number where none does."""
        after, before = (np.where(self.is_counted, errors, 0.0) for errors in (self.after, self.before))
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(np.sum(after**2, axis=1) / np.sum(before**2, axis=1)))


def nested_leave_one_out(
    ground: SearchGround, residuals: Floats, needed_from: float = NEEDED_LOG_ODDS
) -> NestedErrors | None:
    """Leave each mode out in turn, search again, predict its readings under the hypothesis chosen; None where there
    are too few modes.

    Residuals are an (n_sets, n_modes) array. A fold adds the most probable effect where the ln odds against none exceed
    `needed_from`; `ANY_LOG_ODDS` makes every fold choose.
    """
    if len(ground.baseline.readings_by_mode) < FEWEST_MODES:
        return None
    evidences, errors = [], []
    for hypothesis in ground.hypotheses:
        log_evidence, left_out_errors = hypothesis.terms.left_out(
            hypothesis.residual_under_labels(ground.baseline, residuals)
        )
        evidences.append(log_evidence + hypothesis.log_labels)
        errors.append(left_out_errors)
    chosen_indices = choose_hypotheses(ground.hypotheses, np.stack(evidences), needed_from)[ground.baseline.mode_index]
    after = np.take_along_axis(np.stack(errors), chosen_indices[None], axis=0)[0]
    return NestedErrors(errors[0].T, after.T, chosen_indices.T)


def choose_hypotheses(
    hypotheses: Sequence[Hypothesis], evidences: Floats, needed_from: float = NEEDED_LOG_ODDS
) -> Indices:
    """Index of the most probable hypothesis with an effect, or 0 where the odds against no effect are too low.

    Of the shape of the (n_hypotheses, ...) evidences without their first axis.
    """
    if len(evidences) == 1:
        return np.zeros(evidences.shape[1:], dtype=np.intp)
    best = 1 + np.argmax(probabilities(hypotheses, evidences)[1:], axis=0)
    return np.where(odds_against_none(hypotheses, evidences) > needed_from, best, 0)


def log_score(ground: SearchGround, index: int, residual: Floats, carrying_readings: Collection[int] = ()) -> float:
    """Sum over the modes of the log density of the readings of each given the others, under one hypothesis.

    Each density is a ratio of two restricted densities, noise and sizes averaged. Modes of `carrying_readings` do not
    count.
    """
    return float(_log_scores(ground, index, residual)[_is_scored(ground, carrying_readings)].sum())


def log_score_gains(
    ground: SearchGround, residual: Floats, choices: Indices, carrying_readings: Collection[int] = ()
) -> Floats:
    """Gain in log density of the readings left out by the hypothesis that each fold chose: one per mode that counts."""
    scores = {int(index): _log_scores(ground, int(index), residual) for index in {0, *choices}}
    gains = [scores[int(choices[mode[0]])][i] - scores[0][i] for i, mode in enumerate(ground.baseline.readings_by_mode)]
    return np.array(gains)[_is_scored(ground, carrying_readings)]


def _is_scored(ground: SearchGround, carrying_readings: Collection[int]) -> NDArray[np.bool_]:
    """Which modes the others can predict: all but those that alone carry a constant or a size."""
    return np.array([not set(mode) & set(carrying_readings) for mode in ground.baseline.readings_by_mode])


def _log_scores(ground: SearchGround, index: int, residual: Floats) -> Floats:
    """Log density of the readings of each mode given the others, under one hypothesis: (n_same_modes,) array."""
    hypothesis = ground.hypotheses[index]
    residuals = hypothesis.residual_under_labels(ground.baseline, residual[None, :])
    log_alone = [
        sum(hypothesis.baseline.log_spurious(i) for i in mode if not hypothesis.baseline.is_mode[i])
        for mode in hypothesis.baseline.readings_by_mode
    ]
    return (
        np.array(log_alone)
        + hypothesis.terms.log_evidence(residuals)[0]
        - hypothesis.terms.left_out(residuals)[0][:, 0]
    )


def find_carrying_modes(result: SearchResult, index: int) -> tuple[CarryingMode, ...]:
    """Modes that alone carry a constant or a size without any effect or under a hypothesis; neither is judged by
    them."""
    return unite_carrying_modes(*(_carrying_modes_under(result, i) for i in dict.fromkeys((0, index))))


def _carrying_modes_under(result: SearchResult, index: int) -> tuple[CarryingMode, ...]:
    """Carrying modes under one hypothesis, at its most probable sizes: each prior counts as one more observation."""
    terms, hypothesis_table = result.ground.hypotheses[index].terms, result.ground.hypotheses[index].table
    baseline, board = terms.baseline, terms.baseline.board
    cell = int(np.argmax(result.cells(index)))
    owners, widths = [], np.zeros(hypothesis_table.slopes.shape[2])
    for which, candidate in enumerate(result.ground.members(index)):
        table, cells = hypothesis_table.member(which)
        tangents = hypothesis_table.tangents(which)
        owners += [candidate.name] * (tangents.stop - tangents.start)
        widths[tangents] = table.z_slopes[cells[cell]]  # zero of tangents that the form of the effect does not have
    cell_tangents = terms.table.slopes[cell]
    size_columns = np.divide(cell_tangents, widths, out=np.zeros_like(cell_tangents), where=widths > 0.0)
    columns = np.hstack([baseline.slopes, baseline.input_slopes, size_columns])
    scales = np.where(baseline.is_mode, baseline.scales, np.inf)
    names = (*board.symmetry.moduli, *(parameter.effect or parameter.name for parameter in board.uncertain), *owners)
    noise = [board.symmetry.n + i for i in discrepancy_columns(board)[0]]
    leverages = leverages_of(columns, scales, baseline.readings_by_mode, board.symmetry.n, noise)
    return carrying_modes(board, leverages, names)
