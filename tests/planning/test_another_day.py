"""The modes that were read, once more: what the first readings were off by tells of the next."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of

from bayesplate.board.parameter import Owner
from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import shared_share
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.diagnosis.evidence.hypotheses import Swap
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.gains import Readings
from bayesplate.planning.modes_read import REPEATED, _as_read, _given_first

HERTZ = dict(zip(CANTILEVER_LABELS, (50.0, 98.0, 310.0, 340.0, 480.0, 700.0), strict=True))
SETUP = setup_of(ritz.CANTILEVER, HERTZ, resolution=1.0, noise=Quantity.from_median(0.004, 1.6))
N, N_U = len(HERTZ), 3
RNG = np.random.default_rng(4)
SLOPES, SHIFT = RNG.standard_normal((N, N_U)), RNG.standard_normal(N)
FIRST, SECOND = 0.005, 0.003
"""Noise of the first day as the search has it, and what is expected of the second."""


def once_more(setup, share, noise=SECOND):
    """Readings of one term, given the first."""
    board = board_of(ritz.FINNISH, [setup])
    station = SimpleNamespace(base=setup, setup=setup, n_old=N)
    own = ReadingErrors.of(setup).own_variance
    alone = Readings((SHIFT[None],), (SLOPES[None],), ((noise**2 + own)[None],))
    return _given_first(
        SimpleNamespace(board=board), station, range(N), alone, [np.array([FIRST**2])], [np.array([share])]
    )


def test_both_days_tell_what_their_joint_covariance_says():
    """Normal equations of all readings, their covariance written out, against the second day given the first."""
    share, own = shared_share(SETUP), ReadingErrors.of(SETUP).own_variance
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
    assert shared_share(setup) == 0.0
    given = once_more(setup, 0.0)
    assert given.slopes[0][0] == pytest.approx(SLOPES)
    assert given.shift[0][0] == pytest.approx(SHIFT)
    assert given.variance[0][0] == pytest.approx(SECOND**2 + ReadingErrors.of(SETUP).own_variance)


def test_a_free_board_finds_half_of_its_noise_again():
    assert shared_share(replace(SETUP, noise=DEFAULT_NOISE)) == pytest.approx(0.5)


def test_the_same_day_once_more_tells_of_the_constants_no_more_than_better_reading_would():
    """Board and clamp are off by the same again: what is left is the rounding of two readings in place of one."""
    given = once_more(SETUP, 1.0 - (REPEATED / FIRST) ** 2, FIRST)
    own = ReadingErrors.of(SETUP).own_variance
    slopes, variance = given.slopes[0][0], given.variance[0][0]
    before = SLOPES.T @ (SLOPES / (FIRST**2 + own)[:, None])
    after = before + slopes.T @ (slopes / variance[:, None])
    of_mean = SLOPES.T @ (SLOPES / (FIRST**2 + 0.5 * (own - REPEATED**2))[:, None])

    assert (np.diagonal(before) < np.diagonal(after)).all()
    assert (np.diagonal(after) < 1.001 * np.diagonal(of_mean)).all()


def read_as(hypothesis):
    """Shift and slopes of the readings at hand as an explanation takes them; one further mode, one known mass."""
    baseline = SimpleNamespace(
        board=SimpleNamespace(setups=(SimpleNamespace(name="other"), SETUP)), rows=np.arange(2, 4 + N),
        setup_index=np.r_[0, 0, np.ones(N, dtype=int)],
    )  # fmt: skip
    found = SimpleNamespace(ground=SimpleNamespace(baseline=baseline, hypotheses=(hypothesis,)))
    law = SimpleNamespace(station=SimpleNamespace(base=SETUP, n_old=N, setup=SimpleNamespace(readings=range(N + 1))))
    shift, slopes = np.arange(2.0 * (N + 1))[None], np.arange(N + 1.0)[None, :, None]
    return _as_read(SimpleNamespace(hypothesis=0), law, found, shift, slopes)


def test_where_labels_are_exchanged_each_peak_is_found_again_as_the_other_mode():
    """With and without a known mass; of the further mode nothing changes."""
    shift, slopes = read_as(SimpleNamespace(swap=Swap(3, 5), own=None))  # two readings of another setup come first

    taken = np.array([0, 3, 2, 1, 4, 5, 6])
    assert shift[0] == pytest.approx(np.r_[taken, taken + N + 1])
    assert slopes[0, :, 0] == pytest.approx(taken)


def test_a_reading_that_is_no_mode_or_an_unread_one_says_nothing_of_another_day():
    own = SimpleNamespace(rows=np.array([2, 3, 5, 4, 30, -1, 8, 9]))
    shift, _ = read_as(SimpleNamespace(swap=None, own=own))

    taken = np.array([1, 0, np.nan, np.nan, 4, 5, 6])
    assert shift[0] == pytest.approx(np.r_[taken, taken + N + 1], nan_ok=True)
    plain, _ = read_as(SimpleNamespace(swap=None, own=None))
    assert plain[0] == pytest.approx(np.arange(2.0 * (N + 1)))
