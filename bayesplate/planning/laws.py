"""The modes of a station: how they change with constants, inputs, and a known mass on the board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values, density, vibrating_lengths
from bayesplate.board.sessions import under_prior_scales
from bayesplate.effects.attached_items import board_mass
from bayesplate.errors import BayesplateError
from bayesplate.estimates.refit import sensitivities
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.planning.stations import SEARCHED, Station
from bayesplate.plate.solve import Modes
from bayesplate.posterior.parameters import Parameters

_SHARE = 0.02
"""Of the board's mass that a known mass has, about: it shifts a mode by up to some per cent."""
_HANDY = (0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3)
"""Masses that come in a set of weights, kg."""
PLACED = 1e-3
"""Standard deviation along each side of where a known mass stands, m: it is put on a pencil mark by hand."""


@dataclass(frozen=True, eq=False)
class SolvedStation:
    """The modes of a station by full solution, and a known mass among them."""

    station: Station
    values: Values  # with those that the station's effects take
    modes: Modes  # the lowest ones
    rows: list[int]  # where the station's modes stand among them; -1 where one has lost its name
    share: float  # the known mass over that of what vibrates

    @classmethod
    def of(cls, station: Station, board: Board, values: Values, meshed: Values | None = None) -> SolvedStation:
        """Solve a station of a board with its effects.

        On the mesh for other values where these are given, whose matrices then serve again.
        """
        system = station.system(board)
        there = station.values(system, values)
        plate = None if meshed is None else system.plate(station.values(system, meshed))
        modes, named = spectrum(system, there, SEARCHED, plate)
        at = {one.label: i for i, one in enumerate(named)}
        length_x, length_y = vibrating_lengths(there, station.setup)
        vibrating = density(there) * there["thickness"] * length_x * length_y
        share = known_mass(board) / float(np.ravel(vibrating)[0])
        return cls(station, there, modes, [at.get(label, -1) for label in station.setup.labels], share)

    @property
    def bare_and_added(self) -> Floats:
        """ln f (Hz) of the station's modes, and what a known mass at each of its spots adds: (1 + n_spots, n_modes).

        Not a number where a mode has lost its name.
        """
        there = 0.5 * np.log(self.modes.eigenvalues) - np.log(2.0 * np.pi)
        lost = np.where(np.array(self.rows) < 0, np.nan, 0.0)
        return np.concatenate([there[None, :], self._added(self.station.spots)])[:, self.rows] + lost

    @property
    def off_place(self) -> Floats:
        """Standard deviation of what a known mass adds, for it stands off its spot: (n_spots, n_modes) array."""
        variance = np.zeros((len(self.station.spots), len(self.modes.eigenvalues)))
        for axis, side in enumerate(vibrating_lengths(self.values, self.station.setup)):
            step = np.eye(2)[axis] * PLACED / float(np.ravel(side)[0])
            spots = np.reshape(self.station.spots, (-1, 2))
            far, near = (self._added(spots + sign * step) for sign in (1.0, -1.0))
            variance += (0.5 * (far - near)) ** 2
        return np.sqrt(variance[:, self.rows])

    def _added(self, spots: Sequence[tuple[float, float]] | Floats) -> Floats:
        """What a known mass at each of some spots adds to ln f of each mode: (n_spots, n_modes) array.

        Solved among the modes at hand, and the rigid motions of a free board, whose shapes it mixes.
        """
        from scipy.linalg import eigh
        from scipy.optimize import linear_sum_assignment

        eigenvalues = self.modes.eigenvalues
        added = np.empty((len(spots), len(eigenvalues)))
        for row, (s, t) in zip(added, spots, strict=True):
            moved = self.modes.displacement(np.array([s]), np.array([t]))[:, 0, 0]
            rigid = [1.0, np.sqrt(12.0) * (s - 0.5), np.sqrt(12.0) * (t - 0.5)] if self.station.setup.is_free else []
            at, squared = np.r_[rigid, moved], np.r_[np.zeros(len(rigid)), eigenvalues]
            found, shapes = eigh(np.diag(squared), np.eye(at.size) + self.share * np.outer(at, at))
            _, same = linear_sum_assignment(shapes**2, maximize=True)
            row[:] = 0.5 * np.log(found[same[len(rigid) :]])
        return added - 0.5 * np.log(eigenvalues)


def known_mass(board: Board) -> float:
    """A weight of a set that has about a fiftieth of the board's mass, kg."""
    wanted = _SHARE * board_mass(board)
    return min(_HANDY, key=lambda one: abs(np.log(one / wanted)))


@dataclass(frozen=True, eq=False)
class BareLaw:
    """The modes of a station without further effects, linear in constants and inputs."""

    station: Station
    solved: Floats  # (1 + n_spots, n_modes) array: of `SolvedStation.bare_and_added`, at the estimate
    middle: Floats  # (n_modes,) array: ln f (Hz) with the inputs at the middle of their priors
    # (n_plates, n_modes, n_constants + n_inputs) array: by the logarithms of the free rigidities and the inputs'
    # standard coordinates, at the estimate; where nothing was read, at plates drawn from the prior
    slopes: Floats
    off_place: Floats  # (n_spots, n_modes) array: of `SolvedStation`, at the estimate


def bare_law(board: Board, station: Station, values: Values, drawn: Sequence[Values] = ()) -> BareLaw:
    """Solve a station at an estimate, its slopes at the plates drawn instead that have its modes; KeyError without."""
    slopes, inputs, offset = _linear(board, station, values)
    found = SolvedStation.of(station, board, values)
    solved, n = found.bare_and_added, board.symmetry.n
    middle = solved[0] + offset - slopes[:, n:] @ inputs
    others = []
    for one in drawn:
        try:
            others.append(_linear(board, station, one)[0])
        except (KeyError, BayesplateError):
            continue
    return BareLaw(station, solved, middle, np.stack(others or [slopes]), found.off_place)


def _linear(board: Board, station: Station, values: Values) -> tuple[Floats, Floats, Floats]:
    """Slopes of ln f by constants and inputs, the inputs, and how far the board is off its plate: at some values."""
    parameters = Parameters(board)
    n = parameters.n_constants
    centre = parameters.theta(values, np.array([setup.noise.median for setup in board.setups]))
    system = station.system(board)
    model = setup_model(system, station.values(system, values))

    def at(x: Floats) -> Values:
        theta = np.tile(centre, (len(x), 1))
        theta[:, parameters.fitted_columns] = x
        return station.values(system, parameters.values(theta))

    start = centre[parameters.fitted_columns]
    slopes = sensitivities(Predictor(at, [model], "linear"), start)
    of_inputs, inputs = under_prior_scales(board, values, slopes[:, n:], start[n:])
    every = np.concatenate([slopes[:, :n], of_inputs], axis=1)
    return every, inputs, model.discrepancies(at(start[None, :]))[0]
