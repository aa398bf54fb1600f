"""Boards left out: whether each wants what the others teach, and whether a shared effect may be claimed.

Each is judged against the rest, so that a value that one refuses is noticed; an effect is claimed where boards left out
are predicted better by what the others teach.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.boards import Member
from bayesplate.campaign.learning import Learnt
from bayesplate.campaign.together import Together, values_of
from bayesplate.diagnosis.claim import STANDARD_ERRORS, score_gain
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.results.contract import Spread

_SAYS = 0.25
"""Precision, in units of the prior's, above which a board says something of a direction: its posterior is then
narrower by a tenth at least. A likelihood with a slope and no curvature moves a posterior and leaves it as wide; the
variance of its slope would be taken for zero, and a lean of one standard deviation for a refusal."""
REFUSED = 0.05
"""p-value, multiplied by the number of boards, below which a board refuses what the others teach."""


@dataclass(frozen=True)
class LeftOut:
    """A board when the others teach it the shared parameters."""

    log_score: float  # ln of the probability of its readings, the shared parameters learned from the others
    p_value: float  # how often a board that shares the others' parameters would want to leave them at least as much
    refuses: bool  # whether it does not want what they teach, as many boards as were asked being allowed for


def left_out(together: Together) -> dict[str, LeftOut]:
    """Every board left out in turn."""
    everything, refused = together.log_evidence(), refusing(together)
    return {
        name: LeftOut(everything - together.log_evidence((i,)), p_value(together, i), name in refused)
        for i, name in enumerate(together.names)
    }


def refusing(together: Together) -> tuple[str, ...]:
    """Names of the boards that refuse what the others teach, as many as were asked being allowed for.

    The one that refuses most is left out before the others are asked again: it had taught them too. Where two are left
    that do not agree, both are named: nothing tells which of them is the odd one.
    """
    out: list[int] = []
    n = len(together.names)
    while len(out) < n - 1:
        values = {i: p_value(together, i, out) for i in range(n) if i not in out}
        worst = min(values, key=lambda i: values[i])
        if values[worst] * len(values) >= REFUSED:
            break
        out += [worst] if len(values) > 2 else list(values)
    return tuple(together.names[i] for i in sorted(out))


def p_value(together: Together, board: int, without: Collection[int] = ()) -> float:
    """Of one board against the others, or those of them that are not left out: the score test of its likelihood.

    The board's own posterior, its prior divided out, amounts to a normal likelihood exp(h'z - z'Pz / 2). If the board
    is one of the others' kind, who teach its numbers with the mean m and the covariance C, its slope h - P m there is
    normal about zero with the covariance P + P C P. Only directions count of which the board says something.

    References
    ----------
    E. C. Marshall and D. J. Spiegelhalter, Identifying outliers in Bayesian hierarchical models: a simulation-based
    approach, Bayesian Analysis 2 (2007). [each unit against the rest]
    """
    from scipy.stats import chi2

    mean, covariance = together.taught((board, *without))
    pull = together.pulls[board]
    sizes, directions = np.linalg.eigh(pull.precision)
    told = directions[:, sizes > _SAYS]
    if not told.size:
        return 1.0
    slope = told.T @ (pull.lean - pull.precision @ mean)
    spread = told.T @ (pull.precision + pull.precision @ covariance @ pull.precision) @ told
    return float(chi2.sf(slope @ np.linalg.solve(spread, slope), told.shape[1]))


LEAST_GAIN = float(np.log(20.0))
"""By how much the boards' scores have to rise in any case: a few that gain nearly nothing scatter as little."""
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


def judge(boards: Mapping[str, TaughtBoard]) -> SharedClaim:
    """Judge a shared effect by the boards that were left out."""
    gains = [one.log_score_gain for one in boards.values()]
    total, error = score_gain(gains)
    refused = tuple(name for name, one in boards.items() if one.refuses)
    better = sum(gain > 0.0 for gain in gains)
    holds = total > max(STANDARD_ERRORS * error, LEAST_GAIN) and 2 * better > len(gains) and not refused
    return SharedClaim(total, error, refused, better, holds)


def taught_boards(learnt: Learnt, before: Mapping[str, Member], seed: int) -> dict[str, TaughtBoard]:
    """Every board left out in turn; `before` are the boards fitted without the effect, nothing shared."""
    together, found = learnt.together, {}
    for i, (name, one) in enumerate(left_out(together).items()):
        rng = np.random.default_rng([seed, _LINE, i])
        without = before[name]
        _, draws = learnt.board_left_out(i, rng, seed)
        taught = values_of(together.shared, together.taught_draws(rng, _N_DRAWS, (i,)))
        found[name] = TaughtBoard(
            log_score_gain=one.log_score - without.alone.log_evidence,
            before_rms_cents=rms_cents(without.inference, without.draws),
            after_rms_cents=rms_cents(learnt.members[i].inference, draws),
            p_value=one.p_value,
            refuses=one.refuses,
            others={number.name: Spread.of(taught[number.name], number.unit) for number in together.shared},
        )
    return found


def rms_cents(inference: Inference, draws: Draws) -> float:
    """Error of the labelled modes: measured over the posterior mean of the prediction, root of the mean square."""
    predicted = draws.log_frequency.reshape(-1, draws.log_frequency.shape[-1])
    measured = np.concatenate([setup.measured for setup in inference.problem.board.setups])
    residuals = cents(np.log(measured) - np.log(np.exp(predicted).mean(axis=0)))
    return float(np.sqrt(np.mean(residuals**2)))
