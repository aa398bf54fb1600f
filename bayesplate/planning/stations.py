"""Ways to read further modes: the board held as it is, held another way, or with a known mass on it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.effects import effects_of
from bayesplate.effects.attached_items import board_mass, places_on
from bayesplate.effects.base import Effect
from bayesplate.estimates.refit import sensitivities
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.residues import NODAL_LINE, deflections
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import System
from bayesplate.labels import Label
from bayesplate.modes.solve import Modes
from bayesplate.plate.board import Board, Values, density, vibrating_lengths
from bayesplate.plate.measured import Reading
from bayesplate.plate.sessions import under_prior_scales
from bayesplate.plate.setup import Ends, Setup, assumed_noise
from bayesplate.posterior.parameters import N_RIGIDITIES, Parameters
from bayesplate.quantities import Quantity

Floats = NDArray[np.float64]

FURTHER = 8
"""Modes beyond those that were read from which the best are chosen."""
ELSEWHERE = 6
"""Lowest modes that are read where the board is held another way."""
SEARCHED = 24
"""Lowest modes of a way to hold the board among which those that are read are looked for."""
_SHARE = 0.02
"""Of the board's mass that a known mass has, about: it shifts a mode by up to some per cent."""
_HANDY = (0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3)
"""Masses that come in a set of weights, kg."""
PLACED = 1e-3
"""Standard deviation along each side of where a known mass stands, m: it is put on a pencil mark by hand."""
_NEAR_FREE, _NEAR_HELD = 0.94, 0.7
"""Where a known mass stands besides the middle, as fractions of a side whose end is free or held."""


@dataclass(frozen=True, eq=False)
class Station:
    """A way to hold the board, and the modes that can be read there.

    Attributes
    ----------
    setup : Setup
        Its readings: those of `base` first, then what the model expects of the modes that could be read.
    base : Setup
        The setup of the board that goes on, or from which another one takes its sensor and its air.
    n_old : int
        Readings that were taken already; 0 where the board was never held so.
    """

    setup: Setup
    base: Setup
    n_old: int = 0

    @property
    def is_new(self) -> bool:
        """Whether the board was never held so."""
        return self.setup.name != self.base.name

    @property
    def held(self) -> str:
        """How the board is held where it was never held so, in words."""
        return "with all edges free" if self.setup.is_free else "clamped along x0 alone"

    def goes_on(self, board: Board) -> bool:
        """Whether something more can be read in it: of several sessions of one setup, in the last."""
        if self.is_new or self.base.group is None:
            return True
        return self.base.name == [one.name for one in board.setups if one.group == self.base.group][-1]

    @property
    def spots(self) -> tuple[tuple[float, float], ...]:
        """Where a known mass could stand, as fractions of the vibrating sides; nowhere where nothing was read."""
        if not self.n_old:
            return ()
        ends = (_NEAR_FREE if end == "free" else _NEAR_HELD for end in (self.setup.ends_x[1], self.setup.ends_y[1]))
        along, across = ((0.5, end) for end in ends)
        return tuple((s, t) for s in along for t in across)

    def places(self, board: Board) -> tuple[tuple[float, float], ...]:
        """The same on the whole board, m."""
        return places_on(board, self.setup, self.spots)

    def system(self, board: Board) -> System:
        """The setup with the effects of a board that was made for its base."""
        return System(self.setup, effects_of(_carrying(board, self.setup), self.setup))

    def values(self, system: System, values: Values) -> dict[str, Floats]:
        """Values that also hold what the effects of a system take and the board was not asked for.

        What an effect of a setup is in another one is taken to be as large: the same sensor, the same clamp.
        """
        of_base = [_renamed(effect, self) for effect in system.effects]
        by_key = {
            (effect.name, one.key): values[one.name]
            for effect in of_base
            for one in effect.parameters()
            if one.name in values
        }
        missing = {
            one.name: np.asarray(by_key.get((effect.name, one.key), one.prior.median))
            for effect in system.effects
            for one in effect.parameters()
            if one.name not in values
        }
        return {**values, **missing}


def _renamed(effect: Effect, station: Station) -> Effect:
    """An effect under the names that it has in the setup from which a station comes."""
    return replace(effect, owner=station.base.owner) if effect.owner == station.setup.owner else effect


def _carrying(board: Board, setup: Setup) -> Board:
    """A board with its chosen effects also in a setup that they do not know."""
    if any(one.name == setup.name for one in board.setups):
        return board
    new = {
        one.name: acting
        for one in board.chosen
        if one.scope == "setup" and (acting := one.in_setup(board, setup)) is not None
    }
    return replace(board, setups=(*board.setups, setup), chosen=(*board.chosen, *new.values()))


