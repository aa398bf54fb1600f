"""Proposals of measurements, each with its expected gain and its cost."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

from bayesplate.board.prior import PriorCard
from bayesplate.campaign.shared import SharedParameter
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.campaign import further_boards
from bayesplate.planning.gains import N_DRAWS, PlannedReadings, expected_gain, join_readings
from bayesplate.planning.laws import known_mass
from bayesplate.planning.modes_read import StationReadings, station_readings
from bayesplate.planning.plan import Gain, ProposalEntry, SequenceEntry
from bayesplate.planning.sizes_read import (
    INSPECTIONS,
    SizeMeasurement,
    input_readings,
    inspection_readings,
    parameter_column,
    size_measurements,
)
from bayesplate.streams import random_stream

BELIEFS_STREAM = "what is believed now"
"""The random stream of the terms that stand for the beliefs."""
FAINT_GAIN = 2e-3
"""Least gain, nats, of a listed proposal."""
BEST_MODES = (1, 3)
"""Numbers of further modes of a board that are proposed together."""
FIRST_MODES = (3, 6)
"""Numbers of modes of a board without readings that are proposed together."""
_N_MODE_DRAWS, _N_SEQUENCE_DRAWS = 128, 192
"""Simulated draws by which modes, and sequences, are compared."""
_LONGEST_SEQUENCE = 3
"""Most proposals in a sequence."""
_SESSION_ENDS = ("edges", "again")
"""Proposals that take the board out of its setup, which ends the session there."""


@dataclass(frozen=True)
class Costs:
    """The cost of each class of work, minutes."""

    reading: float = 1.0  # one frequency of a board in its place, or one reading of a size
    clamping: float = 10.0  # another way to hold the board, or the same one again
    board: float = 30.0  # another board, its readings not counted

    @classmethod
    def names(cls) -> tuple[str, ...]:
        return tuple(field.name for field in fields(cls))


@dataclass(frozen=True, eq=False)
class Proposal:
    """A measurement that could be made next."""

    entry: ProposalEntry
    readings: PlannedReadings
    about: str  # the setup, the input, the effect or the board that it asks for
    known_board: KnownBoard | None = None  # the board; None for a further one
    station_readings: StationReadings | None = None  # all readings of its station; None where no frequency is read
    rows: tuple[int, ...] = ()  # indices of the station's modes that are read
    spot: int = 0  # index of the spot of the station where a known mass stands


@dataclass(frozen=True, eq=False)
class Planner:
    """Beliefs, goal and costs, from which proposals are ranked."""

    beliefs: Beliefs
    seed: int  # everything random follows from it; all gains are compared on the same simulated readings
    goal: str | None = None  # see `bayesplate.planning.gains.expected_gain`
    costs: Costs = Costs()

    def gain(self, readings: PlannedReadings, minutes: float = 1.0, n_draws: int = N_DRAWS) -> Gain:
        rng = random_stream(self.seed, "gains of further readings")
        return expected_gain(self.beliefs, readings, rng, self.goal, minutes, n_draws)

    def rank_proposals(
        self, priors: Sequence[PriorCard] = (), shared: Sequence[SharedParameter] = (), least_gain: float = FAINT_GAIN
    ) -> tuple[Proposal, ...]:
        """All proposals that gain more than `least_gain` (nats), the best first.

        The priors are one per board, where more boards could be measured; `shared` are the parameters that these share.
        """
        proposals = [
            proposal
            for board in self.beliefs.boards
            for proposal in (*self._mode_proposals(board), *self._size_proposals(board))
        ]
        proposals += self._inspection_proposals()
        for board in further_boards(self.beliefs, priors, shared):
            minutes = self.costs.board + len(board.labels) * self.costs.reading
            setup, sentence = board.template.setups[0].name, board.sentence
            proposals.append(
                self._proposal("board", "", setup, sentence, minutes, board.readings, sentence, board.labels)
            )
        worthwhile = [proposal for proposal in proposals if proposal.entry.gain.score > least_gain]
        return tuple(sorted(worthwhile, key=lambda proposal: -proposal.entry.gain.score))

    def _proposal(
        self, what: str, board: str, setup: str, sentence: str, minutes: float, readings: PlannedReadings, about: str,
        modes: tuple[str, ...] = (),
    ) -> Proposal:  # fmt: skip
        entry = ProposalEntry(what, board, setup, sentence, minutes, modes, self.gain(readings, minutes))
        return Proposal(entry, readings, about)

    def _mode_proposals(self, known_board: KnownBoard) -> Iterator[Proposal]:
        """Proposals of frequencies: further modes, repeats, repeats with a known mass, and new stations."""
        rng = random_stream(self.seed, "noise of a further session")
        for law in known_board.laws:
            if law.station.takes_readings(known_board.board):
                yield from self._station_proposals(known_board, station_readings(self.beliefs, known_board, law, rng))

    def _station_proposals(self, known_board: KnownBoard, available: StationReadings) -> Iterator[Proposal]:
        station, costs, name = available.law.station, self.costs, known_board.board.name
        is_alone = len(self.beliefs.boards) == 1
        where = f" in setup {station.base.name}" if len(known_board.board.setups) > 1 else ""
        of_board, board_words = ("", "the same board") if is_alone else (f" of board {name}", f"board {name}")
        about = f"{name}, held as in {station.setup.name}"

        def mode_words(rows: Sequence[int]) -> str:
            return f"mode{'s' * (len(rows) > 1)} {', '.join(str(station.setup.labels[i]) for i in rows)}"

        def make_proposal(
            what: str, sentence: str, minutes: float, readings: PlannedReadings, rows: tuple[int, ...], spot: int = 0
        ) -> Proposal:
            labels, minutes = tuple(str(station.setup.labels[i]) for i in rows), minutes + len(rows) * costs.reading
            proposal = self._proposal(what, name, station.setup.name, sentence, minutes, readings, about, labels)
            return replace(proposal, known_board=known_board, station_readings=available, rows=rows, spot=spot)

        for chosen in self._best_modes(available):
            rows, readings = tuple(available.rows[i] for i in chosen), available.further.select(chosen)
            if station.is_new:
                yield make_proposal(
                    "edges",
                    f"Measure {board_words} {station.mounting_words}, {mode_words(rows)}",
                    costs.clamping,
                    readings,
                    rows,
                )
            elif station.n_old and not self.beliefs.is_prior:
                yield make_proposal(
                    "modes", f"Measure {mode_words(rows)}{of_board} as well{where}", 0.0, readings, rows
                )
            else:
                sentence = f"Measure {mode_words(rows)}{of_board} in setup {station.base.name}"
                yield make_proposal("modes", sentence, costs.clamping, readings, rows)
        old = available.repeatable_rows
        if available.repeats is not None:
            modes = mode_words(old) if is_alone else f"all {len(old)} modes{of_board}"
            sentence = f"Measure {modes}{where} again on another day, the board taken out and put back"
            yield make_proposal("again", sentence, costs.clamping, available.repeats, old)
        if available.with_mass:
            spot = max(available.with_mass, key=lambda spot: self.gain(available.with_mass[spot]).score)
            (x, y), grams = station.places(known_board.board)[spot], 1e3 * known_mass(known_board.board)
            place_words = f"at x = {1e3 * x:.0f}, y = {1e3 * y:.0f} mm"
            sentence = (
                f"Stick a known mass of {grams:g} g on the board {place_words} and measure "
                f"{mode_words(old)}{where} again"
            )
            yield make_proposal("mass", sentence, costs.reading, available.with_mass[spot], old, spot)

    def _best_modes(self, available: StationReadings) -> list[tuple[int, ...]]:
        """Sets of the best modes, chosen one by one: each is the best beside those chosen before it."""
        n, sizes = (
            available.further.n,
            FIRST_MODES if self.beliefs.is_prior or not available.law.station.n_old else BEST_MODES,
        )
        if available.law.station.is_new and not self.beliefs.is_prior:
            return [tuple(range(n))] if n else []
        best_modes: list[int] = []
        for _ in range(min(max(sizes), n)):
            remaining = [i for i in range(n) if i not in best_modes]
            scores = {
                i: self.gain(available.further.select([*best_modes, i]), n_draws=_N_MODE_DRAWS).score for i in remaining
            }
            best_modes.append(max(remaining, key=lambda i: scores[i]))
        listed_sizes = sizes if len(self.beliefs.boards) == 1 else sizes[1:]
        return list(dict.fromkeys(tuple(sorted(best_modes[:size])) for size in listed_sizes)) if best_modes else []

    def _size_proposals(self, known_board: KnownBoard) -> Iterator[Proposal]:
        """Proposals of readings of the sizes of a board; a size that all boards share is read once, on the first."""
        name, n = known_board.board.name, len(self.beliefs.shared)
        measurements: dict[tuple[str, bool], list[SizeMeasurement]] = {}  # all items on a board are weighed at once
        for measurement in size_measurements(known_board.board):
            column = parameter_column(known_board, measurement.parameter)
            is_shared = n > 0 and not column[:-n].any()
            if not is_shared or known_board is self.beliefs.boards[0]:
                measurements.setdefault((measurement.sentence, is_shared), []).append(measurement)
        for (instruction, is_shared), alike in measurements.items():
            of_board = "" if is_shared or len(self.beliefs.boards) == 1 else f", board {name}"
            sentence = instruction.replace("to the board", "to every board") if is_shared else instruction + of_board
            about = f"{name}: {', '.join(measurement.parameter.name for measurement in alike)}"
            minutes = sum(measurement.n for measurement in alike) * self.costs.reading
            readings = join_readings([input_readings(self.beliefs, known_board, each) for each in alike])
            board_name = "" if is_shared else name
            yield self._proposal("size", board_name, "", sentence, minutes, readings, about)

    def _inspection_proposals(self) -> Iterator[Proposal]:
        """Proposals to inspect an effect without reading a frequency."""
        for effect, inspection in INSPECTIONS.items():
            readings, name = inspection_readings(self.beliefs, effect), self.beliefs.boards[0].board.name
            if readings is not None:
                minutes = inspection.n * self.costs.reading
                yield self._proposal("size", name, "", inspection.sentence, minutes, readings, effect)

    def sequences(self, proposals: Sequence[Proposal]) -> tuple[tuple[tuple[Proposal, ...], SequenceEntry], ...]:
        """The best two and the best three together, chosen one by one: each is the best beside those chosen before it.

        They stand in the order in which they can be done: proposals that go on in a session come before the board is
        taken out. Two that read modes in one station, or the same size, are not put together.
        """
        steps_so_far, sequences = list(proposals[:1]), []
        while steps_so_far and len(steps_so_far) < _LONGEST_SEQUENCE:
            remaining = [
                candidate for candidate in proposals if candidate.about not in {other.about for other in steps_so_far}
            ]
            if not remaining:
                break
            minutes = [sum(step.entry.cost_minutes for step in (*steps_so_far, candidate)) for candidate in remaining]
            gains = [
                self.gain(
                    join_readings([step.readings for step in (*steps_so_far, candidate)]), cost, _N_SEQUENCE_DRAWS
                )
                for candidate, cost in zip(remaining, minutes, strict=True)
            ]
            best = max(range(len(remaining)), key=lambda i: gains[i].score)
            steps_so_far.append(remaining[best])
            steps = tuple(sorted(steps_so_far, key=lambda step: step.entry.what in _SESSION_ENDS))
            sentences = tuple(step.entry.sentence for step in steps)
            sequences.append((steps, SequenceEntry(sentences, minutes[best], gains[best])))
        return tuple(sequences)
