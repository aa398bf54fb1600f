"""Boards together against normal equations by hand: boards of three constants each that share two numbers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.board.material import ORTHOTROPIC
from bayesplate.planning import campaign as home
from bayesplate.planning.beliefs import KnownBoard
from bayesplate.planning.campaign import _further_board, _join_boards, _LinearBoard
from bayesplate.planning.gains import PlannedReadings, expected_gain

SD = 0.5
NAMES = ("one", "two")
RNG = np.random.default_rng(2)
DESIGNS = [RNG.normal(size=(6, 5)) for _ in range(2)]
"""Of each board's own columns, then the shared ones."""


@pytest.fixture(autouse=True)
def _own_constants(monkeypatch):
    monkeypatch.setattr(home, "log_moduli", lambda board, at: (np.zeros(3), np.eye(3)))


def linear(design):
    """A board all of whose modes were read, its noise known."""
    precision = design.T @ design / SD**2
    across = precision[:3, 3:]
    pull = precision[3:, 3:] - across.T @ np.linalg.solve(precision[:3, :3], across)
    symmetry = SimpleNamespace(free_of=lambda values: np.ones(3), n=ORTHOTROPIC.n)
    board = SimpleNamespace(symmetry=symmetry, name="made")
    return _LinearBoard(KnownBoard(board, {}, (), np.eye(3, 5), shared_precision=pull), np.array([SD]), precision)


def together(*designs):
    return _join_boards([linear(one) for one in designs], NAMES)


def by_hand(*designs):
    """Precision of all columns: three of each board, then the two shared ones of standard normal prior."""
    n_u = 3 * len(designs) + 2
    precision = np.diag([*np.zeros(n_u - 2), 1.0, 1.0])
    for i, one in enumerate(designs):
        row = np.zeros((6, n_u))
        row[:, [*range(3 * i, 3 * i + 3), n_u - 2, n_u - 1]] = one
        precision += row.T @ row / SD**2
    return precision


def gain_of(beliefs, rows, variance):
    readings = PlannedReadings((np.zeros((1, len(rows))),), (rows[None],), (np.full((1, len(rows)), variance),))
    return expected_gain(beliefs, readings, np.random.default_rng(1))


def test_the_joint_covariance_is_that_of_all_readings_together():
    found = together(*DESIGNS)
    assert found.explanations[0].covariance[0] == pytest.approx(np.linalg.inv(by_hand(*DESIGNS)))
    assert [one.first_setup for one in found.boards] == [0, 1]


def test_one_more_reading_shrinks_what_it_sees():
    row = np.array([[0.0, 0.0, 0.0, 0.3, 0.0, 1.0, 1.0, -0.5]])

    found = gain_of(together(*DESIGNS), row, SD**2)

    before, after = np.linalg.inv(by_hand(*DESIGNS)), np.linalg.inv(by_hand(*DESIGNS) + row.T @ row / SD**2)
    left = np.sqrt(np.diagonal(after) / np.diagonal(before))
    assert list(found.shared.values()) == pytest.approx(left[6:])
    assert (found.E_x, found.E_y, found.G_xy) == pytest.approx(tuple(np.sqrt(left[:3] * left[3:6])))
    of_shared = np.linalg.det(before[6:, 6:]) / np.linalg.det(after[6:, 6:])
    assert found.information == pytest.approx(0.5 * np.log(of_shared))
    assert found.score == pytest.approx(-np.mean(np.log(left[6:])))
    assert (found.explanations, found.constants_error) == (None, 0.0)


def test_another_board_is_what_it_says_of_the_shared_parameters():
    """A third board like the first: by its integrated precision, and by all its readings with constants of its own."""
    beliefs = together(*DESIGNS)
    readings = _further_board(beliefs, beliefs.boards[0], "", ()).readings

    found = expected_gain(beliefs, readings, np.random.default_rng(1))

    three = np.diagonal(np.linalg.inv(by_hand(*DESIGNS, DESIGNS[0])))[9:]
    two = np.diagonal(np.linalg.inv(by_hand(*DESIGNS)))[6:]
    assert list(found.shared.values()) == pytest.approx(np.sqrt(three / two))
