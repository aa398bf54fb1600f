"""Modes as readings: what each explanation expects of those that could be read, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.sessions import shared_share, unknown_discrepancies
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import Beliefs, Explanation, KnownBoard, levels
from bayesplate.planning.gains import Readings
from bayesplate.planning.laws import BareLaw
from bayesplate.planning.shifts import add_effects
from bayesplate.planning.stations import Station

Floats = NDArray[np.float64]

REPEATED = 2e-4
"""Relative scatter of a frequency that is read once more in one session: what five hits on a free board leave open."""


@dataclass(frozen=True, eq=False)
class StationReadings:
    """Everything that could be read in a station."""

    law: BareLaw
    # modes that were not read yet, in the session that goes on, or in a new one where the board is held anew
    further: Readings
    rows: tuple[int, ...]  # which of the station's modes they are
    # which of the readings at hand can be taken once more: every explanation knows what is read then
    old: tuple[int, ...]
    # these in another session; None where there are none, or where what is believed leaves them aside
    again: Readings | None
    # the same with a known mass, in the session that goes on, by the index of its spot; none where there is one
    # explanation only, for a known mass tells by what it adds alone
    with_mass: Mapping[int, Readings]


def station_readings(
    beliefs: Beliefs,
    known: KnownBoard,
    law: BareLaw,
    rng: np.random.Generator,
) -> StationReadings:
    """What each explanation expects of everything that could be read in a station of a board."""
    station, board = law.station, known.board
    n, n_old = len(station.setup.readings), station.n_old
    parts = [_expected(one, known, law) for one in beliefs.explanations]
    is_followed = np.all([np.isfinite(shift).all(axis=0) for shift, _ in parts], axis=0)
    own = ReadingErrors.of(station.setup).own_variance + unknown_discrepancies(board, station.setup)
    place = known.first_setup + [setup.name for setup in board.setups].index(station.base.name)
    kept = [one.noise[:, place] ** 2 for one in beliefs.explanations]
    new = [levels(station.setup.noise, one.n_terms, rng) ** 2 for one in beliefs.explanations]

    def readings(rows: Sequence[int], noise: Sequence[Floats], spot: int = 0) -> Readings:
        at = [spot * n + row for row in rows]
        return Readings(
            tuple(shift[:, at] for shift, _ in parts),
            tuple(slopes[:, at] for _, slopes in parts),
            tuple(level[:, None] + own[list(rows)] for level in noise),
        )

    rows = [i for i in range(n_old, n) if is_followed[i]]
    old = [i for i in range(n_old) if is_followed[i]]
    further = readings(rows, new if station.is_new else kept)
    again, with_mass = None, {}
    if old and not beliefs.is_prior:
        other_day = [np.full(len(one), shared_share(station.base)) for one in kept]
        again = given_first(station, old, readings(old, new), kept, other_day)
    if again and len(beliefs.explanations) > 1:
        same_day = [np.maximum(1.0 - REPEATED**2 / one, 0.0) for one in kept]
        once_more = given_first(station, old, readings(old, kept), kept, same_day)
        for spot, off_place in enumerate(law.off_place[:, old]):
            added = readings(old, kept, 1 + spot)
            if all(np.isfinite(one).all() for one in added.shift):
                shift = tuple(a + b for a, b in zip(once_more.shift, added.shift, strict=True))
                variance = tuple(one + off_place**2 for one in once_more.variance)
                slopes = tuple(a + b for a, b in zip(once_more.slopes, added.slopes, strict=True))
                with_mass[spot] = Readings(shift, slopes, variance)
    return StationReadings(law, further, tuple(rows), tuple(old), again, with_mass)


def given_first(
    station: Station, old: Sequence[int], readings: Readings, kept: Sequence[Floats], shares: Sequence[Floats]
) -> Readings:
    """Readings at hand, rows `old`, taken once more given the first, with which they share part of what it is off by.

    `readings` are as if they shared nothing; `kept` is the variance of the first readings' noise and `shares` the part
    of it that is found again, (n_terms,) arrays by explanation.
    """
    rows = list(old)
    first, own = np.log(station.base.measured)[rows], ReadingErrors.of(station.base).own_variance[rows]
    new = ReadingErrors.of(station.setup).own_variance[rows]
    shift, slopes, variance = [], [], []
    for k, (each, part) in enumerate(zip(kept, shares, strict=True)):
        share = part[:, None]
        common = share * each[:, None]
        told = common / (each[:, None] + own)
        shift.append((1.0 - told) * readings.shift[k] + told * first)
        slopes.append((1.0 - told)[:, :, None] * readings.slopes[k])
        variance.append(new + (1.0 - share) * (readings.variance[k] - new) + common * (1.0 - told))
    return Readings(tuple(shift), tuple(slopes), tuple(variance))


def _expected(one: Explanation, known: KnownBoard, law: BareLaw) -> tuple[Floats, Floats]:
    """What is expected of the modes where u is zero, then of what a known mass adds; and the slopes of both.

    Arrays of (n_terms, (1 + n_spots) n_modes) and (.., n_u). Not a number where an explanation takes a reading for no
    mode, or a mode cannot be followed.
    """
    station, n = law.station, len(law.middle)
    shift = np.tile(np.concatenate([law.middle, law.solved[1:].ravel()]), (one.n_terms, 1))
    slopes = np.zeros((*shift.shape, one.mean.shape[1]))
    own = law.slopes @ known.columns
    slopes[:, :n, : own.shape[2]] = own[np.arange(one.n_terms) % len(own)]
    add_effects(one, known, law, shift, slopes)
    if one.again is None or not station.n_old:
        return shift, slopes
    taken, setups, old = np.arange(n), known.board.setups, slice(station.n_old)
    start = sum(len(setup.readings) for setup in setups[: [setup.name for setup in setups].index(station.base.name)])
    here = slice(start, start + station.n_old)
    taken[old] = np.where(one.again.taken[here] < 0, -1, one.again.taken[here] - start)
    columns = np.arange(shift.shape[1]).reshape(-1, n)[:, taken].ravel()
    shift, slopes = shift[:, columns], slopes[:, columns]
    shift[:, old], slopes[:, old] = one.again.shift[:, here], one.again.slopes[:, here]
    return np.where(np.tile(taken < 0, len(law.solved)), np.nan, shift), slopes
