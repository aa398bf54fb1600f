"""Further modes as readings: what each explanation expects of them, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.quantity import Quantity
from bayesplate.board.sessions import shared_share, unknown_discrepancies
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.planning.beliefs import Beliefs, Explanation
from bayesplate.planning.gains import Readings
from bayesplate.planning.looks import members_of
from bayesplate.planning.shifts import EffectShift, Nodes, form_shift
from bayesplate.planning.station_laws import BareLaw
from bayesplate.planning.stations import Station

Floats = NDArray[np.float64]
Effects = Mapping[str, EffectShift]

REPEATED = 2e-4
"""Relative scatter of a frequency that is read once more in one session: what five hits on a free board leave open."""


def effect_shifts(found: Found, nodes: Mapping[str, tuple[Nodes, ...]], law: BareLaw) -> dict[str, EffectShift]:
    """What every effect that survives does to the modes of a station.

    Parameters
    ----------
    found : Found
    nodes : dict of tuple of Nodes
        By effect, from `nodes_of`.
    law : BareLaw
    """
    candidates = found.ground.candidates
    return {
        name: EffectShift({one.index: form_shift(found, candidates[name], one, law) for one in forms})
        for name, forms in nodes.items()
    }


@dataclass(frozen=True, eq=False)
class StationReadings:
    """Everything that could be read in a station.

    Attributes
    ----------
    further : Readings
        Modes that were not read yet, in the session that goes on, or in a new one where the board is held anew.
    rows : tuple of int
        Which of the station's modes they are.
    old : tuple of int
        Which of the readings at hand can be taken once more: every explanation knows what is read then.
    again : Readings or None
        These in another session; None where there are none.
    with_mass : tuple of Readings
        The same with a known mass at each spot, in the session that goes on.
    spots : tuple of int
        Which of the station's spots these are.
    """

    further: Readings
    rows: tuple[int, ...]
    old: tuple[int, ...]
    again: Readings | None
    with_mass: tuple[Readings, ...]
    spots: tuple[int, ...]


def station_readings(
    beliefs: Beliefs, law: BareLaw, rng: np.random.Generator, found: Found | None = None, effects: Effects | None = None
) -> StationReadings:
    """What each explanation expects of everything that could be read in a station.

    Parameters
    ----------
    beliefs : Beliefs
    law : BareLaw
    rng : numpy.random.Generator
        Deals the levels of a new session's noise to the terms.
    found : Found, optional
        The search that the beliefs come from.
    effects : dict of EffectShift, optional
        What its effects do here.
    """
    station = law.station
    n, n_old = len(station.setup.readings), station.n_old
    parts = [
        _as_read(one, law, found, *_of_explanation(one, law, found, effects or {})) for one in beliefs.explanations
    ]
    shift = tuple(one[0] for one in parts)
    slopes = tuple(one[1] for one in parts)
    is_followed = np.all([np.isfinite(one).all(axis=0) for one in shift], axis=0)
    own = ReadingErrors.of(station.setup).own_variance + unknown_discrepancies(beliefs.board, station.setup)
    kept = [] if station.is_new else [_kept(beliefs, one, station) ** 2 for one in beliefs.explanations]
    new = [levels(station.setup.noise, one.n_terms, rng) ** 2 for one in beliefs.explanations]

    def readings(rows: Sequence[int], noise: Sequence[Floats], spot: int = 0) -> Readings:
        at = [spot * n + row for row in rows]
        return Readings(
            tuple(one[:, at] for one in shift),
            tuple(one[:, list(rows)] for one in slopes),
            tuple(level[:, None] + own[list(rows)] for level in noise),
        )

    rows = [i for i in range(n_old, n) if is_followed[i]]
    old = [i for i in range(n_old) if is_followed[i]]

    def once_more(noise: Sequence[Floats], shares: Sequence[Floats]) -> Readings:
        return _given_first(beliefs, station, old, readings(old, noise), kept, shares)

    of_board = shared_share(beliefs.board.setup(station.base.name))
    other_day = [np.full(len(one), of_board) for one in kept]
    same_day = [np.maximum(1.0 - REPEATED**2 / one, 0.0) for one in kept]
    spots = range(1, 1 + len(station.spots)) if old else ()
    whole = [spot for spot in spots if is_followed[[spot * n + i for i in old]].all()]
    return StationReadings(
        readings(rows, kept or new),
        tuple(rows),
        tuple(old),
        once_more(new, other_day) if old else None,
        tuple(
            _with_mass(once_more(kept, same_day), readings(old, kept, spot), law.off_place[spot - 1, old])
            for spot in whole
        ),
        tuple(spot - 1 for spot in whole),
    )


def _given_first(
    beliefs: Beliefs, station: Station, old: Sequence[int], readings: Readings, kept: Sequence[Floats],
    shares: Sequence[Floats],
) -> Readings:  # fmt: skip
    """Readings at hand taken once more, given the first reading, with which they share a part of what it is off by.

    Parameters
    ----------
    beliefs : Beliefs
    station : Station
    old : sequence of int
        Which of the station's readings.
    readings : Readings
        As if they shared nothing.
    kept : sequence of (n_terms,) array
        Variance of the noise of the first readings, by explanation.
    shares : sequence of (n_terms,) array
        The part of it that is found again.
    """
    setup = beliefs.board.setup(station.base.name)
    rows = list(old)
    first, own = np.log(setup.measured)[rows], ReadingErrors.of(setup).own_variance[rows]
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


def _with_mass(readings: Readings, added: Readings, off_place: Floats) -> Readings:
    """Readings with what a known mass adds to them, somewhat uncertain for it may stand a little off its place."""
    return replace(
        readings,
        shift=tuple(a + b for a, b in zip(readings.shift, added.shift, strict=True)),
        variance=tuple(variance + off_place**2 for variance in readings.variance),
    )


def _kept(beliefs: Beliefs, one: Explanation, station: Station) -> Floats:
    """Relative noise of the session that goes on, in each term: (n_terms,) array."""
    return one.noise[:, [setup.name for setup in beliefs.board.setups].index(station.base.name)]


def levels(prior: Quantity, n: int, rng: np.random.Generator) -> Floats:
    """Values of a prior at equally probable levels, in random order: (n,) array."""
    from scipy.special import ndtri

    return np.asarray(prior.value(rng.permutation(ndtri((np.arange(n) + 0.5) / n))))


def _of_explanation(one: Explanation, law: BareLaw, found: Found | None, effects: Effects) -> tuple[Floats, Floats]:
    """What is expected of the modes where u is zero, then of what a known mass adds; and the slopes of the modes.

    Returns
    -------
    shift : (n_terms, (1 + n_spots) n_modes) array
    slopes : (n_terms, n_modes, n_u) array
    """
    n = len(law.station.setup.readings)
    base = np.concatenate([law.middle, law.solved[1:].ravel()])
    shift = np.tile(base, (one.n_terms, 1))
    slopes = np.zeros((one.n_terms, n, one.mean.shape[1]))
    slopes[:, :, : law.slopes.shape[1]] = law.slopes
    if found is None or not one.members or found.ground.hypotheses[one.hypothesis].swap is not None:
        return shift, slopes
    table = found.ground.hypotheses[one.hypothesis].table
    by_constants = law.slopes[:, : table.moved.shape[1]]
    first = one.mean.shape[1] - table.slopes.shape[2]
    shift[:, :n] += table.moved[one.cells] @ by_constants.T
    slopes[:, :, first:] += by_constants @ table.moved_slopes[one.cells]
    for name, own_table, cells, columns in members_of(found, one):
        beside, along = effects[name].beside(own_table, cells)
        shift += beside
        slopes[:, :, first + columns.start : first + columns.stop] += along[:, :n, : columns.stop - columns.start]
    _put_known(one, law, found, shift, slopes)
    return shift, slopes


def _put_known(one: Explanation, law: BareLaw, found: Found, shift: Floats, slopes: Floats) -> None:
    """Put what the search's own table says of the modes that were read in place of what was solved here.

    Where labels are open a reading need not be the same mode under all explanations: there it stays.
    """
    baseline, station = found.ground.baseline, law.station
    if not station.n_old or baseline.every.is_open:
        return
    setup = [each.name for each in baseline.board.setups].index(station.base.name)
    rows = np.flatnonzero(baseline.setup_index == setup)
    table = found.ground.hypotheses[one.hypothesis].table
    first = one.mean.shape[1] - table.slopes.shape[2]
    shift[:, : rows.size] = law.middle[: rows.size] + table.shift[one.cells][:, rows]
    slopes[:, : rows.size, first:] = table.slopes[one.cells][:, rows]


def _as_read(
    one: Explanation, law: BareLaw, found: Found | None, shift: Floats, slopes: Floats
) -> tuple[Floats, Floats]:
    """The same arrays with the readings at hand as the modes that an explanation takes them for.

    Whoever measures again finds the same peaks, whatever they are called. Not a number where it takes a reading for no
    mode, or for one that was not read: what is found there then, it does not say.
    """
    taken = np.arange(len(law.station.setup.readings))
    if found is None or not law.station.n_old:
        return shift, slopes
    taken[: law.station.n_old] = _modes_taken(one, law.station, found)
    n_blocks = shift.shape[1] // taken.size
    columns = np.concatenate([block * taken.size + taken for block in range(n_blocks)])
    read = shift[:, columns]
    read[:, np.tile(taken < 0, n_blocks)] = np.nan
    return read, slopes[:, taken]


def _modes_taken(one: Explanation, station: Station, found: Found) -> NDArray[np.intp]:
    """Which of a station's modes an explanation takes each reading at hand for: (n_old,) array, -1 for another one."""
    baseline, hypothesis = found.ground.baseline, found.ground.hypotheses[one.hypothesis]
    setup = [each.name for each in baseline.board.setups].index(station.base.name)
    here = np.flatnonzero(baseline.setup_index == setup)
    own = baseline.rows.copy() if hypothesis.own is None else hypothesis.own.rows
    if hypothesis.swap is not None:
        pair = [hypothesis.swap.first, hypothesis.swap.second]
        own[pair] = own[pair[::-1]]
    same = (own[here, None] == baseline.rows[here]) & (own[here, None] >= 0)
    return np.asarray(np.where(same.any(axis=1), same.argmax(axis=1), -1))


def bands(beliefs: Beliefs, readings: Readings, rng: np.random.Generator, within: tuple[float, ...]) -> Floats:
    """Where each reading will lie, over all explanations: (n, n_within) array in the unit of the readings.

    Parameters
    ----------
    beliefs : Beliefs
    readings : Readings
    rng : numpy.random.Generator
    within : tuple of float
        Probabilities.
    """
    drawn, weights = [], []
    for k, one in enumerate(beliefs.explanations):
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", readings.slopes[k], one.mean)
        variance = np.einsum("tnu,tuv,tnv->tn", readings.slopes[k], one.covariance, readings.slopes[k])
        sd = np.sqrt(variance + readings.variance[k])
        many = expected[None] + sd * rng.standard_normal((16, *expected.shape))
        drawn.append(many.reshape(-1, readings.n))
        weights.append(np.full(len(drawn[-1]), one.probability / len(drawn[-1])))
    values, shares = np.concatenate(drawn), np.concatenate(weights)
    ends = np.empty((readings.n, len(within)))
    for i in range(readings.n):
        order = np.argsort(values[:, i])
        ends[i] = np.interp(within, np.cumsum(shares[order]), values[order, i])
    return ends
