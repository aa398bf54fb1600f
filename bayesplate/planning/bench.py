"""A plan, drawn up; and what to do at the bench: the modes to look for, and where sensor and hammer go."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.campaign.shared import Shared
from bayesplate.effects import Effect
from bayesplate.effects.attached_items import fractions_on, places_on
from bayesplate.estimates.sheet import NUMBERS_OF_MODES, Sheet, points, sheet
from bayesplate.frequencies.prior_bands import WITHIN
from bayesplate.frequencies.residues import NODAL_LINE
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.gains import Readings
from bayesplate.planning.laws import BareLaw
from bayesplate.planning.plan import FORMAT, BenchEntry, ExplanationEntry, ModeToFind, Plan
from bayesplate.planning.proposals import Planner, Proposal
from bayesplate.planning.stations import SEARCHED, Station
from bayesplate.planning.tables import first_line

BAND = (WITHIN[0], 0.5, WITHIN[1])
"""Probabilities of the ends of a band and of its middle."""
_EVERY = 5
"""Of the grid of a sheet: so far apart places for sensor and hammer are tried."""
_MOST = 2
_LEVELS = 401
"""Equally probable readings that stand for each term."""


@dataclass(frozen=True, eq=False)
class Bench:
    """What to do at the bench for one way to hold the board."""

    entry: BenchEntry
    sheet: Sheet  # of the modes to look for alone
    placing: Placing


def benches(beliefs: Beliefs, steps: Sequence[Proposal]) -> tuple[Bench, ...]:
    """For each way to hold a board that proposals ask for, two at most, the modes to look for."""
    likely = "over all explanations that survive" if len(beliefs.explanations) > 1 else "by what is known now"
    made: list[Bench] = []
    for one in steps:
        if one.known is not None and one.read is not None and one.entry.what != "again" and len(made) < _MOST:
            made.append(bench_of(one.known, one.read.law, one.rows, bands(beliefs, one.readings), likely))
    return tuple(made)


def bands(beliefs: Beliefs, readings: Readings) -> Floats:
    """Where each reading will lie, over all explanations, at the probabilities of `BAND`: (n, 3) array."""
    from scipy.special import ndtri

    levels = ndtri((np.arange(_LEVELS) + 0.5) / _LEVELS)[:, None, None]
    drawn, weights = [], []
    for k, one in enumerate(beliefs.explanations):
        slopes = readings.slopes[k]
        variance = np.einsum("tnu,tuv,tnv->tn", slopes, one.covariance, slopes) + readings.variance[k]
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", slopes, one.mean)
        drawn.append((expected + np.sqrt(variance) * levels).reshape(-1, readings.n))
        weights.append(np.full(len(drawn[-1]), one.probability / len(drawn[-1])))
    values, shares = np.concatenate(drawn), np.concatenate(weights)
    ends = np.empty((readings.n, len(BAND)))
    for i, order in enumerate(np.argsort(values, axis=0).T):
        ends[i] = np.interp(BAND, np.cumsum(shares[order]) - 0.5 * shares[order], values[order, i])
    return ends


def bench_of(known: KnownBoard, law: BareLaw, rows: Sequence[int], ends: Floats, likely: str) -> Bench:
    """The sheet for some modes of a board, `ends` being ln of their frequencies (Hz) at the probabilities of `BAND`.

    The sensor stands where it stood in a session that goes on.
    """
    board, station = known.board, law.station
    system = station.system(board)
    numbers = (*NUMBERS_OF_MODES, SEARCHED)
    drawn = sheet(board, system, station.values(system, known.values), "where they are expected", numbers=numbers)
    by_name = {mode.name: mode for mode in drawn.modes}
    wanted = [str(station.setup.labels[i]) for i in rows]
    there = [(by_name[name], end) for name, end in zip(wanted, np.exp(ends), strict=True) if name in by_name]
    shown = tuple(
        replace(mode, hertz=float(end[1]), measured_hz=None, band_hz=(float(end[0]), float(end[2])))
        for mode, end in sorted(there, key=lambda pair: float(pair[1][1]))
    )
    shapes = np.stack([mode.shape[::_EVERY, ::_EVERY] for mode in shown])
    sensor = None if station.is_new else _sensor(board, station, drawn, system.shaped)
    placed = placing(shapes, points()[::_EVERY], sensor)
    seen_at = (drawn.drawn_at(*place) for place in (placed.sensor, placed.hammer, *placed.taps))
    stated = seen_at if system.shaped is None else (system.shaped.as_stated(*place) for place in seen_at)
    marks = places_on(board, station.setup, tuple(stated))
    at_sensor, at_hammer, *taps = ((round(1e3 * x), round(1e3 * y)) for x, y in marks)
    modes = tuple(
        ModeToFind(mode.name, mode.hertz, *(mode.band_hz or (0.0, 0.0)), seen)
        for mode, seen in zip(shown, placed.seen, strict=True)
    )
    edges = dict(station.setup.edges)
    entry = BenchEntry(board.name, station.setup.name, edges, at_sensor, at_hammer, tuple(taps), modes)
    return Bench(entry, replace(drawn, modes=shown, combined=(), likely=likely), placed)


def _sensor(board: Board, station: Station, drawn: Sheet, shaped: Effect | None) -> tuple[float, float] | None:
    """Where the one sensor stands, as fractions of what vibrates; None where there is none, or there are several."""
    if station.base.sensor is None:
        return None
    ((x, y),) = fractions_on(board, station.setup, (station.base.sensor,))
    if shaped is not None:
        x, y = shaped.placed(x, y)
    low, high = drawn.drawn_at(x, 0.0)[1], drawn.drawn_at(x, 1.0)[1]
    return x, (y - low) / (high - low)


Place = tuple[float, float]

REFERENCES = (
    "D. J. Ewins: Modal Testing: Theory, Practice and Application. 2nd ed., Research Studies Press (2000). "
    "[the residue at the driving point, by which places are chosen]",
    "K. Manohar, B. W. Brunton, J. N. Kutz, S. L. Brunton: Data-driven sparse sensor placement for reconstruction. "
    "IEEE Control Syst. Mag. 38, 63-86 (2018), doi:10.1109/MCS.2018.2810460. [places by pivoted QR]",
)
_APART = 0.25
"""Least distance between sensor and hammer, as a fraction of a side."""
_MARGIN = 0.03
"""Of the sides that is left free at the rim: nobody hits an edge."""


@dataclass(frozen=True)
class Placing:
    """Where to put sensor and hammer on what vibrates, as fractions of its sides."""

    sensor: Place
    hammer: Place
    # residue of each mode between the two, over the largest that its figure could give: 0 on a nodal line
    seen: tuple[float, ...]
    # where to tap to tell the figures apart, as many as there are modes: the first pivots of a QR decomposition
    taps: tuple[Place, ...]


def placing(shapes: Floats, grid: Floats, sensor: Place | None = None) -> Placing:
    """Sensor and hammer for modes with these deflections, (n_modes, n, n), on a grid of fractions of a side, x first.

    The sensor stands where it does, or where the smallest residue at the driving point is largest, the hammer where the
    smallest residue between the two is, of the modes that the sensor can see.
    """
    from scipy.linalg import qr

    inner = (grid >= _MARGIN) & (grid <= 1.0 - _MARGIN)
    at = grid[inner]
    kept = shapes[:, inner][:, :, inner]
    relative = kept / np.abs(shapes).max(axis=(1, 2))[:, None, None]
    flat = relative.reshape(len(shapes), -1)
    places = [(float(x), float(y)) for x in at for y in at]
    if sensor is None:
        first = int(np.argmax((flat**2).min(axis=0)))
    else:
        first = int(np.argmin([np.hypot(x - sensor[0], y - sensor[1]) for x, y in places]))
    apart = np.array([max(abs(x - places[first][0]), abs(y - places[first][1])) >= _APART for x, y in places])
    residues = np.abs(flat * flat[:, [first]])
    can_be_seen = np.abs(flat[:, first]) >= NODAL_LINE
    weakest = residues[can_be_seen if can_be_seen.any() else slice(None)].min(axis=0)
    second = int(np.argmax(np.where(apart, weakest, -1.0)))
    taps = tuple(places[i] for i in qr(flat, mode="economic", pivoting=True)[2][: len(shapes)])
    seen = tuple(float(one) for one in residues[:, second])
    return Placing(places[first], places[second], seen, taps)


def drawn_up(
    planner: Planner,
    name: str,
    title: str,
    card_sha256: str,
    priors: Sequence[PriorCard] = (),
    shared: Sequence[Shared] = (),
) -> tuple[Plan, tuple[Bench, ...]]:
    """The plan as plan.json has it, and the sheets for the bench."""
    beliefs, listed = planner.beliefs, planner.ranked(priors, shared)
    together = planner.sequences(listed)
    drawn = benches(beliefs, together[-1][0] if together else listed[:1])
    made = Plan(
        format=FORMAT,
        name=name,
        title=title,
        seed=planner.seed,
        card_sha256=card_sha256,
        basis=beliefs.basis,
        goal=planner.goal,
        costs=asdict(planner.costs),
        explanations=_entries(beliefs),
        entropy=beliefs.entropy,
        first=first_of(planner, listed),
        proposals=tuple(one.entry for one in listed),
        sequences=tuple(entry for _, entry in together),
        bench=tuple(one.entry for one in drawn),
        notes=beliefs.notes,
    )
    return made, drawn


def first_of(planner: Planner, listed: Sequence[Proposal]) -> str:
    """The first line of a plan: what to do next; empty where nothing would help."""
    beliefs = planner.beliefs
    if beliefs.wrong is not None:
        return beliefs.wrong
    return first_line([one.entry for one in listed], _entries(beliefs), beliefs.entropy, planner.goal)


def _entries(beliefs: Beliefs) -> tuple[ExplanationEntry, ...]:
    return tuple(ExplanationEntry(one.members, one.words, one.probability) for one in beliefs.explanations)
