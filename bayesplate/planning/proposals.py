"""Everything that could be measured next on a board, each with what it is expected to give and what it costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np

from bayesplate.board.board import Board, Values
from bayesplate.board.material import MODULI
from bayesplate.board.prior import PriorCard
from bayesplate.diagnosis.evidence.search import Found
from bayesplate.planning.before import prior_laws, prior_readings
from bayesplate.planning.beliefs import Beliefs
from bayesplate.planning.gains import Gain, Readings, expected_gain, together
from bayesplate.planning.inputs_read import input_readings, measurements
from bayesplate.planning.looks import LOOKS, look_readings
from bayesplate.planning.modes_read import StationReadings, effect_shifts, station_readings
from bayesplate.planning.shifts import nodes_of
from bayesplate.planning.station_laws import BareLaw, bare_law, known_mass
from bayesplate.planning.stations import Station, stations

EXPLANATIONS, CONSTANTS = "explanations", "constants"
GOALS = (*MODULI, CONSTANTS, EXPLANATIONS)
BEST = 3
"""Further modes that are proposed together."""
FAINT = 2e-3
"""Nats below which a proposal is not listed."""
FIRST = (3, 6)
"""Modes that are proposed together for a board that was not measured yet."""


@dataclass(frozen=True)
class Costs:
    """What each class of work costs, minutes.

    Attributes
    ----------
    reading : float
        One frequency of a board in its place, or one reading of a size.
    clamping : float
        Another way to hold the board, or the same one again.
    board : float
        Another board, its readings not counted.
    """

    reading: float = 1.0
    clamping: float = 10.0
    board: float = 30.0

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """Of the classes."""
        return tuple(one.name for one in fields(cls))


@dataclass(frozen=True, eq=False)
class Proposal:
    """One thing that could be measured next.

    Attributes
    ----------
    what : str
        "modes", "edges", "mass", "again", "size" or "board".
    setup : str
        In which it is measured; empty where no frequency is read.
    sentence : str
        What to do, as an order.
    cost : float
        Minutes.
    readings : Readings
    gain : Gain
    law : BareLaw or None
        Of the modes that are read.
    rows : tuple of int
        Which of the modes of its station.
    spot : int
        Of its station, where a known mass stands.
    about : str
        The input or the effect that is looked at; empty where frequencies are read.
    further : Readings or None
        All modes of the session that could have been chosen, and `every_row` which they are.
    """

    what: str
    setup: str
    sentence: str
    cost: float
    readings: Readings
    gain: Gain
    law: BareLaw | None = None
    rows: tuple[int, ...] = ()
    spot: int = 0
    about: str = ""
    further: Readings | None = None
    every_row: tuple[int, ...] = ()

    @property
    def ends_session(self) -> bool:
        """Whether the board leaves the place where it was measured, so that nothing goes on there."""
        return self.what in ("edges", "again")

    def excludes(self, other: Proposal) -> bool:
        """Whether another proposal reads modes of the same way to hold the board, or looks at the same thing."""
        return (self.law is not None and self.law is other.law) or (self.about != "" and self.about == other.about)


def score(gain: Gain, goal: str | None) -> float:
    """What a gain is worth, nats: of what was asked for, or of explanations and constants together.

    Parameters
    ----------
    gain : Gain
    goal : str or None
        One of `GOALS`. None: the drop of the explanations' entropy and the mean shrinkage of the three intervals, both
        logarithms.
    """
    if goal is None:
        return max(gain.explanations, 0.0) + gain.constants
    if goal == EXPLANATIONS:
        return gain.explanations
    return gain.constants if goal == CONSTANTS else gain.shrinkage(goal)


def proposals(
    beliefs: Beliefs,
    values: Values,
    costs: Costs,
    goal: str | None,
    rng: np.random.Generator,
    found: Found | None = None,
    prior: PriorCard | None = None,
    *,
    least: float = FAINT,
) -> tuple[Proposal, ...]:
    """Everything that could be measured next, the most promising first.

    Parameters
    ----------
    beliefs : Beliefs
    values : dict of float
        Rigidities and inputs about which the modes are computed, SI.
    costs : Costs
    goal : str or None
        See `score`.
    rng : numpy.random.Generator
    found : Found, optional
        The search that the explanations come from.
    prior : PriorCard, optional
    least : float
        Nats above which a proposal is listed.

    Returns
    -------
    tuple of Proposal
    """
    listed = [*_of_modes(beliefs, values, costs, goal, rng, found, prior), *_of_sizes(beliefs, costs, rng, found)]
    return _ranked(listed, goal, least)


def _ranked(listed: Sequence[Proposal], goal: str | None, least: float = FAINT) -> tuple[Proposal, ...]:
    """The most promising first; those that give no more than the least are left out."""
    kept = [one for one in listed if score(one.gain, goal) > least]
    return tuple(sorted(kept, key=lambda one: -score(one.gain, goal)))


def _of_modes(
    beliefs: Beliefs, values: Values, costs: Costs, goal: str | None, rng: np.random.Generator, found: Found | None,
    prior: PriorCard | None,
) -> list[Proposal]:  # fmt: skip
    """Frequencies: further modes, again, with a known mass, held another way."""
    effects = {name for one in beliefs.explanations for name in one.members}
    nodes = {n: nodes_of(found, n) for n in sorted(effects) if n in found.ground.candidates} if found else {}
    listed = []
    for station in filter(lambda one: one.goes_on(beliefs.board), stations(beliefs.board, values, prior)):
        law = bare_law(beliefs.board, station, values)
        shifts = effect_shifts(found, nodes, law) if found else {}
        every = station_readings(beliefs, law, rng, found, shifts)
        listed += _of_station(beliefs, law, every, costs, goal, rng)
    return listed


def prior_proposals(
    beliefs: Beliefs, prior: PriorCard, values: Values, costs: Costs, goal: str | None, rng: np.random.Generator
) -> tuple[Proposal, ...]:
    """Where to begin with a board that was not measured yet, the most promising first."""
    listed = _of_sizes(beliefs, costs, rng, None)
    for station in stations(beliefs.board, values, prior):
        laws = prior_laws(beliefs, prior, station, values, rng)
        every = prior_readings(beliefs, laws, rng)
        told = _Sentences(beliefs.board, station)
        new = tuple(range(station.n_old, every.n))
        for few in best_modes(beliefs, every.some(new), goal, rng, FIRST) if new else ():
            rows = tuple(new[i] for i in few)
            some, cost = every.some(rows), costs.clamping + len(rows) * costs.reading
            sentence, what = told.begin(rows), "edges" if station.is_new else "modes"
            gain = expected_gain(beliefs, some, rng)
            listed.append(Proposal(what, station.setup.name, sentence, cost, some, gain, laws[0], rows))
    return _ranked(listed, goal)


def _of_station(
    beliefs: Beliefs, law: BareLaw, every: StationReadings, costs: Costs, goal: str | None, rng: np.random.Generator
) -> list[Proposal]:
    """What could be measured with the board held in one way."""
    station, old = law.station, every.old
    told = _Sentences(beliefs.board, station)
    made: list[tuple[str, str, float, Readings, tuple[int, ...]]] = []
    if station.is_new and every.rows:
        made.append(("edges", told.elsewhere(every.rows), costs.clamping, every.further, every.rows))
    elif every.rows:
        for few in best_modes(beliefs, every.further, goal, rng):
            rows = tuple(every.rows[i] for i in few)
            made.append(("modes", told.further(rows), 0.0, every.further.some(few), rows))
    if every.again is not None:
        made.append(("again", told.again(old), costs.clamping, every.again, old))
    listed = [
        Proposal(
            what, station.setup.name, sentence, cost + len(rows) * costs.reading, readings,
            expected_gain(beliefs, readings, rng), law, rows, further=every.further, every_row=every.rows,
        )
        for what, sentence, cost, readings, rows in made
    ]  # fmt: skip
    gains = [expected_gain(beliefs, readings, rng) for readings in every.with_mass]
    if gains:
        best = max(range(len(gains)), key=lambda i: score(gains[i], goal))
        cost = costs.reading * (1 + len(old))
        sentence = told.with_mass(old, every.spots[best])
        readings = every.with_mass[best]
        listed.append(
            Proposal("mass", station.setup.name, sentence, cost, readings, gains[best], law, old, every.spots[best])
        )
    return listed


def best_modes(
    beliefs: Beliefs, readings: Readings, goal: str | None, rng: np.random.Generator, sizes: Sequence[int] = (1, BEST)
) -> list[tuple[int, ...]]:
    """The best modes, so many together, found one by one: each goes with those found before it."""
    found: list[int] = []
    seed = int(rng.integers(2**31))
    for _ in range(min(max(sizes), readings.n)):
        left = [i for i in range(readings.n) if i not in found]

        def worth(i: int) -> float:
            same = np.random.default_rng(seed)  # the same readings for all: only the differences count
            return score(expected_gain(beliefs, readings.some([*found, i]), same, n_draws=128), goal)

        found.append(max(left, key=worth))
    return list(dict.fromkeys(tuple(sorted(found[:size])) for size in sizes))


def _of_sizes(beliefs: Beliefs, costs: Costs, rng: np.random.Generator, found: Found | None) -> list[Proposal]:
    """Readings of the board itself, and of what is attached to it."""
    listed = []
    for one in measurements(beliefs.board):
        readings = input_readings(beliefs, one)
        gain = expected_gain(beliefs, readings, rng)
        about = one.parameter.name
        listed.append(Proposal("size", "", one.sentence, one.n * costs.reading, readings, gain, about=about))
    for effect, look in LOOKS.items() if found else ():
        seen = look_readings(beliefs, found, effect) if found and effect in found.ground.candidates else None
        if seen is not None:
            gain = expected_gain(beliefs, seen, rng)
            listed.append(Proposal("size", "", look.sentence, look.n * costs.reading, seen, gain, about=effect))
    return listed


@dataclass(frozen=True)
class _Sentences:
    """What to do in a station, each as one order."""

    board: Board
    station: Station

    def _modes(self, rows: Sequence[int]) -> str:
        labels = ", ".join(str(self.station.setup.labels[i]) for i in rows)
        return f"mode {labels}" if len(rows) == 1 else f"modes {labels}"

    @property
    def _where(self) -> str:
        return f" in setup {self.station.base.name}" if len(self.board.setups) > 1 else ""

    def further(self, rows: Sequence[int]) -> str:
        """Modes that were not read."""
        return f"Measure {self._modes(rows)} as well{self._where}"

    def again(self, rows: Sequence[int]) -> str:
        """Those that were, another day."""
        return f"Measure {self._modes(rows)}{self._where} again on another day, the board taken out and put back"

    def with_mass(self, rows: Sequence[int], spot: int) -> str:
        """Those that were, with a known mass."""
        (x, y), grams = self.station.places(self.board)[spot], 1e3 * known_mass(self.board)
        at = f"at x = {1e3 * x:.0f}, y = {1e3 * y:.0f} mm"
        return f"Stick a known mass of {grams:g} g on the board {at} and measure {self._modes(rows)}{self._where} again"

    def begin(self, rows: Sequence[int]) -> str:
        """The first modes of a board."""
        if self.station.is_new:
            return self.elsewhere(rows)
        return f"Measure {self._modes(rows)} in setup {self.station.base.name}"

    def elsewhere(self, rows: Sequence[int]) -> str:
        """The board held another way."""
        return f"Measure the same board {self.station.held}, {self._modes(rows)}"


def sequences(
    beliefs: Beliefs, listed: Sequence[Proposal], goal: str | None, rng: np.random.Generator, longest: int = 3
) -> tuple[tuple[tuple[Proposal, ...], Gain], ...]:
    """The best two and the best three together, found one by one: each goes with those found before it.

    They stand in the order in which they can be done: what goes on in a session before the board is taken out.

    Parameters
    ----------
    beliefs : Beliefs
    listed : sequence of Proposal
        The best first.
    goal : str or None
    rng : numpy.random.Generator
    longest : int

    Returns
    -------
    tuple of (tuple of Proposal, Gain)
        The pair, then the three; fewer where there is nothing to add.
    """
    seed = int(rng.integers(2**31))
    chosen = list(listed[:1])
    result = []
    while chosen and len(chosen) < longest:
        left = [one for one in listed if not any(one.excludes(other) for other in chosen)]
        if not left:
            break
        gains: Mapping[int, Gain] = {
            i: expected_gain(
                beliefs, together([each.readings for each in (*chosen, one)]), np.random.default_rng(seed), n_draws=192
            )
            for i, one in enumerate(left)
        }
        best = max(gains, key=lambda i: score(gains[i], goal))
        chosen.append(left[best])
        result.append((tuple(sorted(chosen, key=lambda one: one.ends_session)), gains[best]))
    return tuple(result)
