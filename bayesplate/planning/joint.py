"""A campaign as one normal belief: each board's own constants and inputs, and what all boards share, to first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.prior import PriorCard
from bayesplate.board.sessions import shared_share
from bayesplate.campaigns.given import GivenShared
from bayesplate.campaigns.scatter import expected_width
from bayesplate.campaigns.shared import Shared
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import moduli_at
from bayesplate.planning.station_laws import BareLaw, bare_law
from bayesplate.planning.stations import new_stations, stations
from bayesplate.posterior.laplace import noise_widenings
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

_STEP = 1e-4
_A_PEAK_IS = 0.015
"""ln of a frequency ratio up to which a peak without a label is taken for the mode that is expected there."""


@dataclass(frozen=True, eq=False)
class BoardInJoint:
    """One board, linear in what is its own and what is shared.

    Attributes
    ----------
    board : Board
    values : dict of float
        At its estimate.
    laws : tuple of BareLaw
        One per setup, then one per way in which the board was never held.
    own : tuple of (n_modes, n_own) array
        Slopes of the modes of each law by ln D and by the standard coordinates of its own inputs.
    shared : tuple of (n_modes, n_shared) array
        By those of what is shared.
    moduli : (3, n_own) array
        Slopes of ln E_x, E_y, G_xy.
    names : tuple of str
        Of the columns of `own`.
    noise : (n_laws,) array
        Relative.
    """

    board: Board
    values: Values
    laws: tuple[BareLaw, ...]
    own: tuple[Floats, ...]
    shared: tuple[Floats, ...]
    moduli: Floats
    names: tuple[str, ...]
    noise: Floats

    def was_read(self, setup: int) -> NDArray[np.bool_]:
        """Which modes of a law were read: those with a label, and those that a peak stands by."""
        law = self.laws[setup]
        if law.station.is_new:
            return np.zeros(len(law.station.setup.readings), dtype=np.bool_)
        found = np.arange(len(law.station.setup.readings)) < law.station.n_old
        peaks = np.log(np.array([one.frequency.mean for one in law.station.base.peaks]))
        for i in np.flatnonzero(~found):
            found[i] = peaks.size > 0 and np.abs(peaks - law.solved[0, i]).min() < _A_PEAK_IS
        return np.asarray(found)

    def variance(self, setup: int) -> Floats:
        """Of a reading of each mode of a law, of those taken with their own uncertainty: (n_modes,) array."""
        station = self.laws[setup].station
        own = ReadingErrors.of(station.setup).own_variance.copy()
        if not station.is_new:  # readings that were taken come first
            stated = ReadingErrors.of(station.base).own_variance
            own[: stated.size] = stated
        return np.asarray(self.noise[setup] ** 2 + own)

    def another_day(self, setup: int) -> tuple[Floats, Floats]:
        """What the first reading of each mode tells of one on another day, and the variance that is left.

        Of what a reading is off by the board's discrepancy is found again.

        Returns
        -------
        told : (n_modes,) array
            Share of what the first is off by that the other is expected to be off by.
        variance : (n_modes,) array
            Of the other reading given the first.
        """
        first = self.variance(setup)
        common = shared_share(self.laws[setup].station.base) * self.noise[setup] ** 2
        return common / first, first - common**2 / first

    @property
    def precision(self) -> tuple[Floats, Floats, Floats]:
        """What its readings and its own priors say: blocks of own, own with shared, shared."""
        n_own, n = self.moduli.shape[1], self.board.symmetry.n
        own = np.diag(np.r_[np.zeros(n), np.ones(n_own - n)])
        across, shared = np.zeros((n_own, self.shared[0].shape[1])), np.zeros((self.shared[0].shape[1],) * 2)
        for i in range(len(self.laws)):
            read = self.was_read(i)
            a, s, w = self.own[i][read], self.shared[i][read], 1.0 / self.variance(i)[read, None]
            own, across, shared = own + a.T @ (w * a), across + a.T @ (w * s), shared + s.T @ (w * s)
        return own, across, shared

    @property
    def of_shared(self) -> Floats:
        """What it says of the shared parameters once its own are integrated out: (n_shared, n_shared) precision."""
        own, across, shared = self.precision
        return np.asarray(shared - across.T @ np.linalg.solve(own, across))


def board_in_joint(
    board: Board, prior: PriorCard, shared: Sequence[Shared], values: Values | None = None
) -> BoardInJoint:
    """Solve a board once at its least-squares estimate, or at given values, and take the slopes there.

    Parameters
    ----------
    board : Board
        The shared effects declared.
    prior : PriorCard
    shared : sequence of Shared
    values : dict of float, optional
        Of a board that was not measured.
    """
    estimate = None if values is not None else weighted_least_squares(board)
    at = values if estimate is None else estimate.values
    assert at is not None
    noise = np.array([setup.noise.median for setup in board.setups])
    if estimate is not None:
        noise = noise * noise_widenings(board, estimate.residuals)
    laws = tuple(bare_law(board, one, at) for one in stations(board, at, prior, is_elsewhere=False))
    parameters = Parameters(board)
    names, turned = _columns(board, prior, shared, at, noise)
    n_own = len(names)
    theta = parameters.theta(at, noise)
    to_moduli = moduli_at(board, theta[: parameters.n_constants], parameters.fitted_columns.size)[1] @ turned
    slopes = [law.slopes @ turned for law in laws]
    return BoardInJoint(
        board=board,
        values=at,
        laws=laws,
        own=tuple(one[:, :n_own] for one in slopes),
        shared=tuple(one[:, n_own:] for one in slopes),
        moduli=to_moduli[:, :n_own],
        names=names,
        noise=noise,
    )


def held_elsewhere(one: BoardInJoint, prior: PriorCard, shared: Sequence[Shared]) -> BoardInJoint:
    """The same board with the modes that it has where it is held as it never was: a solution for each way."""
    ways = new_stations(one.board, one.values, prior)
    laws = tuple(bare_law(one.board, way, one.values) for way in ways)
    turned = _columns(one.board, prior, shared, one.values, one.noise)[1]
    n_own = len(one.names)
    slopes = [law.slopes @ turned for law in laws]
    return replace(
        one,
        laws=(*one.laws, *laws),
        own=(*one.own, *(each[:, :n_own] for each in slopes)),
        shared=(*one.shared, *(each[:, n_own:] for each in slopes)),
        noise=np.r_[one.noise, [way.setup.noise.median for way in ways]],
    )


def _columns(
    board: Board, prior: PriorCard, shared: Sequence[Shared], values: Values, noise: Floats
) -> tuple[tuple[str, ...], Floats]:
    """Names of what is a board's own, and what each of them and of the shared parameters does: see `_turned`.

    Where a shared number scatters, how far the board is off it, in what is expected of boards, is one of its own.
    """
    given = GivenShared(Posterior(board, prior, (), "exact", False), tuple(shared))
    parameters = Parameters(board)
    free = np.array([i for i in given.own_columns if i in parameters.fitted_columns], dtype=np.intp)
    turned = _turned(given, parameters.theta(values, noise), free, len(shared))
    own, of_shared = turned[:, : free.size], turned[:, free.size :]
    width = expected_width(shared)
    apart = np.flatnonzero(width)
    names = (*(parameters.names[i] for i in free), *(f"{shared[int(i)].name} apart" for i in apart))
    return names, np.column_stack([own, of_shared[:, apart] * width[apart], of_shared])


def _turned(given: GivenShared, theta: Floats, free: NDArray[np.intp], n_shared: int) -> Floats:
    """Change of the fitted columns with each own and each shared parameter: (n_fitted, n_own + n_shared) array."""
    own, z = theta[given.own_columns], given.z_of(theta[None, :])[0]
    places = [int(np.flatnonzero(given.own_columns == i)[0]) for i in free]
    n = free.size + n_shared
    owns, zs = np.tile(own, (2 * n, 1)), np.tile(z, (2 * n, 1))
    for j in range(n):
        rows, place = (owns, places[j]) if j < free.size else (zs, j - free.size)
        rows[2 * j, place] += _STEP
        rows[2 * j + 1, place] -= _STEP
    both = given.theta(owns, zs)[:, Parameters(given.posterior.board).fitted_columns]
    return np.asarray(((both[::2] - both[1::2]) / (2.0 * _STEP)).T)


@dataclass(frozen=True, eq=False)
class Joint:
    """All boards of a campaign together: u holds each board's own columns in turn, then the shared ones.

    Attributes
    ----------
    boards : tuple of BoardInJoint
    n_shared : int
    """

    boards: tuple[BoardInJoint, ...]
    n_shared: int

    @cached_property
    def starts(self) -> tuple[int, ...]:
        """Where each board's columns begin; the shared ones last."""
        sizes = [one.moduli.shape[1] for one in self.boards]
        return tuple(int(one) for one in np.cumsum([0, *sizes]))

    @cached_property
    def covariance(self) -> Floats:
        """Of u: (n_u, n_u) array."""
        first = self.starts[-1]
        precision = np.zeros((first + self.n_shared,) * 2)
        precision[first:, first:] = np.eye(self.n_shared)
        for start, one in zip(self.starts, self.boards, strict=False):
            own, across, shared = one.precision
            rows = slice(start, start + len(own))
            precision[rows, rows] += own
            precision[rows, first:] += across
            precision[first:, rows] += across.T
            precision[first:, first:] += shared
        return np.asarray(np.linalg.inv(precision))

    @property
    def wanted(self) -> Floats:
        """Rows that take u to the shared parameters, then to ln of the three moduli of each board in turn."""
        first = self.starts[-1]
        rows = [np.eye(first + self.n_shared)[first:]]
        for start, one in zip(self.starts, self.boards, strict=False):
            own = np.zeros((3, first + self.n_shared))
            own[:, start : start + one.moduli.shape[1]] = one.moduli
            rows.append(own)
        return np.concatenate(rows)

    def rows(self, board: int, own: Floats, shared: Floats) -> Floats:
        """Readings of one board as rows of u: (n, n_u) array."""
        made = np.zeros((len(own), self.starts[-1] + self.n_shared))
        made[:, self.starts[board] : self.starts[board] + own.shape[1]] = own
        made[:, self.starts[-1] :] = shared
        return made

    def of_shared(self, precision: Floats) -> Floats:
        """What another board says of the shared parameters, as rows of u with noise one: (n_shared, n_u) array."""
        values, directions = np.linalg.eigh(precision)
        made = np.zeros((self.n_shared, self.starts[-1] + self.n_shared))
        made[:, self.starts[-1] :] = (directions * np.sqrt(np.maximum(values, 0.0))).T
        return made

    def ratios(self, rows: Floats, variance: Floats) -> tuple[Floats, Floats, float]:
        """What readings leave: of the sd of each shared parameter, and of each modulus, the mean over the boards.

        Parameters
        ----------
        rows : (n, n_u) array
        variance : (n,) array

        Returns
        -------
        shared : (n_shared,) array
        moduli : (3,) array
            Geometric means.
        information : float
            Half the log determinant of what the shared parameters gain, or the moduli where nothing is shared, nats.
        """
        wanted = self.wanted
        before = wanted @ self.covariance @ wanted.T
        across = wanted @ self.covariance @ rows.T
        inner = rows @ self.covariance @ rows.T + np.diag(variance)
        after = before - across @ np.linalg.solve(inner, across.T)
        left = np.sqrt(np.diagonal(after) / np.diagonal(before))
        # The moduli of an isotropic board follow from its first one.
        free = [self.n_shared + 3 * i + j for i, one in enumerate(self.boards) for j in range(one.board.symmetry.n)]
        part = np.ix_(*2 * [list(range(self.n_shared)) or free])
        information = 0.5 * (np.linalg.slogdet(before[part])[1] - np.linalg.slogdet(after[part])[1])
        moduli = np.exp(np.log(left[self.n_shared :]).reshape(-1, 3).mean(axis=0))
        return left[: self.n_shared], moduli, float(information)
