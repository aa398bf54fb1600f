"""Boards left out: whether each agrees with the others, and whether a shared effect may be claimed.

Each board is judged against the rest, so that a shared value is noticed which one board refuses. An effect is claimed
where the shared parameters that the others teach predict the boards left out better.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.boards import FittedBoard
from bayesplate.campaign.combined import CombinedBoards, shared_values
from bayesplate.campaign.learning import SharedPosterior
from bayesplate.diagnosis.claim import STANDARD_ERRORS, score_gain
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import Spread

_LEAST_PRECISION = 0.25
"""Precision, over that of the prior, above which a board informs a direction: its posterior is then narrower by a tenth
at least. A likelihood with a slope and no curvature moves a posterior and leaves it as wide; the variance of its slope
would count as zero, and a slope of one standard deviation as a refusal."""
REFUSED_BELOW = 0.05
"""p-value, multiplied by the number of boards, below which a board refuses what the others teach."""


@dataclass(frozen=True)
class LeftOutBoard:
    """A board when the others teach it the shared parameters."""

    log_score: float  # ln of the probability of its readings, the shared parameters learned from the others
    p_value: float  # how often a board that shares the others' parameters would want to leave them at least as much
    refuses: bool  # whether it does not want what they teach, as many boards as were asked being allowed for


def judge_left_out_boards(combined: CombinedBoards) -> dict[str, LeftOutBoard]:
    """Leave each board out in turn and judge it against the others."""
    log_evidence, refusing_names = combined.log_evidence(), refusing_boards(combined)
    return {
        name: LeftOutBoard(
            log_evidence - combined.log_evidence((i,)), board_p_value(combined, i), name in refusing_names
        )
        for i, name in enumerate(combined.names)
    }


def refusing_boards(combined: CombinedBoards) -> tuple[str, ...]:
    """Names of the boards that refuse what the others teach, with a correction for the number of boards.

    The board with the smallest p-value is left out before the others are judged again, because it had taught them too.
    Where the last two boards do not agree, both are named: nothing tells which of them is odd.
    """
    refusing_indices: list[int] = []
    n = len(combined.names)
    while len(refusing_indices) < n - 1:
        values = {i: board_p_value(combined, i, refusing_indices) for i in range(n) if i not in refusing_indices}
        worst = min(values, key=lambda i: values[i])
        if values[worst] * len(values) >= REFUSED_BELOW:
            break
        refusing_indices += [worst] if len(values) > 2 else list(values)
    return tuple(combined.names[i] for i in sorted(refusing_indices))


def board_p_value(combined: CombinedBoards, board: int, without: Collection[int] = ()) -> float:
    """P-value of one board against the others that are not left out: the score test of its likelihood.

    The board's own posterior, its prior divided out, is a normal likelihood exp(h'z - z'Pz / 2). If the board is of the
    same kind as the others, which teach its numbers with the mean m and the covariance C, its slope h - P m there is
    normal about zero with the covariance P + P C P. Only directions count that the board informs.

    References
    ----------
    E. C. Marshall and D. J. Spiegelhalter, Identifying outliers in Bayesian hierarchical models: a simulation-based
    approach, Bayesian Analysis 2 (2007). [each unit against the rest]
    """
    from scipy.stats import chi2

    mean, covariance = combined.moments_from_others((board, *without))
    likelihood = combined.normal_likelihoods[board]
    sizes, directions = np.linalg.eigh(likelihood.precision)
    informed_directions = directions[:, sizes > _LEAST_PRECISION]
    if not informed_directions.size:
        return 1.0
    slope = informed_directions.T @ (likelihood.precision_times_mode - likelihood.precision @ mean)
    spread = (
        informed_directions.T
        @ (likelihood.precision + likelihood.precision @ covariance @ likelihood.precision)
        @ informed_directions
    )
    return float(chi2.sf(slope @ np.linalg.solve(spread, slope), informed_directions.shape[1]))


LEAST_GAIN = float(np.log(20.0))
"""Least gain in the sum of log scores: the scatter of boards that gain nearly nothing is as small."""
_N_DRAWS = 4000
_LINE = 18


@dataclass(frozen=True)
class TaughtBoard:
    """A board that was left out: what it gives when the others teach it the shared effect."""

    # ln of the probability of its readings with what the others teach, over that without the effect
    log_score_gain: float
    before_rms_cents: float  # error of its labelled modes without the effect, its own constants fitted
    after_rms_cents: float  # the same with the others' effect
    p_value: float  # of the board against the others
    refuses: bool
    others: Mapping[str, Spread]  # the shared numbers as the others teach them


@dataclass(frozen=True)
class SharedClaim:
    """Whether it may be said that the boards share an effect."""

    gain: float  # sum over the left-out boards of the gain in log score
    standard_error: float  # of that, from the boards' scatter
    refused_by: tuple[str, ...]  # boards that do not want what the others teach
    n_better: int  # boards whose own score rises
    # whether the sum rises by more than two standard errors and by ln 20, more than half of the boards gain, and none
    # refuses
    holds: bool


def judge_shared_effect(boards: Mapping[str, TaughtBoard]) -> SharedClaim:
    """Judge a shared effect by the boards that were left out."""
    gains = [board.log_score_gain for board in boards.values()]
    total, error = score_gain(gains)
    refused_by = tuple(name for name, board in boards.items() if board.refuses)
    n_better = sum(gain > 0.0 for gain in gains)
    holds = total > max(STANDARD_ERRORS * error, LEAST_GAIN) and 2 * n_better > len(gains) and not refused_by
    return SharedClaim(total, error, refused_by, n_better, holds)


def taught_boards(posterior: SharedPosterior, before: Mapping[str, FittedBoard], seed: int) -> dict[str, TaughtBoard]:
    """Predict each board by what the others teach; `before` are the boards fitted without the shared effect."""
    combined, boards = posterior.combined, {}
    for i, (name, left_out_board) in enumerate(judge_left_out_boards(combined).items()):
        rng = np.random.default_rng([seed, _LINE, i])
        bare_board = before[name]
        draws = posterior.board_left_out(i, rng, seed)
        taught_values = shared_values(combined.shared, combined.draws_from_others(rng, _N_DRAWS, (i,)))
        boards[name] = TaughtBoard(
            log_score_gain=left_out_board.log_score - bare_board.own_sample.log_evidence,
            before_rms_cents=rms_cents(bare_board.draws),
            after_rms_cents=rms_cents(draws),
            p_value=left_out_board.p_value,
            refuses=left_out_board.refuses,
            others={
                parameter.name: Spread.of(taught_values[parameter.name], parameter.unit)
                for parameter in combined.shared
            },
        )
    return boards


def rms_cents(draws: Draws) -> float:
    """Rms error of the labelled modes, cents: measured over the posterior mean of the prediction."""
    predicted = draws.log_frequency.reshape(-1, draws.log_frequency.shape[-1])
    measured = np.concatenate([setup.measured for setup in draws.problem.board.setups])
    residuals = cents(np.log(measured) - np.log(np.exp(predicted).mean(axis=0)))
    return float(np.sqrt(np.mean(residuals**2)))
