"""The plan, and the work at the bench: the modes to look for, and the places of sensor and hammer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.prior import PriorCard
from bayesplate.campaign.shared import SharedParameter
from bayesplate.effects import Effect
from bayesplate.effects.attached_items import fractions_on, places_on
from bayesplate.estimates.sheet import NUMBERS_OF_MODES, Sheet, grid_points, sheet
from bayesplate.frequencies.prior_bands import BAND_QUANTILES
from bayesplate.frequencies.residues import NODAL_LINE
from bayesplate.planning.beliefs import Beliefs, KnownBoard
from bayesplate.planning.gains import PlannedReadings
from bayesplate.planning.laws import BareLaw, known_mass
from bayesplate.planning.plan import FORMAT, BenchEntry, ExplanationEntry, ModeToFind, Plan
from bayesplate.planning.proposals import Planner, Proposal
from bayesplate.planning.stations import N_SEARCHED_MODES, Station
from bayesplate.planning.tables import first_line

BAND = (BAND_QUANTILES[0], 0.5, BAND_QUANTILES[1])
"""Probabilities of the ends of a band and of its middle."""
_GRID_STEP = 5
"""Steps on the grid of a sheet between the places that are tried for sensor and hammer."""
_MOST_BENCHES = 2
_N_LEVELS = 401
"""Equally probable readings that stand for each term."""


@dataclass(frozen=True, eq=False)
class Bench:
    """The work at the bench for one way to hold the board."""

    entry: BenchEntry
    sheet: Sheet  # of the modes to look for only
    placing: Placing


def make_benches(beliefs: Beliefs, steps: Sequence[Proposal]) -> tuple[Bench, ...]:
    """The bench of each way to hold a board that proposals ask for, two at most."""
    basis = "over all explanations that survive" if len(beliefs.explanations) > 1 else "by what is known now"
    benches: list[Bench] = []
    for step in steps:
        if (
            step.known_board is not None
            and step.station_readings is not None
            and step.entry.what != "again"
            and len(benches) < _MOST_BENCHES
        ):
            benches.append(
                make_bench(
                    step.known_board,
                    step.station_readings.law,
                    step.rows,
                    reading_bands(beliefs, step.readings),
                    basis,
                    step.spot if step.entry.what == "mass" else None,
                )
            )
    return tuple(benches)


def reading_bands(beliefs: Beliefs, readings: PlannedReadings) -> Floats:
    """Quantiles of each reading at the probabilities of `BAND`, over all explanations: (n, 3) array."""
    from scipy.special import ndtri

    levels = ndtri((np.arange(_N_LEVELS) + 0.5) / _N_LEVELS)[:, None, None]
    frequencies, weights = [], []
    for k, explanation in enumerate(beliefs.explanations):
        slopes = readings.slopes[k]
        variance = np.einsum("tnu,tuv,tnv->tn", slopes, explanation.covariance, slopes) + readings.variance[k]
        expected = readings.shift[k] + np.einsum("tnu,tu->tn", slopes, explanation.mean)
        frequencies.append((expected + np.sqrt(variance) * levels).reshape(-1, readings.n))
        weights.append(np.full(len(frequencies[-1]), explanation.probability / len(frequencies[-1])))
    values, shares = np.concatenate(frequencies), np.concatenate(weights)
    ends = np.empty((readings.n, len(BAND)))
    for i, order in enumerate(np.argsort(values, axis=0).T):
        ends[i] = np.interp(BAND, np.cumsum(shares[order]) - 0.5 * shares[order], values[order, i])
    return ends


def make_bench(
    known_board: KnownBoard, law: BareLaw, rows: Sequence[int], ends: Floats, basis: str, spot: int | None = None
) -> Bench:
    """The bench for some modes of a board; `ends` are ln of their frequencies (Hz) at the probabilities of `BAND`.

    With a known mass at a spot of the station, if one is given.

    The sensor stays where it is on the board; where the board was never held so, only if it sees every mode there.
    """
    board, station = known_board.board, law.station
    system = station.system(board)
    numbers = (*NUMBERS_OF_MODES, N_SEARCHED_MODES)
    added_mass = ""
    if spot is not None:
        x, y = station.places(board)[spot]
        added_mass = f"{1e3 * known_mass(board):g} g at x = {1e3 * x:.0f}, y = {1e3 * y:.0f} mm"
    where = f"where they are expected{f', with {added_mass}' if added_mass else ''}"
    full_sheet = sheet(board, system, station.values(system, known_board.values), where, numbers=numbers)
    by_name = {mode.name: mode for mode in full_sheet.modes}
    names = [str(station.setup.labels[i]) for i in rows]
    mode_ends = [(by_name[name], end) for name, end in zip(names, np.exp(ends), strict=True) if name in by_name]
    sheet_modes = tuple(
        replace(mode, hertz=float(end[1]), measured_hz=None, band_hz=(float(end[0]), float(end[2])))
        for mode, end in sorted(mode_ends, key=lambda pair: float(pair[1][1]))
    )
    shapes = np.stack([mode.shape[::_GRID_STEP, ::_GRID_STEP] for mode in sheet_modes])
    grid = grid_points()[::_GRID_STEP]
    mass_place = None if spot is None else station.spots[spot]
    placing = choose_places(shapes, grid, _sensor_place(board, station, full_sheet, system.shaped), mass_place)
    if station.is_new and min(placing.seen) < NODAL_LINE:
        placing = choose_places(shapes, grid)
    spots = (full_sheet.drawn_at(*place) for place in (placing.sensor, placing.hammer, *placing.taps))
    board_spots = spots if system.shaped is None else (system.shaped.from_plate(*place) for place in spots)
    places = places_on(board, station.setup, tuple(board_spots))
    sensor_mm, hammer_mm, *taps = ((round(1e3 * x), round(1e3 * y)) for x, y in places)
    modes = tuple(
        ModeToFind(mode.name, mode.hertz, *(mode.band_hz or (0.0, 0.0)), residue)
        for mode, residue in zip(sheet_modes, placing.seen, strict=True)
    )
    edges = dict(station.setup.edges)
    entry = BenchEntry(board.name, station.setup.name, edges, sensor_mm, hammer_mm, tuple(taps), modes, added_mass)
    return Bench(entry, replace(full_sheet, modes=sheet_modes, combined=(), likely=basis), placing)


def _sensor_place(
    board: Board, station: Station, full_sheet: Sheet, shaped: Effect | None
) -> tuple[float, float] | None:
    """Place of the only sensor, as fractions of the vibrating sides; None without one or with several."""
    if station.base.sensor is None:
        return None
    ((x, y),) = fractions_on(board, station.setup, (station.base.sensor,))
    if shaped is not None:
        x, y = shaped.to_plate(x, y)
    low, high = full_sheet.drawn_at(x, 0.0)[1], full_sheet.drawn_at(x, 1.0)[1]
    return x, (y - low) / (high - low)


BenchPlace = tuple[float, float]  # fractions of the vibrating sides

REFERENCES = (
    "D. J. Ewins: Modal Testing: Theory, Practice and Application. 2nd ed., Research Studies Press (2000). "
    "[the residue at the driving point, by which places are chosen]",
    "K. Manohar, B. W. Brunton, J. N. Kutz, S. L. Brunton: Data-driven sparse sensor placement for reconstruction. "
    "IEEE Control Syst. Mag. 38, 63-86 (2018), doi:10.1109/MCS.2018.2810460. [places by pivoted QR]",
)
_LEAST_DISTANCE = 0.25
"""Least distance between sensor and hammer, as a fraction of a side."""
_MASS_DISTANCE = 0.1
"""Distance from a known mass within which nothing else is placed, as a fraction of a side."""
_MARGIN = 0.03
"""Fraction of a side at the rim without sensor and hammer: nobody hits an edge."""


@dataclass(frozen=True)
class Placing:
    """Places of sensor and hammer, as fractions of the vibrating sides."""

    sensor: BenchPlace
    hammer: BenchPlace
    # residue of each mode between the two, over the largest that its figure could give: 0 on a nodal line
    seen: tuple[float, ...]
    # places to tap that distinguish the figures, as many as there are modes: the first pivots of a QR decomposition
    taps: tuple[BenchPlace, ...]


def choose_places(
    shapes: Floats, grid: Floats, sensor: BenchPlace | None = None, mass: BenchPlace | None = None
) -> Placing:
    """Sensor and hammer for modes with these deflections, (n_modes, n, n), on a grid of fractions of a side, x first.

    The sensor stays at a given place, or stands where the smallest residue at the driving point is largest. The hammer
    strikes where the smallest residue between the two is largest, of the modes that the sensor can see. Neither stands
    on a known mass.
    """
    from scipy.interpolate import RegularGridInterpolator
    from scipy.linalg import qr

    inner = (grid >= _MARGIN) & (grid <= 1.0 - _MARGIN)
    coordinates = grid[inner]
    relative = shapes / np.abs(shapes).max(axis=(1, 2))[:, None, None]
    flat = relative[:, inner][:, :, inner].reshape(len(shapes), -1)
    places = [(float(x), float(y)) for x in coordinates for y in coordinates]
    if mass is not None:
        flat = np.where([max(abs(x - mass[0]), abs(y - mass[1])) < _MASS_DISTANCE for x, y in places], 0.0, flat)
    if sensor is None:
        sensor_index = int(np.argmax((flat**2).min(axis=0)))
        sensor, at_sensor = places[sensor_index], flat[:, sensor_index]
    else:
        at_sensor = RegularGridInterpolator((grid, grid), np.moveaxis(relative, 0, -1), method="cubic")(sensor)
    is_apart = np.array([max(abs(x - sensor[0]), abs(y - sensor[1])) >= _LEAST_DISTANCE for x, y in places])
    residues = np.abs(flat * at_sensor[:, None])
    can_be_seen = np.abs(at_sensor) >= NODAL_LINE
    weakest = residues[can_be_seen if can_be_seen.any() else slice(None)].min(axis=0)
    hammer_index = int(np.argmax(np.where(is_apart, weakest, -1.0)))
    taps = tuple(places[i] for i in qr(flat, mode="economic", pivoting=True)[2][: len(shapes)])
    seen = tuple(float(residue) for residue in residues[:, hammer_index])
    return Placing(sensor, places[hammer_index], seen, taps)


def draw_up_plan(
    planner: Planner,
    name: str,
    title: str,
    card_sha256: str,
    priors: Sequence[PriorCard] = (),
    shared: Sequence[SharedParameter] = (),
) -> tuple[Plan, tuple[Bench, ...]]:
    """The plan as plan.json holds it, and the benches."""
    beliefs, proposals = planner.beliefs, planner.rank_proposals(priors, shared)
    sequences = planner.sequences(proposals)
    benches = make_benches(beliefs, sequences[-1][0] if sequences else proposals[:1])
    plan = Plan(
        format=FORMAT,
        name=name,
        title=title,
        seed=planner.seed,
        card_sha256=card_sha256,
        basis=beliefs.basis,
        goal=planner.goal,
        costs=asdict(planner.costs),
        explanations=_explanation_entries(beliefs),
        entropy=beliefs.entropy,
        first=plan_first_line(planner, proposals),
        proposals=tuple(proposal.entry for proposal in proposals),
        sequences=tuple(entry for _, entry in sequences),
        bench=tuple(bench.entry for bench in benches),
        notes=beliefs.notes,
    )
    return plan, benches


def plan_first_line(planner: Planner, proposals: Sequence[Proposal]) -> str:
    """The first line of a plan: what to do next; empty where nothing would help."""
    beliefs = planner.beliefs
    if beliefs.wrong_reading is not None:
        return beliefs.wrong_reading
    return first_line(
        [proposal.entry for proposal in proposals], _explanation_entries(beliefs), beliefs.entropy, planner.goal
    )


def _explanation_entries(beliefs: Beliefs) -> tuple[ExplanationEntry, ...]:
    return tuple(
        ExplanationEntry(explanation.members, explanation.words, explanation.probability)
        for explanation in beliefs.explanations
    )