def stations(
    board: Board, values: Values, prior: PriorCard | None = None, *, is_elsewhere: bool = True
) -> tuple[Station, ...]:
    """Every way to hold the board that is looked at: as it was held, free, and as a cantilever.

    Parameters
    ----------
    board : Board
    values : dict of float
        Where the modes are computed.
    prior : PriorCard, optional
        Its noise, where it states one, is that of an edge that was not tried yet.
    is_elsewhere : bool
        Whether ways in which the board was not held are looked at.
    """
    found: list[Station] = []
    for setup in board.setups:
        read = tuple(replace(one, frequency=Quantity.exact(one.frequency.mean), sign="") for one in setup.readings)
        empty = replace(setup, readings=(), peaks=(), published_coefficients=None)
        more = _next_modes(board, Station(empty, setup), values, FURTHER, {one.label for one in read})
        found.append(Station(replace(empty, readings=(*read, *more)), setup, len(read)))
    found += new_stations(board, values, prior) if is_elsewhere else ()
    return tuple(one for one in found if one.setup.readings)


def new_stations(board: Board, values: Values, prior: PriorCard | None = None) -> tuple[Station, ...]:
    """The ways to hold the board in which it was never held: free, and as a cantilever."""
    ways: tuple[tuple[str, Ends], ...] = (("free", ("free", "free")), ("cantilever", ("clamped", "free")))
    found: list[Station] = []
    for name, ends_x in ways:
        other = _elsewhere(board, name, ends_x, prior)
        if other is not None:
            more = _next_modes(board, Station(other, board.setups[0]), values, ELSEWHERE, set())
            found.append(Station(replace(other, readings=more), board.setups[0]))
    return tuple(one for one in found if one.setup.readings)


def _elsewhere(board: Board, name: str, ends_x: Ends, prior: PriorCard | None) -> Setup | None:
    """The board with y0 and y1 free, in a setup of its own; None where it was held so already, or nearly so."""
    is_free = "clamped" not in ends_x
    held = [setup.is_free if is_free else "clamped" in {*setup.ends_x, *setup.ends_y} for setup in board.setups]
    if any(held):
        return None
    taken, first = {setup.name for setup in board.setups}, board.setups[0]
    while name in taken:
        name += "-2"
    noise = assumed_noise((*ends_x, "free", "free"), prior)
    return Setup(name, ends_x, ("free", "free"), (), noise, attached=first.attached, air=first.air)


def known_mass(board: Board) -> float:
    """A weight of a set that has about a fiftieth of the board's mass, kg."""
    wanted = _SHARE * board_mass(board)
    return min(_HANDY, key=lambda one: abs(np.log(one / wanted)))


def _next_modes(
    board: Board, station: Station, values: Values, n: int, taken: Collection[Label]
) -> tuple[Reading, ...]:
    """The lowest modes with a clear name that were not read, each where the model expects it.

    None on whose nodal line the sensor stands, which stays where it is in a session that goes on.
    """
    system, first = station.system(board), station.setup.first_label
    there = station.values(system, values)
    modes, named = spectrum(system, there, SEARCHED)
    sensor = None if station.is_new else station.base.sensor
    at = (
        np.ones(len(named))
        if sensor is None
        else np.abs(deflections(station.base, modes, there, sensor, system.shaped))
    )
    seen = [one for one, share in zip(named, at, strict=True) if share >= NODAL_LINE]
    new = [one for one in seen if one.label is not None and one.label not in taken]
    return tuple(
        Reading(one.label, (one.label.m - first.m, one.label.n - first.n), Quantity.exact(one.frequency))
        for one in new[:n]
        if one.label is not None
    )


def solved(station: Station, board: Board, values: Values) -> Floats:
    """ln f (Hz) of all modes of a station, and what a known mass at each of its spots adds to each, by full solution.

    Not a number where a mode has lost its name.

    Parameters
    ----------
    station : Station
    board : Board
        With its effects.
    values : dict of float

    Returns
    -------
    (1 + n_spots, n_modes) array
    """
    system = station.system(board)
    there = station.values(system, values)
    modes, named = spectrum(system, there, SEARCHED)
    at = {one.label: i for i, one in enumerate(named)}
    rows = [at.get(label, -1) for label in station.setup.labels]
    log_frequency = np.array([np.log(named[i].frequency) if i >= 0 else np.nan for i in rows])
    return np.concatenate([log_frequency[None, :], _added(station, board, modes, there, station.spots)[:, rows]])


