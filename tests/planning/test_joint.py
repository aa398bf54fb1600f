"""A campaign's joint belief against normal equations by hand: boards of one constant each that share another."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bayesplate.board.material import ORTHOTROPIC
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.planning import joint as home
from bayesplate.planning.joint import BoardInJoint, Joint

SD = 0.5


def member(own, shared, setup=None):
    """A board all of whose modes were read, its noise known."""
    own, shared = np.asarray(own, dtype=float), np.asarray(shared, dtype=float)
    base = SimpleNamespace(peaks=(), name="setup", group=None, noise=Quantity.from_median(SD, 1.6))
    readings = (None,) * len(own)
    station = SimpleNamespace(setup=SimpleNamespace(readings=readings), n_old=len(own), base=base, is_new=False)
    one = BoardInJoint(
        board=SimpleNamespace(symmetry=ORTHOTROPIC), values={},
        laws=(SimpleNamespace(station=station),), own=(own,), shared=(shared,),
        moduli=np.eye(3), names=("a", "b", "c"), noise=np.array([SD]),
    )  # fmt: skip
    object.__setattr__(one, "variance", lambda setup: np.full(len(own), SD**2))
    return one


@pytest.fixture
def joint():
    rng = np.random.default_rng(2)
    boards = tuple(member(rng.normal(size=(6, 3)), rng.normal(size=(6, 2))) for _ in range(2))
    return Joint(boards, 2), boards


def by_hand(boards):
    """Precision of all columns: three of each board, then the two shared ones of standard normal prior."""
    rows = []
    for i, one in enumerate(boards):
        block = np.zeros((6, 8))
        block[:, 3 * i : 3 * i + 3] = one.own[0]
        block[:, 6:] = one.shared[0]
        rows.append(block)
    design = np.concatenate(rows)
    return design.T @ design / SD**2 + np.diag([0.0] * 6 + [1.0, 1.0])


def test_the_joint_covariance_is_that_of_all_readings_together(joint):
    whole, boards = joint
    assert whole.covariance == pytest.approx(np.linalg.inv(by_hand(boards)))


def test_one_more_reading_shrinks_what_it_sees(joint):
    whole, boards = joint
    row = whole.rows(1, np.array([[0.3, 0.0, 1.0]]), np.array([[1.0, -0.5]]))

    shared, moduli, information = whole.ratios(row, np.array([SD**2]))

    after = np.linalg.inv(by_hand(boards) + row.T @ row / SD**2)
    wanted = np.sqrt(np.diagonal(after) / np.diagonal(whole.covariance))
    assert shared == pytest.approx(wanted[6:])
    assert moduli == pytest.approx(np.sqrt(wanted[:3] * wanted[3:6]))
    before = whole.covariance[6:, 6:]
    assert information == pytest.approx(0.5 * np.log(np.linalg.det(before) / np.linalg.det(after[6:, 6:])))


def test_another_board_is_what_it_says_of_the_shared_parameters(joint):
    """A third board like the first: by its integrated precision, and by all its readings with constants of its own."""
    whole, boards = joint
    rows = whole.of_shared(boards[0].of_shared)

    shared, _, _ = whole.ratios(rows, np.ones(len(rows)))

    three = Joint((*boards, member(boards[0].own[0], boards[0].shared[0])), 2)
    wanted = np.sqrt(np.diagonal(three.covariance)[9:] / np.diagonal(whole.covariance)[6:])
    assert shared == pytest.approx(wanted)


def test_another_day_is_what_correlated_readings_say(joint, monkeypatch):
    """All modes of one board twice, the covariance of the two days written out."""
    monkeypatch.setattr(home, "shared_share", lambda base: 0.4)
    whole, boards = joint
    told, variance = boards[0].another_day(0)
    rows = whole.rows(0, boards[0].own[0], boards[0].shared[0])

    shared, _, _ = whole.ratios((1.0 - told)[:, None] * rows, variance)

    both = np.vstack([rows, rows])
    covariance = SD**2 * np.kron(np.array([[1.0, 0.4], [0.4, 1.0]]), np.eye(6))
    precision = by_hand(boards) - rows.T @ rows / SD**2 + both.T @ np.linalg.solve(covariance, both)
    wanted = np.sqrt(np.diagonal(np.linalg.inv(precision)) / np.diagonal(whole.covariance))
    assert shared == pytest.approx(wanted[6:])


def test_less_is_found_again_where_clamping_scatters_more(joint):
    board = joint[1][0]
    assert board.another_day(0)[0] == pytest.approx(DEFAULT_NOISE.median**2 / (DEFAULT_NOISE.median**2 + SD**2))
