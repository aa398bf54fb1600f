"""Everything that could be measured next, each with what it is expected to give and what it costs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

from bayesplate.board.prior import PriorCard
from bayesplate.campaign.shared import Shared
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.gains import N_DRAWS, Readings, expected_gain, together
from bayesplate.planning.laws import known_mass
from bayesplate.planning.modes_read import StationReadings, station_readings
from bayesplate.planning.plan import Gain, ProposalEntry, SequenceEntry
from bayesplate.planning.sizes_read import LOOKS, column_of, input_readings, look_readings, measurements
from bayesplate.planning.together import further_boards
from bayesplate.streams import stream

BELIEFS = "what is believed now"
"""The random stream of the terms that stand for it."""
FAINT = 2e-3
"""Nats below which a proposal is not listed."""
BEST = (1, 3)
"""Further modes of a board that are proposed together."""
FIRST = (3, 6)
"""The same of a board that was not measured yet."""
_TRIED, _JOINED = 128, 192
"""Simulated readings by which modes, and sequences, are compared."""
_LONGEST = 3
"""Proposals in a sequence."""
_ENDING = ("edges", "again")
"""What takes the board from the place where it was measured, so that nothing goes on there."""


@dataclass(frozen=True)
class Costs:
    """What each class of work costs, minutes."""

    reading: float = 1.0  # one frequency of a board in its place, or one reading of a size
    clamping: float = 10.0  # another way to hold the board, or the same one again
    board: float = 30.0  # another board, its readings not counted

    @classmethod
    def names(cls) -> tuple[str, ...]:
        return tuple(one.name for one in fields(cls))


@dataclass(frozen=True, eq=False)
class Proposal:
    """One thing that could be measured next."""

    entry: ProposalEntry
    readings: Readings
    about: str  # the way to hold a board, the input, the effect or the board that it asks for
    known: KnownBoard | None = None  # the board; None where it is one that is not there yet
    read: StationReadings | None = None  # everything that could be read in its station; None where no frequency is read
    rows: tuple[int, ...] = ()  # which of the station's modes are read
    spot: int = 0  # of its station, where a known mass stands


@dataclass(frozen=True, eq=False)
class Planner:
    """What is believed, what is asked for, and what things cost."""

    beliefs: Beliefs
    seed: int  # everything random follows from it; all gains are compared on the same simulated readings
    goal: str | None = None  # see `bayesplate.planning.gains.expected_gain`
    costs: Costs = Costs()

    def gain(self, readings: Readings, minutes: float = 1.0, n_draws: int = N_DRAWS) -> Gain:
        rng = stream(self.seed, "gains of further readings")
        return expected_gain(self.beliefs, readings, rng, self.goal, minutes, n_draws)

    def ranked(
        self, priors: Sequence[PriorCard] = (), shared: Sequence[Shared] = (), least: float = FAINT
    ) -> tuple[Proposal, ...]:
        """Everything that could be measured next and gives more than the least (nats), the most promising first.

        The priors are one per board, where more boards could be measured, `shared` is what these have in common.
        """
        listed = [one for known in self.beliefs.boards for one in (*self._of_modes(known), *self._of_sizes(known))]
        listed += self._of_looks()
        for one in further_boards(self.beliefs, priors, shared):
            minutes = self.costs.board + len(one.labels) * self.costs.reading
            setup, told = one.like.setups[0].name, one.sentence
            listed.append(self._proposal("board", "", setup, told, minutes, one.readings, told, one.labels))
        kept = [one for one in listed if one.entry.gain.score > least]
        return tuple(sorted(kept, key=lambda one: -one.entry.gain.score))

    def _proposal(
        self, what: str, board: str, setup: str, sentence: str, minutes: float, readings: Readings, about: str,
        modes: tuple[str, ...] = (),
    ) -> Proposal:  # fmt: skip
        entry = ProposalEntry(what, board, setup, sentence, minutes, modes, self.gain(readings, minutes))
        return Proposal(entry, readings, about)

    def _of_modes(self, known: KnownBoard) -> Iterator[Proposal]:
        """Frequencies: further modes, the same again, the same with a known mass, and the board held another way."""
        rng = stream(self.seed, "noise of a further session")
        for law in known.laws:
            if law.station.goes_on(known.board):
                yield from self._of_station(known, station_readings(self.beliefs, known, law, rng))

    def _of_station(self, known: KnownBoard, read: StationReadings) -> Iterator[Proposal]:
        station, costs, name = read.law.station, self.costs, known.board.name
        is_alone = len(self.beliefs.boards) == 1
        where = f" in setup {station.base.name}" if len(known.board.setups) > 1 else ""
        of, its = ("", "the same board") if is_alone else (f" of board {name}", f"board {name}")
        about = f"{name}, held as in {station.setup.name}"

        def words(rows: Sequence[int]) -> str:
            return f"mode{'s' * (len(rows) > 1)} {', '.join(str(station.setup.labels[i]) for i in rows)}"

        def made(
            what: str, told: str, minutes: float, readings: Readings, rows: tuple[int, ...], spot: int = 0
        ) -> Proposal:
            labels, minutes = tuple(str(station.setup.labels[i]) for i in rows), minutes + len(rows) * costs.reading
            one = self._proposal(what, name, station.setup.name, told, minutes, readings, about, labels)
            return replace(one, known=known, read=read, rows=rows, spot=spot)

        for some in self._best_modes(read):
            rows, readings = tuple(read.rows[i] for i in some), read.further.some(some)
            if station.is_new:
                yield made("edges", f"Measure {its} {station.held}, {words(rows)}", costs.clamping, readings, rows)
            elif station.n_old and not self.beliefs.is_prior:
                yield made("modes", f"Measure {words(rows)}{of} as well{where}", 0.0, readings, rows)
            else:
                told = f"Measure {words(rows)}{of} in setup {station.base.name}"
                yield made("modes", told, costs.clamping, readings, rows)
        old = read.old
        if read.again is not None:
            these = words(old) if is_alone else f"all {len(old)} modes{of}"
            told = f"Measure {these}{where} again on another day, the board taken out and put back"
            yield made("again", told, costs.clamping, read.again, old)
        if read.with_mass:
            spot = max(read.with_mass, key=lambda spot: self.gain(read.with_mass[spot]).score)
            (x, y), grams = station.places(known.board)[spot], 1e3 * known_mass(known.board)
            at = f"at x = {1e3 * x:.0f}, y = {1e3 * y:.0f} mm"
            told = f"Stick a known mass of {grams:g} g on the board {at} and measure {words(old)}{where} again"
            yield made("mass", told, costs.reading, read.with_mass[spot], old, spot)

    def _best_modes(self, read: StationReadings) -> list[tuple[int, ...]]:
        """The best modes, so many together, found one by one: each goes with those found before it."""
        n, sizes = read.further.n, FIRST if self.beliefs.is_prior or not read.law.station.n_old else BEST
        if read.law.station.is_new and not self.beliefs.is_prior:
            return [tuple(range(n))] if n else []
        chosen: list[int] = []
        for _ in range(min(max(sizes), n)):
            left = [i for i in range(n) if i not in chosen]
            some = {i: self.gain(read.further.some([*chosen, i]), n_draws=_TRIED).score for i in left}
            chosen.append(max(left, key=lambda i: some[i]))
        told = sizes if len(self.beliefs.boards) == 1 else sizes[1:]
        return list(dict.fromkeys(tuple(sorted(chosen[:size])) for size in told)) if chosen else []

    def _of_sizes(self, known: KnownBoard) -> Iterator[Proposal]:
        """Readings of a board itself; what all boards share alike is read once, on the first."""
        name, n = known.board.name, len(self.beliefs.shared)
        for one in measurements(known.board):
            along = column_of(known, one.parameter)
            is_shared = n > 0 and not along[:-n].any()
            if is_shared and known is not self.beliefs.boards[0]:
                continue
            of = "" if is_shared or len(self.beliefs.boards) == 1 else f", board {name}"
            told = one.sentence.replace("to the board", "to every board") if is_shared else one.sentence + of
            about, minutes = f"{name}: {one.parameter.name}", one.n * self.costs.reading
            readings, its = input_readings(self.beliefs, known, one), "" if is_shared else name
            yield self._proposal("size", its, "", told, minutes, readings, about)

    def _of_looks(self) -> Iterator[Proposal]:
        """Proposals to look at an effect without reading a frequency."""
        for effect, look in LOOKS.items():
            readings, name = look_readings(self.beliefs, effect), self.beliefs.boards[0].board.name
            if readings is not None:
                minutes = look.n * self.costs.reading
                yield self._proposal("size", name, "", look.sentence, minutes, readings, effect)

    def sequences(self, listed: Sequence[Proposal]) -> tuple[tuple[tuple[Proposal, ...], SequenceEntry], ...]:
        """The best two and the best three together, found one by one: each goes with those found before it.

        They stand in the order in which they can be done: what goes on in a session before the board is taken out. Two
        that read modes of one way to hold a board, or the same size, are not put together.
        """
        chosen, made = list(listed[:1]), []
        while chosen and len(chosen) < _LONGEST:
            left = [one for one in listed if one.about not in {other.about for other in chosen}]
            if not left:
                break
            minutes = [sum(each.entry.cost_minutes for each in (*chosen, one)) for one in left]
            gains = [
                self.gain(together([each.readings for each in (*chosen, one)]), cost, _JOINED)
                for one, cost in zip(left, minutes, strict=True)
            ]
            best = max(range(len(left)), key=lambda i: gains[i].score)
            chosen.append(left[best])
            steps = tuple(sorted(chosen, key=lambda one: one.entry.what in _ENDING))
            told = tuple(one.entry.sentence for one in steps)
            made.append((steps, SequenceEntry(told, minutes[best], gains[best])))
        return tuple(made)
