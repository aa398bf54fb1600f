"""Whether a shared effect may be claimed: boards left out must be predicted better by what the others teach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.agreement import left_out
from bayesplate.campaign.boards import Member
from bayesplate.campaign.learning import Learnt
from bayesplate.campaign.together import values_of
from bayesplate.diagnosis.claim import STANDARD_ERRORS, score_gain
from bayesplate.frequencies.laws import cents
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.results.contract import Spread

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
