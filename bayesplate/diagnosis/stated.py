"""The claim of stated effects: the readings do not choose them, so that two conditions are enough.

Known effects that the card states or declares are computed at their stated sizes, without a search: neither chance
selection nor priors of sizes can make an error fall. The same holds of a second setup that is predicted by the
constants of the first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.sessions import readings_by_mode
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.claim import STANDARD_ERRORS, score_gain
from bayesplate.diagnosis.known import KnownFit, effects_at_known_size, fit_with_effects, stated_effects
from bayesplate.diagnosis.shifts import no_effect_cells
from bayesplate.diagnosis.terms import NormalTerms, noise_grid, noise_reach
from bayesplate.errors import NotIdentifiableError
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import rms

LEAST_ERROR_FALL = 0.2
"""Share of the error by which it has to fall."""
_FEWEST_MODES = 3
"""Modes that must be compared for their differences to have a meaningful scatter."""


@dataclass(frozen=True, kw_only=True)
class StatedClaim:
    """Whether it may be said that effects which the card states reduce the error."""

    # at their stated sizes, or the medians of their priors; nothing but the constants is fitted
    effects: tuple[str, ...]
    # the setup that is predicted by constants of the first setup alone; empty where each mode is predicted by the
    # others
    predicts: str
    before_rms_cents: float  # error of the predicted readings without these effects
    after_rms_cents: float  # the same with them
    log_score_gain: float  # sum over the modes of what the effects add to the log density of each prediction
    standard_error: float  # of that, from its scatter over the modes
    n_modes: int  # which have a prediction both without and with the effects
    holds: bool  # whether the error falls by a fifth at least and the score rises by more than two standard errors


def judge_stated_effects(
    effects: Sequence[str], predicts: str, before: Floats, after: Floats, gains: Floats
) -> StatedClaim | None:
    """Judge stated effects by errors of prediction, ln f, and each mode's gain in log density; None with too few
    modes."""
    if gains.size < _FEWEST_MODES:
        return None
    old, new = (rms(cents(errors)) or 0.0 for errors in (before, after))
    gain, error = score_gain(gains)
    falls, rises = new <= (1.0 - LEAST_ERROR_FALL) * old, gain > STANDARD_ERRORS * error
    return StatedClaim(
        effects=tuple(effects),
        predicts=predicts,
        before_rms_cents=old,
        after_rms_cents=new,
        log_score_gain=gain,
        standard_error=error,
        n_modes=int(gains.size),
        holds=falls and rises,
    )


def stated_claims(problem: PosedProblem, fits: Sequence[KnownFit]) -> tuple[StatedClaim, ...]:
    """Judge the stated effects of a board by modes left out, and by each further setup that states other sizes."""
    board = problem.board
    effects = stated_effects(board)
    by_combination = {fit.combination: fit for fit in fits}
    if not effects or not {(), effects} <= by_combination.keys():
        return ()
    bare_fit, stated_fit = by_combination[()], by_combination[effects]
    before, after = bare_fit.errors.left_out, stated_fit.errors.left_out
    has_both = np.asarray(np.isfinite(before) & np.isfinite(after))
    has_both &= (bare_fit.errors.leverages.carries < 0) & (stated_fit.errors.leverages.carries < 0)
    modes = [mode for mode in readings_by_mode(board) if has_both[list(mode)].all()]
    compared = np.array([reading for mode in modes for reading in mode], dtype=np.intp)
    scores = [scores_given(fit.baseline, modes) for fit in (bare_fit, stated_fit)]
    claims = [judge_stated_effects(effects, "", before[compared], after[compared], scores[1] - scores[0])]
    further_setups = [setup.name for setup in board.setups[1:] if _states_differently(board, effects, setup.name)]
    if further_setups:
        claims += _claims_of_further_setups(problem, effects, further_setups)
    return tuple(claim for claim in claims if claim is not None)


def _claims_of_further_setups(
    problem: PosedProblem, effects: Sequence[str], names: Sequence[str]
) -> list[StatedClaim | None]:
    """Claims of further setups, predicted by the constants of the first setup."""
    n_first = len(problem.board.setups[0].readings)
    try:
        fits = [fit_with_effects(problem, combination, n_first) for combination in ((), effects)]
    except NotIdentifiableError:  # the first setup does not determine the constants
        return []
    claims = []
    for number, setup in enumerate(problem.board.setups):
        if setup.name in names:
            is_compared = (fits[0].setup_index == number) & fits[0].is_mode & fits[1].is_mode
            own_readings = np.flatnonzero(is_compared)
            scores = [scores_given(fit, [[i] for i in own_readings.tolist()], range(n_first)) for fit in fits]
            before, after = (fit.residual[own_readings] for fit in fits)
            claims.append(judge_stated_effects(effects, setup.name, before, after, scores[1] - scores[0]))
    return claims


def scores_given(fit: Baseline, groups: Sequence[Sequence[int]], predictors: Iterable[int] | None = None) -> Floats:
    """ln of the probability density of the readings of each group given the others, or given the
    readings `predictors`: (n_groups,) array.

    To first order about a fit of fixed inputs. The constants are left open and the noise is averaged over its prior, so
    that neither a better fit to the reading itself nor a noise that follows it can raise its score.
    """
    reach = noise_reach(fit.board, fit.setup_index, np.where(fit.is_mode, fit.residual, np.nan))
    noise = noise_grid(fit.board, reach=reach)
    empty = no_effect_cells(fit.n_modes, fit.log_rigidities.size)

    def log_density(readings: set[int]) -> float:
        rows = np.where(np.isin(np.arange(fit.n_modes), list(readings)), fit.rows, -1)
        return float(NormalTerms(empty, fit.labelled(rows), noise).log_evidence(fit.residual[None, :])[0])

    given_readings = set(range(fit.n_modes) if predictors is None else predictors)
    return np.array(
        [log_density(given_readings | set(group)) - log_density(given_readings - set(group)) for group in groups]
    )


def _states_differently(board: Board, effects: Sequence[str], name: str) -> bool:
    """Whether the card states other sizes of known effects in a setup than in the first one."""

    def sizes(setup_name: str) -> list[tuple[str, object]]:
        return [
            (parameter.key, parameter.prior)
            for effect in effects
            for acting in effects_at_known_size(board, effect)
            if acting.owner.name == setup_name
            for parameter in acting.parameters()
        ]

    return sizes(name) != sizes(board.setups[0].name)
