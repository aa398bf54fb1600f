"""The modes that were read, once more: what the first readings were off by tells of the next."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, setup_of

from bayesplate.board.parameter import Owner
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import shared_variance_share
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import ExplanationTerms, ReadingsAtHand
from bayesplate.planning.explained import _readings_at_hand
from bayesplate.planning.gains import PlannedReadings
from bayesplate.planning.modes_read import REPEAT_SCATTER, _expected_modes, repeat_readings

HERTZ = dict(zip(CANTILEVER_LABELS, (50.0, 98.0, 310.0, 340.0, 480.0, 700.0), strict=True))
SETUP = setup_of(ritz.CANTILEVER, HERTZ, resolution=1.0, noise=Quantity.from_median(0.004, 1.6))
N, N_U = len(HERTZ), 3
RNG = np.random.default_rng(4)
SLOPES, SHIFT = RNG.standard_normal((N, N_U)), RNG.standard_normal(N)
FIRST, SECOND = 0.005, 0.003
"""Noise of the first day as the search has it, and what is expected of the second."""


def once_more(setup, share, noise=SECOND):
    """Readings of one term, given the first."""
    station = SimpleNamespace(base=setup, setup=setup, n_old=N)
    own = ReadingErrors.of(setup).own_variance
    alone = PlannedReadings((SHIFT[None],), (SLOPES[None],), ((noise**2 + own)[None],))
    return repeat_readings(station, range(N), alone, [np.array([FIRST**2])], [np.array([share])])


def test_both_days_tell_what_their_joint_covariance_says():
    """Normal equations of all readings, their covariance written out, against the second day given the first."""
    share, own = shared_variance_share(SETUP), ReadingErrors.of(SETUP).own_variance
    assert share == pytest.approx(9.0 / 25.0)
    common = share * FIRST**2
    one, other = FIRST**2 + own, common + (1.0 - share) * SECOND**2 + own
    covariance = np.block([[np.diag(one), common * np.eye(N)], [common * np.eye(N), np.diag(other)]])
    read = np.concatenate([np.log(list(HERTZ.values())), RNG.standard_normal(N)])
    whole = np.vstack([SLOPES, SLOPES])
    weighted = np.linalg.solve(covariance, whole)
    precision = weighted.T @ whole
    mean = np.linalg.solve(precision, weighted.T @ (read - np.tile(SHIFT, 2)))

    given = once_more(SETUP, share)
    slopes, variance = given.slopes[0][0], given.variance[0][0]
    later = SLOPES.T @ (SLOPES / one[:, None]) + slopes.T @ (slopes / variance[:, None])
    told = SLOPES.T @ ((read[:N] - SHIFT) / one) + slopes.T @ ((read[N:] - given.shift[0][0]) / variance)

    assert later == pytest.approx(precision, rel=1e-10)
    assert np.linalg.solve(later, told) == pytest.approx(mean, rel=1e-8)
    independent = SLOPES.T @ (SLOPES * (1.0 / one + 1.0 / (SECOND**2 + own))[:, None])
    assert np.linalg.slogdet(later)[1] < np.linalg.slogdet(independent)[1] - 0.5  # the second day is no new board


def test_where_sessions_share_their_discrepancies_already_another_one_is_as_new_as_they_were():
    setup = replace(SETUP, group=Owner("group", "monday to friday"))
    assert shared_variance_share(setup) == 0.0
    given = once_more(setup, 0.0)
    assert given.slopes[0][0] == pytest.approx(SLOPES)
    assert given.shift[0][0] == pytest.approx(SHIFT)
    assert given.variance[0][0] == pytest.approx(SECOND**2 + ReadingErrors.of(SETUP).own_variance)


def test_a_free_board_finds_half_of_its_noise_again():
    assert shared_variance_share(replace(SETUP, noise=DEFAULT_NOISE)) == pytest.approx(0.5)


def test_the_same_day_once_more_tells_of_the_constants_no_more_than_better_reading_would():
    """Board and clamp are off by the same again: what is left is the rounding of two readings in place of one."""
    given = once_more(SETUP, 1.0 - (REPEAT_SCATTER / FIRST) ** 2, FIRST)
    own = ReadingErrors.of(SETUP).own_variance
    slopes, variance = given.slopes[0][0], given.variance[0][0]
    before = SLOPES.T @ (SLOPES / (FIRST**2 + own)[:, None])
    after = before + slopes.T @ (slopes / variance[:, None])
    of_mean = SLOPES.T @ (SLOPES / (FIRST**2 + 0.5 * (own - REPEAT_SCATTER**2))[:, None])

    assert (np.diagonal(before) < np.diagonal(after)).all()
    assert (np.diagonal(after) < 1.001 * np.diagonal(of_mean)).all()


def read_as(taken):
    """What is expected of the readings at hand as an explanation takes them; one further mode, one known mass."""
    other = SimpleNamespace(name="other", readings=(None, None))
    known = SimpleNamespace(columns=np.eye(1), board=SimpleNamespace(setups=(other, SETUP)))
    at_hand = None
    if taken is not None:
        every = np.r_[0, 1, taken]
        at_hand = ReadingsAtHand(100.0 + every[None], 0.5 * every[None, :, None], every)
    one = ExplanationTerms(
        members=(), words="", probability=1.0, mean=np.zeros((1, 1)), covariance=np.eye(1)[None],
        noise=np.full((1, 2), FIRST), middle=np.zeros((1, 0)), target_slopes=np.zeros((1, 0, 1)),
        readings_at_hand=at_hand,
    )  # fmt: skip
    solved = np.arange(2.0 * (N + 1)).reshape(2, -1)
    station = SimpleNamespace(base=SETUP, n_old=N)
    law = SimpleNamespace(station=station, middle=solved[0], solved=solved, slopes=np.arange(N + 1.0)[None, :, None])
    return _expected_modes(one, known, law)


@pytest.mark.parametrize(
    ("found_again", "taken"),
    [
        ([2, 5, 4, 3, 6, 7], [0, 3, 2, 1, 4, 5]),  # two labels exchanged
        ([3, 2, -1, -1, 6, 7], [1, 0, np.nan, np.nan, 4, 5]),  # no mode, or an unread one, says nothing of another day
    ],
)
def test_where_labels_are_exchanged_each_peak_is_found_again_as_the_other_mode(found_again, taken):
    """With and without a known mass; of the further mode nothing changes. Two readings of another setup come first."""
    shift, slopes = read_as(np.array(found_again))

    taken, is_mode = np.array(taken), np.isfinite(taken)
    assert shift[0] == pytest.approx(np.r_[102.0 + taken, N, taken + N + 1, 2 * N + 1], nan_ok=True)
    assert slopes[0, :N, 0][is_mode] == pytest.approx(1.0 + 0.5 * taken[is_mode])
    assert slopes[0, N, 0] == N
    assert not slopes[0, N + 1 :].any()


def test_without_readings_at_hand_modes_are_expected_where_the_law_has_them():
    assert read_as(None)[0][0] == pytest.approx(np.arange(2.0 * (N + 1)))


@pytest.mark.parametrize(
    ("rows", "taken", "none"),
    [
        ([2, 3, 4, 7, 6, 5, 8, 9], [0, 1, 2, 5, 4, 3, 6, 7], []),
        ([2, 3, 5, 4, 30, -1, 8, 9], [0, 1, 3, 2, -1, -1, 6, 7], [5]),
    ],
    ids=["two labels exchanged", "one taken for an unread mode and one for none"],
)
def test_what_an_explanation_with_other_labels_takes_each_reading_for(rows, taken, none):
    """Of eight readings, which are the modes 2 to 9 by their labels; its arrays are those of its own labels already."""
    of_label, own_rows = np.arange(2, 10), np.asarray(rows)
    base = SimpleNamespace(rows=of_label)
    own = SimpleNamespace(n_modes=8, rows=own_rows, is_mode=own_rows >= 0)
    found = _readings_at_hand(own, base, 10.0 + np.arange(8.0)[None], np.arange(8.0)[None, :, None])

    expected = np.where(np.isin(np.arange(8), none), np.nan, 10.0 + np.arange(8.0))
    assert found.reading_index.tolist() == taken
    assert found.shift[0] == pytest.approx(expected, nan_ok=True)
    assert np.delete(found.slopes[0, :, 0], none) == pytest.approx(np.delete(np.arange(8.0), none))
