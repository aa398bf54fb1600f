"""The modes of a station as laws: their change with constants, inputs, and a known mass on the board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values, board_density, nominal_mass, vibrating_lengths
from bayesplate.board.sessions import rescale_discrepancies
from bayesplate.errors import BayesplateError
from bayesplate.estimates.refit import sensitivities
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.planning.stations import N_SEARCHED_MODES, Station
from bayesplate.plate.solve import Modes
from bayesplate.posterior.parameters import Parameters

_MASS_SHARE = 0.02
"""Share of the board's mass that a known mass has, about: it shifts a mode by up to some per cent."""
_WEIGHT_SET = (0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3, 20e-3, 50e-3)
"""Masses that come in a set of weights, kg."""
PLACING_SD = 1e-3
"""Standard deviation of the place of a known mass along each side, m: it is put on a pencil mark by hand."""


@dataclass(frozen=True, eq=False)
class SolvedStation:
    """The modes of a station by full solution, and their shifts by a known mass."""

    station: Station
    values: Values  # completed by `Station.values`
    modes: Modes  # the lowest ones
    rows: list[int]  # indices of the station's modes among them; -1 where one has lost its name
    share: float  # the known mass over the vibrating mass

    @classmethod
    def of(cls, station: Station, board: Board, values: Values, meshed: Values | None = None) -> SolvedStation:
        """Solve a station of a board with its effects.

        If `meshed` values are given, the mesh is the one for these, whose matrices are then used again.
        """
        system = station.system(board)
        station_values = station.values(system, values)
        plate = None if meshed is None else system.plate(station.values(system, meshed))
        modes, named = spectrum(system, station_values, N_SEARCHED_MODES, plate)
        row_of = {mode.label: i for i, mode in enumerate(named)}
        length_x, length_y = vibrating_lengths(station_values, station.setup)
        vibrating = board_density(station_values) * station_values["thickness"] * length_x * length_y
        share = known_mass(board) / float(np.ravel(vibrating)[0])
        return cls(station, station_values, modes, [row_of.get(label, -1) for label in station.setup.labels], share)

    @property
    def log_hertz_and_mass_shifts(self) -> Floats:
        """ln f (Hz) of the station's modes, and its shift by a known mass at each spot: (1 + n_spots, n_modes) array.

        NaN where a mode has lost its name.
        """
        log_hertz = 0.5 * np.log(self.modes.eigenvalues) - np.log(2.0 * np.pi)
        lost = np.where(np.array(self.rows) < 0, np.nan, 0.0)
        return np.concatenate([log_hertz[None, :], self._mass_shifts(self.station.spots)])[:, self.rows] + lost

    @property
    def mass_shift_sd(self) -> Floats:
        """Standard deviation of the shift by a known mass from its error of place: (n_spots, n_modes) array."""
        variance = np.zeros((len(self.station.spots), len(self.modes.eigenvalues)))
        for axis, side in enumerate(vibrating_lengths(self.values, self.station.setup)):
            step = np.eye(2)[axis] * PLACING_SD / float(np.ravel(side)[0])
            spots = np.reshape(self.station.spots, (-1, 2))
            far, near = (self._mass_shifts(spots + sign * step) for sign in (1.0, -1.0))
            variance += (0.5 * (far - near)) ** 2
        return np.sqrt(variance[:, self.rows])

    def _mass_shifts(self, spots: Sequence[tuple[float, float]] | Floats) -> Floats:
        """Shift of ln f of each mode by a known mass at each of some spots: (n_spots, n_modes) array.

        Solved in the basis of the computed modes and of the rigid motions of a free board, which the mass mixes.
        """
        from scipy.linalg import eigh
        from scipy.optimize import linear_sum_assignment

        eigenvalues = self.modes.eigenvalues
        added = np.empty((len(spots), len(eigenvalues)))
        for row, (s, t) in zip(added, spots, strict=True):
            moved = self.modes.displacement(np.array([s]), np.array([t]))[:, 0, 0]
            rigid = [1.0, np.sqrt(12.0) * (s - 0.5), np.sqrt(12.0) * (t - 0.5)] if self.station.setup.is_free else []
            amplitudes, squared = np.r_[rigid, moved], np.r_[np.zeros(len(rigid)), eigenvalues]
            loaded, shapes = eigh(
                np.diag(squared), np.eye(amplitudes.size) + self.share * np.outer(amplitudes, amplitudes)
            )
            _, order = linear_sum_assignment(shapes**2, maximize=True)
            row[:] = 0.5 * np.log(loaded[order[len(rigid) :]])
        return added - 0.5 * np.log(eigenvalues)


def known_mass(board: Board) -> float:
    """The mass of a set of weights that is nearest to a fiftieth of the board's mass, kg."""
    target = _MASS_SHARE * nominal_mass(board)
    return min(_WEIGHT_SET, key=lambda mass: abs(np.log(mass / target)))


@dataclass(frozen=True, eq=False)
class BareLaw:
    """The modes of a station without further effects, linear in constants and inputs."""

    station: Station
    solved: Floats  # (1 + n_spots, n_modes) array: `SolvedStation.log_hertz_and_mass_shifts` at the estimate
    middle: Floats  # (n_modes,) array: ln f (Hz) with the inputs at the middle of their priors
    # (n_plates, n_modes, n_constants + n_inputs) array: by the logarithms of the free rigidities and the inputs'
    # standard coordinates, at the estimate; where nothing was read, at plates drawn from the prior
    slopes: Floats
    mass_shift_sd: Floats  # (n_spots, n_modes) array: `SolvedStation.mass_shift_sd` at the estimate


def bare_law(board: Board, station: Station, values: Values, plates: Sequence[Values] = ()) -> BareLaw:
    """Solve a station at an estimate; its slopes are taken there, or at those drawn plates that have all its modes.

    KeyError where the estimate has not all modes of the station.
    """
    slopes, inputs, offset = _linearise(board, station, values)
    solved_station = SolvedStation.of(station, board, values)
    solved, n = solved_station.log_hertz_and_mass_shifts, board.symmetry.n
    middle = solved[0] + offset - slopes[:, n:] @ inputs
    drawn_slopes = []
    for plate in plates:
        try:
            drawn_slopes.append(_linearise(board, station, plate)[0])
        except (KeyError, BayesplateError):
            continue
    return BareLaw(station, solved, middle, np.stack(drawn_slopes or [slopes]), solved_station.mass_shift_sd)


def _linearise(board: Board, station: Station, values: Values) -> tuple[Floats, Floats, Floats]:
    """At some values: slopes of ln f by constants and inputs, the inputs, and the discrepancies of the modes."""
    parameters = Parameters(board)
    n = parameters.n_constants
    centre = parameters.theta(values, np.array([setup.noise.median for setup in board.setups]))
    system = station.system(board)
    model = setup_model(system, station.values(system, values))

    def values_at(x: Floats) -> Values:
        theta = np.tile(centre, (len(x), 1))
        theta[:, parameters.fitted_columns] = x
        return station.values(system, parameters.values(theta))

    start = centre[parameters.fitted_columns]
    slopes = sensitivities(Predictor(values_at, [model], "linear"), start)
    of_inputs, inputs = rescale_discrepancies(board, values, slopes[:, n:], start[n:])
    all_slopes = np.concatenate([slopes[:, :n], of_inputs], axis=1)
    return all_slopes, inputs, model.discrepancies(values_at(start[None, :]))[0]
