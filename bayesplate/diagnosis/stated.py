"""The claim without selection: what the card states is not chosen by the readings, so that two conditions are enough.

Known effects that the card states or declares are computed at their stated sizes, and nothing is searched for: neither
chance selection nor priors of sizes can make an error fall. The same holds of a second setup that is predicted by the
constants of the first.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.sessions import same_modes
from bayesplate.diagnosis.baseline import Baseline
from bayesplate.diagnosis.claim import STANDARD_ERRORS, score_gain
from bayesplate.diagnosis.known import KnownFit, acting_at_known_size, fit_with, stated_effects
from bayesplate.diagnosis.shifts import nothing
from bayesplate.diagnosis.terms import Terms, noise_grid, reach_of
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.contract import rms

LEAST_FALL = 0.2
"""Share of the error by which it has to fall."""
_FEWEST = 3
"""Modes without which differences have no scatter worth the name."""


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


def judge_stated(
    effects: Sequence[str], predicts: str, before: Floats, after: Floats, gains: Floats
) -> StatedClaim | None:
    """Judge stated effects by errors of prediction, ln f, and each mode's gain in log density; None of too few."""
    if gains.size < _FEWEST:
        return None
    old, new = (rms(cents(errors)) or 0.0 for errors in (before, after))
    gain, error = score_gain(gains)
    falls, rises = new <= (1.0 - LEAST_FALL) * old, gain > STANDARD_ERRORS * error
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
    """Judge what the card states of a board: by modes left out, and by each further setup in which it is another."""
    board = problem.board
    effects = stated_effects(board)
    if not effects:
        return ()
    without, having = (next(one for one in reversed(fits) if one.combination == wanted) for wanted in ((), effects))
    before, after = without.errors.left_out, having.errors.left_out
    both = np.asarray(np.isfinite(before) & np.isfinite(after))
    both &= (without.errors.leverages.carries < 0) & (having.errors.leverages.carries < 0)
    modes = [mode for mode in same_modes(board) if both[list(mode)].all()]
    scores = [scores_given(one.baseline, modes) for one in (without, having)]
    claims = [judge_stated(effects, "", before[both], after[both], scores[1] - scores[0])]
    further = [setup.name for setup in board.setups[1:] if _states_differently(board, effects, setup.name)]
    if further:
        claims += _of_further_setups(problem, effects, further)
    return tuple(one for one in claims if one is not None)


def _of_further_setups(problem: PosedProblem, effects: Sequence[str], names: Sequence[str]) -> list[StatedClaim | None]:
    """Setups predicted by the constants of the first."""
    n_first = len(problem.board.setups[0].readings)
    sides = [fit_with(problem, one, n_first) for one in ((), effects)]
    claims = []
    for number, setup in enumerate(problem.board.setups):
        if setup.name in names:
            own = np.flatnonzero(sides[0].setup_index == number)
            scores = [scores_given(one, [[i] for i in own.tolist()], range(n_first)) for one in sides]
            before, after = (one.residual[own] for one in sides)
            claims.append(judge_stated(effects, setup.name, before, after, scores[1] - scores[0]))
    return claims


def scores_given(fit: Baseline, groups: Sequence[Sequence[int]], given: Iterable[int] | None = None) -> Floats:
    """ln of the probability density of the readings of each group given the others, or those `given`: (n_groups,)
    array.

    To first order about a fit of fixed inputs. The constants are left open and the noise is averaged over its prior, so
    that neither a better fit to the reading itself nor a noise that follows it can raise its score.
    """
    reach = reach_of(fit.board, fit.setup_index, np.where(fit.is_mode, fit.residual, np.nan))
    noise = noise_grid(fit.board, reach=reach if len(fit.board.setups) <= 2 else ())
    empty = nothing(fit.n_modes, fit.log_rigidities.size)

    def log_density(used: set[int]) -> float:
        rows = np.where(np.isin(np.arange(fit.n_modes), list(used)), fit.rows, -1)
        return float(Terms(empty, fit.labelled(rows), noise).log_evidence(fit.residual[None, :])[0])

    every = set(range(fit.n_modes) if given is None else given)
    return np.array([log_density(every | set(one)) - log_density(every - set(one)) for one in groups])


def _states_differently(board: Board, effects: Sequence[str], name: str) -> bool:
    """Whether what the card states of known effects is another in a setup than in the first one."""

    def sizes(setup: str) -> list[tuple[str, object]]:
        return [
            (one.key, one.prior)
            for effect in effects
            for acting in acting_at_known_size(board, effect)
            if acting.owner.name == setup
            for one in acting.parameters()
        ]

    return sizes(name) != sizes(board.setups[0].name)
