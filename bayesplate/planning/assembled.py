"""From proposals to a plan: entries, sequences, the first line, and the modes to look for at the bench."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.effects import Effect
from bayesplate.effects.attached_items import fractions_on, places_on
from bayesplate.estimates.sheet import NUMBERS_OF_MODES, Sheet, points, sheet
from bayesplate.frequencies.prior_bands import WITHIN
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.gains import Gain
from bayesplate.planning.modes_read import bands
from bayesplate.planning.places import Placing, placing
from bayesplate.planning.plan import (
    BenchEntry,
    ExplanationEntry,
    GainEntry,
    ModeToFind,
    ProposalEntry,
    SequenceEntry,
)
from bayesplate.planning.proposals import Proposal, score
from bayesplate.planning.station_laws import BareLaw
from bayesplate.planning.stations import SEARCHED, Station

Floats = NDArray[np.float64]

_EVERY = 5
"""Of the grid of a sheet: so far apart places for sensor and hammer are tried."""
MOST_BENCHES = 2
BAND = (WITHIN[0], 0.5, WITHIN[1])
"""Probabilities of the ends of a band and of its middle."""
KNOWN_NOW = "by what is known now"
NOTHING: Mapping[str, float] = {}


def gain_entry(
    gain: Gain, cost: float, goal: str | None, beliefs: Beliefs, shared: Mapping[str, float] = NOTHING,
    worth: float | None = None,
) -> GainEntry:  # fmt: skip
    """A gain as it is written."""
    value = score(gain, goal) if worth is None else worth
    in_doubt = len(beliefs.explanations) > 1
    return GainEntry(
        E_x=gain.E_x,
        E_y=gain.E_y,
        G_xy=gain.G_xy,
        constants=gain.constants,
        constants_error=gain.constants_error,
        explanations=gain.explanations if in_doubt else None,
        explanations_error=gain.explanations_error if in_doubt else None,
        information=gain.information,
        shared=dict(shared),
        score=value,
        score_per_minute=value / cost,
    )


def proposal_entry(one: Proposal, goal: str | None, beliefs: Beliefs) -> ProposalEntry:
    """A proposal as it is written."""
    labels = () if one.law is None else tuple(str(one.law.station.setup.labels[i]) for i in one.rows)
    entry = gain_entry(one.gain, one.cost, goal, beliefs)
    return ProposalEntry(one.what, beliefs.board.name, one.setup, one.sentence, one.cost, labels, entry)


def sequence_entry(steps: Sequence[Proposal], gain: Gain, goal: str | None, beliefs: Beliefs) -> SequenceEntry:
    """Proposals together as they are written."""
    cost = sum(one.cost for one in steps)
    return SequenceEntry(tuple(one.sentence for one in steps), cost, gain_entry(gain, cost, goal, beliefs))


def explanation_entries(beliefs: Beliefs) -> tuple[ExplanationEntry, ...]:
    """The explanations as they are written."""
    return tuple(ExplanationEntry(one.members, one.words, one.probability) for one in beliefs.explanations)


@dataclass(frozen=True, eq=False)
class Bench:
    """What to do at the bench for one way to hold the board.

    Attributes
    ----------
    entry : BenchEntry
    sheet : Sheet
        Of the modes to look for alone.
    placing : Placing
    """

    entry: BenchEntry
    sheet: Sheet
    placing: Placing


def benches(beliefs: Beliefs, steps: Sequence[Proposal], values: Values, rng: np.random.Generator) -> tuple[Bench, ...]:
    """For each way to hold the board that proposals ask for, the modes to look for."""
    likely = "over all explanations that survive" if len(beliefs.explanations) > 1 else KNOWN_NOW
    made: list[Bench] = []
    for one in steps:
        if one.law is not None and one.what != "again" and len(made) < MOST_BENCHES:
            ends = bands(beliefs, one.readings, rng, BAND)
            goes_on = one.what in ("modes", "mass")
            made.append(bench_of(beliefs.board, one.law, one.rows, ends, values, likely, goes_on=goes_on))
    return tuple(made)


def bench_of(
    board: Board, law: BareLaw, rows: Sequence[int], ends: Floats, values: Values, likely: str, *, goes_on: bool
) -> Bench:
    """The sheet for some modes of a board.

    Parameters
    ----------
    board : Board
    law : BareLaw
    rows : sequence of int
        Which of its modes.
    ends : (n_rows, 3) array
        ln of the frequencies (Hz) at the probabilities of `BAND`.
    values : dict of float
        Rigidities and inputs about which the shapes are computed.
    likely : str
        By what the bands are judged.
    goes_on : bool
        Whether it is the session that was begun, so that the sensor stands where it stood.
    """
    station = law.station
    system = station.system(board)
    numbers = (*NUMBERS_OF_MODES, SEARCHED)
    drawn = sheet(board, system, station.values(system, values), "where they are expected", numbers=numbers)
    by_name = {mode.name: mode for mode in drawn.modes}
    wanted = [str(station.setup.labels[i]) for i in rows]
    there = [(by_name[name], end) for name, end in zip(wanted, np.exp(ends), strict=True) if name in by_name]
    shown = tuple(
        replace(mode, hertz=float(end[1]), measured_hz=None, band_hz=(float(end[0]), float(end[2])))
        for mode, end in sorted(there, key=lambda pair: pair[1][1])
    )
    grid = points()[::_EVERY]
    shapes = np.stack([mode.shape[::_EVERY, ::_EVERY] for mode in shown])
    placed = placing(shapes, grid, _sensor(board, station, drawn, system.shaped) if goes_on else None)
    kept = replace(drawn, modes=shown, combined=(), likely=likely)
    seen_at = (drawn.drawn_at(*place) for place in (placed.sensor, placed.hammer, *placed.taps))
    stated = seen_at if system.shaped is None else (system.shaped.as_stated(*place) for place in seen_at)
    marks = places_on(board, station.setup, tuple(stated))
    sensor, hammer, *taps = ((round(1e3 * x), round(1e3 * y)) for x, y in marks)
    modes = tuple(
        ModeToFind(mode.name, mode.hertz, *(mode.band_hz or (0.0, 0.0)), seen)
        for mode, seen in zip(shown, placed.seen, strict=True)
    )
    entry = BenchEntry(board.name, station.setup.name, dict(station.setup.edges), sensor, hammer, tuple(taps), modes)
    return Bench(entry, kept, placed)


def _sensor(board: Board, station: Station, drawn: Sheet, shaped: Effect | None) -> tuple[float, float] | None:
    """Where the one sensor stands, as fractions of what vibrates; None where there is none, or there are several."""
    if station.base.sensor is None:
        return None
    ((x, y),) = fractions_on(board, station.setup, (station.base.sensor,))
    if shaped is not None:
        x, y = shaped.placed(x, y)
    low, high = drawn.drawn_at(x, 0.0)[1], drawn.drawn_at(x, 1.0)[1]
    return x, (y - low) / (high - low)
