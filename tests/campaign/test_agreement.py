"""Whether a board that is unlike the others is noticed, and boards that are alike are not."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from linear_boards import exactly_together, linear_boards, log_evidence

from bayesplate.board.quantity import Quantity
from bayesplate.campaign.claim import left_out, p_value, refusing
from bayesplate.campaign.pulls import Pull


def test_p_values_of_boards_that_share_are_uniform():
    """Their mean and the shares below one half and a tenth, at the tolerance of so many campaigns."""
    values = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        boards = linear_boards(rng, 5, 2, rng.standard_normal(2))
        together = exactly_together(boards)
        values.append([p_value(together, i) for i in range(5)])
    values = np.array(values)
    n = values.size / 2  # the boards of one campaign are compared with each other

    assert abs(values.mean() - 0.5) < 4.0 / np.sqrt(12 * n)
    assert abs((values < 0.5).mean() - 0.5) < 4.0 * 0.5 / np.sqrt(n)
    assert abs((values < 0.1).mean() - 0.1) < 4.0 * 0.3 / np.sqrt(n)


def test_a_board_without_what_the_others_share_is_found():
    rng = np.random.default_rng(1)
    boards = linear_boards(rng, 5, 2, [2.0, -2.0], without=(2,))

    assert refusing(exactly_together(boards)) == ("board 2",)


def test_of_two_boards_that_differ_both_are_named():
    """Which of them is the odd one, nothing tells; of three the odd one alone is named."""
    for seed in range(3):
        boards = linear_boards(np.random.default_rng(seed), 3, 1, [3.0], sd=0.2, without=(0,))

        assert refusing(exactly_together(boards[:2])) == ("board 0", "board 1")
        assert refusing(exactly_together(boards)) == ("board 0",)
        assert refusing(exactly_together(boards[1:])) == ()


def test_a_board_that_says_nothing_of_a_number_that_cannot_be_negative_has_no_pull():
    prior = Quantity.from_mean(0.0, 1.0, "normal", lower=0.0)
    z = np.abs(np.random.default_rng(0).standard_normal((200_000, 1)))
    weights = np.full(len(z), 1.0 / len(z))
    silent, mistaken = Pull.of_draws(z, weights, [prior]), Pull.of_draws(z, weights)

    assert abs(silent.precision[0, 0]) < 0.05
    assert abs(silent.lean[0]) < 0.05
    assert mistaken.precision[0, 0] > 1.5  # the negative control: its prior taken for a normal one


def leaning(size, seed=4, n=4000):
    """A board whose likelihood rises with the first number without a bend, and tells the second well: its pull."""
    rng = np.random.default_rng(seed)
    draws = rng.standard_normal((n, 2)) * np.array([0.98, 0.5]) + np.array([size, 0.2])
    return Pull.of_draws(draws, np.full(n, 1.0 / n))


@pytest.mark.parametrize("size", [-1.0, 1.0])
def test_a_board_that_only_leans_does_not_refuse(size):
    """Its posterior moves by as much as one of the prior's sds and stays as wide."""
    pull = leaning(size)
    others = SimpleNamespace(pulls=[pull], taught=lambda without: (np.zeros(2), 0.1 * np.eye(2)))

    assert np.linalg.eigvalsh(pull.precision)[0] < 0.1  # which its lean would be divided by
    assert p_value(others, 0) > 0.3
    others.pulls[0] = Pull(30.0 * np.eye(2), 30.0 * np.array([3.0 * size, 0.2]))  # control: off, and sure of it
    assert p_value(others, 0) < 0.001


def test_the_log_score_is_that_of_the_board_under_what_the_others_teach():
    rng = np.random.default_rng(2)
    boards = linear_boards(rng, 4, 2, [0.5, 1.0])
    found = left_out(exactly_together(boards))

    for i, one in enumerate(found.values()):
        exact = log_evidence(boards) - log_evidence([b for j, b in enumerate(boards) if j != i])
        assert abs(one.log_score - exact) < 1e-3
