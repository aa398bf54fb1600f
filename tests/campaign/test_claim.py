"""Whether a board that is unlike the others is noticed, and what is claimed of an effect that boards share."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from linear_boards import exactly_together, linear_boards, log_evidence

from bayesplate.board.quantity import Quantity
from bayesplate.campaign.claim import (
    TaughtBoard,
    board_p_value,
    judge_left_out_boards,
    judge_shared_effect,
    refusing_boards,
)
from bayesplate.campaign.normal_likelihood import NormalLikelihood


@pytest.mark.usefixtures("_few_points")
def test_p_values_of_boards_that_share_are_uniform():
    """Their mean and the shares below one half and a tenth, at the tolerance of so many campaigns."""
    values = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        together = exactly_together(linear_boards(rng, 5, 2, rng.standard_normal(2)))
        values.append([board_p_value(together, i) for i in range(5)])
    values = np.array(values)
    n = values.size / 2  # the boards of one campaign are compared with each other

    assert abs(values.mean() - 0.5) < 4.0 / np.sqrt(12 * n)
    assert abs((values < 0.5).mean() - 0.5) < 4.0 * 0.5 / np.sqrt(n)
    assert abs((values < 0.1).mean() - 0.1) < 4.0 * 0.3 / np.sqrt(n)


@pytest.mark.usefixtures("_few_points")
def test_of_two_boards_that_differ_both_are_named_and_of_more_the_odd_one():
    """Which of two is the odd one, nothing tells."""
    for seed in range(3):
        boards = linear_boards(np.random.default_rng(seed), 5, 1, [3.0], sd=0.2, without=(0,))

        assert refusing_boards(exactly_together(boards[:2])) == ("board 0", "board 1")
        assert refusing_boards(exactly_together(boards[:3])) == ("board 0",)
        assert refusing_boards(exactly_together(boards[::-1])) == ("board 4",)
        assert refusing_boards(exactly_together(boards[1:])) == ()


def test_a_board_that_says_nothing_of_a_number_that_cannot_be_negative_has_no_pull():
    prior = Quantity.from_mean(0.0, 1.0, "normal", lower=0.0)
    z = np.abs(np.random.default_rng(0).standard_normal((200_000, 1)))
    weights = np.full(len(z), 1.0 / len(z))
    silent, mistaken = NormalLikelihood.of_draws(z, weights, [prior]), NormalLikelihood.of_draws(z, weights)

    assert abs(silent.precision[0, 0]) < 0.05
    assert abs(silent.precision_times_mode[0]) < 0.05
    assert mistaken.precision[0, 0] > 1.5  # the negative control: its prior taken for a normal one


@pytest.mark.parametrize("size", [-1.0, 1.0])
def test_a_board_that_only_leans_does_not_refuse(size):
    """Its likelihood rises with the first number without a bend, and tells the second well: its posterior moves by as
    much as one of the prior's sds and stays as wide."""
    draws = np.random.default_rng(4).standard_normal((4000, 2)) * np.array([0.98, 0.5]) + np.array([size, 0.2])
    pull = NormalLikelihood.of_draws(draws, np.full(len(draws), 1.0 / len(draws)))
    others = SimpleNamespace(
        normal_likelihoods=[pull], moments_from_others=lambda without: (np.zeros(2), 0.1 * np.eye(2))
    )

    assert np.linalg.eigvalsh(pull.precision)[0] < 0.1  # which its lean would be divided by
    assert board_p_value(others, 0) > 0.3
    others.normal_likelihoods[0] = NormalLikelihood(
        30.0 * np.eye(2), 30.0 * np.array([3.0 * size, 0.2])
    )  # control: off, and sure of it
    assert board_p_value(others, 0) < 0.001


def test_the_log_score_is_that_of_the_board_under_what_the_others_teach():
    boards = linear_boards(np.random.default_rng(2), 4, 2, [0.5, 1.0])

    for i, one in enumerate(judge_left_out_boards(exactly_together(boards)).values()):
        exact = log_evidence(boards) - log_evidence([b for j, b in enumerate(boards) if j != i])
        assert abs(one.log_score - exact) < 1e-3


def claimed(seed, size, without):
    """The claim on a campaign of eight linear boards with one shared number, whose absence is zero."""
    boards = linear_boards(np.random.default_rng(seed), 8, 1, [size], without=without)
    taught = {}
    for (name, one), each in zip(judge_left_out_boards(exactly_together(boards)).items(), boards, strict=True):
        alone = float(each.at(np.zeros((1, 1)))[0])
        taught[name] = TaughtBoard(one.log_score - alone, 0.0, 0.0, one.p_value, one.refuses, {})
    return judge_shared_effect(taught).holds


@pytest.mark.usefixtures("_few_points")
@pytest.mark.parametrize(
    ("seeds", "size", "without", "low", "high"),
    [
        (range(30), 1.5, (), 0.8, 1.0),
        # nothing is shared: at most 5 %, and 12 of 100 where chance has that many once in a thousand
        (range(100, 200), 0.0, (), 0.0, 0.12),
        (range(200, 230), 1.5, (0, 2, 3, 5, 7), 0.0, 0.1),
    ],
    ids=["on all boards", "on none", "on three of eight"],
)
def test_what_all_boards_share_is_claimed_and_nothing_else(seeds, size, without, low, high):
    assert low <= np.mean([claimed(seed, size, without) for seed in seeds]) <= high


@pytest.mark.parametrize(
    ("gains", "refused_by", "holds"),
    [
        ([2.0, 2.5, 3.0], (), True),
        ([2.0, 2.5, -9.0], (), False),  # no more than its scatter
        ([6.0, 0.5, 1.0], (), False),  # 1.4 standard errors
        ([0.5, 0.5, 0.5], (), False),  # no more than ln 20
        ([9.0, -0.1, -0.1, -0.1], (), False),  # one board alone
        ([3.0, 3.1, 3.0, 3.3, 3.4], ("2",), False),
    ],
)
def test_a_claim_needs_a_clear_gain_on_most_boards_and_no_refusal(gains, refused_by, holds):
    boards = {str(i): TaughtBoard(gain, 10.0, 8.0, 0.5, str(i) in refused_by, {}) for i, gain in enumerate(gains)}
    found = judge_shared_effect(boards)

    assert (found.holds, found.refused_by) == (holds, refused_by)
    assert found.gain == pytest.approx(sum(gains))