def off_place(station: Station, board: Board, values: Values) -> Floats:
    """Standard deviation of what a known mass at each spot adds to ln f, for it is not put quite there.

    Parameters
    ----------
    station, board, values
        As of `solved`.

    Returns
    -------
    (n_spots, n_modes) array
    """
    if not station.spots:
        return np.zeros((0, len(station.setup.labels)))
    system = station.system(board)
    there = station.values(system, values)
    modes, named = spectrum(system, there, SEARCHED)
    at = {one.label: i for i, one in enumerate(named)}
    variance = np.zeros((len(station.spots), len(modes.eigenvalues)))
    for axis, side in enumerate(vibrating_lengths(there, station.setup)):
        step = np.eye(2)[axis] * PLACED / float(np.ravel(side)[0])
        far, near = (
            _added(station, board, modes, there, [(s + sign * step[0], t + sign * step[1]) for s, t in station.spots])
            for sign in (1.0, -1.0)
        )
        variance += (0.5 * (far - near)) ** 2
    return np.sqrt(variance[:, [at.get(label, -1) for label in station.setup.labels]])


def _added(
    station: Station, board: Board, modes: Modes, values: Values, spots: Sequence[tuple[float, float]]
) -> Floats:
    """What a known mass at each of some spots adds to ln f of each mode: (n_spots, n_modes) array.

    Solved among the modes at hand, and the rigid motions of a free board, whose shapes it mixes.
    """
    length_x, length_y = vibrating_lengths(values, station.setup)
    vibrating = density(values) * values["thickness"] * length_x * length_y
    share = known_mass(board) / float(np.ravel(vibrating)[0])
    added = np.empty((len(spots), len(modes.eigenvalues)))
    for row, (s, t) in zip(added, spots, strict=True):
        moved = modes.displacement(np.array([s]), np.array([t]))[:, 0, 0]
        rigid = [1.0, np.sqrt(12.0) * (s - 0.5), np.sqrt(12.0) * (t - 0.5)] if station.setup.is_free else []
        row[:] = with_point_mass(modes.eigenvalues, moved, np.array(rigid), share)
    return added


def with_point_mass(eigenvalues: Floats, moved: Floats, rigid: Floats, share: float) -> Floats:
    """What a point mass adds to ln f of each mode, solved among them: (n_modes,) array.

    Parameters
    ----------
    eigenvalues : (n_modes,) array
        omega^2, s^-2.
    moved : (n_modes,) array
        Mass-normalised deflection of each at the place.
    rigid : (n_rigid,) array
        That of the motions without stiffness.
    share : float
        The mass over that of what vibrates.
    """
    from scipy.linalg import eigh
    from scipy.optimize import linear_sum_assignment

    at = np.concatenate([rigid, moved])
    squared = np.concatenate([np.zeros(rigid.size), eigenvalues])
    found, shapes = eigh(np.diag(squared), np.eye(at.size) + share * np.outer(at, at))
    rows, columns = linear_sum_assignment(shapes**2, maximize=True)
    same = found[columns[np.argsort(rows)]][rigid.size :]
    return np.asarray(0.5 * np.log(same / eigenvalues))


@dataclass(frozen=True, eq=False)
class BareLaw:
    """The modes of a station without further effects, linear in constants and inputs.

    Attributes
    ----------
    station : Station
    solved : (1 + n_spots, n_modes) array
        See `solved`, at the estimate.
    middle : (n_modes,) array
        ln f (Hz) with the inputs at the middle of their priors.
    slopes : (n_modes, 3 + n_inputs) array
        By ln D_x, ln D_y, ln D_s and the inputs' standard coordinates.
    off_place : (n_spots, n_modes) array
        See `off_place`, at the estimate.
    """

    station: Station
    solved: Floats
    middle: Floats
    slopes: Floats
    off_place: Floats


def bare_law(board: Board, station: Station, values: Mapping[str, Floats]) -> BareLaw:
    """Solve a station at an estimate.

    Parameters
    ----------
    board : Board
    station : Station
    values : dict of float
        Rigidities and the board's inputs.

    Raises
    ------
    KeyError
        If one of its modes is no mode of the plate.
    """
    parameters = Parameters(board)
    centre = parameters.theta(values, np.array([setup.noise.median for setup in board.setups]))
    system = station.system(board)
    model = setup_model(system, station.values(system, values))

    def at(x: Floats) -> Values:
        theta = np.tile(centre, (len(x), 1))
        theta[:, parameters.fitted_columns] = x
        return station.values(system, parameters.values(theta))

    start = centre[parameters.fitted_columns]
    slopes = sensitivities(Predictor(at, [model], "linear"), start)
    found = solved(station, board, values)
    there = found[0] + model.discrepancies(at(start[None, :]))[0]
    of_inputs, inputs = under_prior_scales(board, values, slopes[:, N_RIGIDITIES:], start[N_RIGIDITIES:])
    every = np.concatenate([slopes[:, :N_RIGIDITIES], of_inputs], axis=1)
    return BareLaw(station, found, there - of_inputs @ inputs, every, off_place(station, board, values))
