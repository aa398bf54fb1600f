"""What is claimed of a shared effect: simulated campaigns with it, without it, and with it on some boards only."""

from __future__ import annotations

import numpy as np
import pytest
from linear_boards import exactly_together, linear_boards

from bayesplate.campaign.claim import LEAST_GAIN, TaughtBoard, judge, left_out

N_BOARDS = 8


def board(gain, refuses=False):
    return TaughtBoard(gain, 10.0, 8.0, 0.001 if refuses else 0.5, refuses, {})


def claimed(seed, size, without=()):
    """The claim on a campaign of linear boards with one shared number, whose absence is zero."""
    rng = np.random.default_rng(seed)
    boards = linear_boards(rng, N_BOARDS, 1, [size], without=without)
    together = exactly_together(boards)
    taught = {}
    for (name, one), each in zip(left_out(together).items(), boards, strict=True):
        alone = float(each.at(np.zeros((1, 1)))[0])
        taught[name] = TaughtBoard(one.log_score - alone, 0.0, 0.0, one.p_value, one.refuses, {})
    return judge(taught).holds


def test_what_all_boards_share_is_claimed():
    assert np.mean([claimed(seed, 1.5) for seed in range(30)]) > 0.8


def test_nothing_is_claimed_where_nothing_is_shared():
    """At most 5 %: of 100 campaigns as many as that allows with a probability of one in a thousand."""
    assert sum(claimed(seed, 0.0) for seed in range(100, 200)) <= 12


def test_what_three_of_eight_have_is_not_claimed():
    assert np.mean([claimed(seed, 1.5, without=(0, 2, 3, 5, 7)) for seed in range(200, 230)]) <= 0.1


@pytest.mark.parametrize(
    ("boards", "holds"),
    [
        ([2.0, 2.5, 3.0], True),
        ([2.0, 2.5, -9.0], False),  # no more than its scatter
        ([6.0, 0.5, 1.0], False),  # 1.4 standard errors
        ([0.5, 0.5, 0.5], False),  # no more than ln 20
        ([9.0, -0.1, -0.1, -0.1], False),  # one board alone
    ],
)
def test_the_conditions(boards, holds):
    found = judge({str(i): board(gain) for i, gain in enumerate(boards)})

    assert found.holds is holds
    assert found.gain == pytest.approx(sum(boards))


def test_a_board_that_refuses_is_heard():
    gains = {str(i): board(3.0 + 0.1 * i) for i in range(5)}

    assert judge(gains).holds
    assert not judge(gains | {"2": board(3.0, refuses=True)}).holds
    assert judge(gains | {"2": board(3.0, refuses=True)}).refused_by == ("2",)
    assert LEAST_GAIN < 15.0
