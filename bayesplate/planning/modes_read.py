"""Modes as readings: what each explanation expects of those that could be read, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.sessions import shared_share, unknown_discrepancies
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import Belief, Beliefs, FormTerms, KnownBoard, levels
from bayesplate.planning.gains import Readings
from bayesplate.planning.laws import BareLaw, SolvedStation
from bayesplate.planning.stations import Station

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


def station_readings(beliefs: Beliefs, known: KnownBoard, law: BareLaw, rng: np.random.Generator) -> StationReadings:
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
    every = []
    for k, (each, part) in enumerate(zip(kept, shares, strict=True)):
        share = part[:, None]
        common = share * each[:, None]
        told = common / (each[:, None] + own)
        shift = (1.0 - told) * readings.shift[k] + told * first
        variance = new + (1.0 - share) * (readings.variance[k] - new) + common * (1.0 - told)
        every.append((shift, (1.0 - told)[:, :, None] * readings.slopes[k], variance))
    return Readings.of(every)


def _expected(one: Belief, known: KnownBoard, law: BareLaw) -> tuple[Floats, Floats]:
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


_QUANTILES = (0.03, 0.97)
"""Of a size over the terms, at which it is solved besides its mean."""
_TOO_FAR = 0.4
"""A shift of ln f beyond which a mode has lost its name."""


def add_effects(one: Belief, known: KnownBoard, law: BareLaw, shift: Floats, slopes: Floats) -> None:
    """Add what the effects of an explanation do to what is expected of the modes of a station, in place.

    To the shift where u is zero, (n_terms, (1 + n_spots) n_modes), of the modes, then of what a known mass at each spot
    adds to each, and to the slopes, (.., n_u). Not a number where a mode cannot be followed in the middle of a size, or
    to neither side of it.

    By a few full solves about the likely sizes, the constants where the readings then have them, and a parabola along
    each size between: what remains beside the constants' own linear law is small and smooth. Each term is linear about
    its own place on it.
    """
    n = len(law.middle)
    for form in one.forms:
        mean = one.mean[form.rows]
        sizes, own = mean[:, form.columns], one.covariance[form.rows][:, form.columns, form.columns]
        centre, narrow = sizes.mean(axis=0), np.sqrt(own.mean(axis=0))
        low, high = np.quantile(sizes, _QUANTILES, axis=0)
        ends = np.stack([np.minimum(low, centre - narrow), np.maximum(high, centre + narrow)])
        bounds = np.array([one.prior.standard_bounds for one in form.parameters]).reshape(-1, 2).T
        away = np.clip(ends, *bounds) - centre
        # the constants follow the size
        design = np.column_stack([np.ones(len(mean)), sizes - centre])
        constants = np.linalg.lstsq(design, mean[:, : known.board.symmetry.n], rcond=None)[0]

        to_either_side = (np.outer(two, unit) for two, unit in zip(away.T, np.eye(centre.size), strict=True))
        steps = np.concatenate([[0.0 * centre], *to_either_side])
        followed = np.column_stack([np.ones(len(steps)), steps]) @ constants
        pairs = zip(centre + steps, followed, strict=True)
        solved = np.stack([_beside(known, law, form, at, moved) for at, moved in pairs])
        shift[form.rows] += solved[0]
        for j, column in enumerate(form.columns):
            two, pair = away[:, j], solved[1 + 2 * j : 3 + 2 * j] - solved[0]
            across = (
                pair[::-1] * (two / two[::-1])[:, None]
            )  # a straight line where a mode is followed to one side only
            pair[:, :n] = np.where(np.isnan(pair), across, pair)[:, :n]
            linear, square = np.linalg.solve(np.column_stack([two, two**2]), pair)
            place = np.clip(sizes[:, j] - centre[j], *two)[:, None]
            along = linear + 2.0 * square * place
            shift[form.rows] += linear * place + square * place**2 - along * sizes[:, j, None]
            slopes[form.rows, :, column] += along


def _beside(known: KnownBoard, law: BareLaw, form: FormTerms, sizes: Floats, constants: Floats) -> Floats:
    """What a form does at some sizes, less what the linear law of the constants says: ((1 + n_spots) n_modes,) array.

    On the mesh for the estimate's constants, so that all sizes of a form have the same matrices.
    """
    exact = {name: np.asarray(q.mean) for name, q in form.board.inputs.items() if q.is_exact}
    named = {one.name: np.asarray(one.prior.value(z)) for one, z in zip(form.parameters, sizes, strict=True)}
    values, symmetry = {**exact, **known.values, **named}, known.board.symmetry
    at = np.log(symmetry.free_of(known.values))
    there, meshed = (
        {**values, **symmetry.rigidities(np.exp(each), values["poisson_xy"])} for each in (at + constants, at)
    )
    shift = SolvedStation.of(law.station, form.board, there, meshed).bare_and_added - law.solved
    shift[0] -= law.slopes[0, :, : at.size] @ constants
    shift[:, np.abs(shift[0]) > _TOO_FAR] = np.nan
    return np.asarray(shift.ravel())
