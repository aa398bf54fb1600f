"""The fit without a further effect: its residual, what its constants and inputs can absorb, and the noise.

Around the estimate the logarithms of the readings are

    y = g + X (x - x_hat) + Z z + noise,

with g the frequencies at the estimate, x the logarithms of the free rigidities (D_x, D_y, D_s, of an isotropic board D
alone), and z the standard coordinates of the uncertain inputs. The constants are projected out: a residual is judged
in as many directions as there are more readings than constants. The inputs have priors and add to the covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board
from bayesplate.board.sessions import readings_by_mode, rescale_discrepancies
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.refit import Predict, refit, sensitivities
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.plate.naming import ModePlace
from bayesplate.posterior.laplace import all_modes_predictor
from bayesplate.posterior.posing import PosedProblem


@dataclass(frozen=True, eq=False)
class PossibleModes:
    """All modes that the readings of a board may be, linear in constants and inputs around the estimate.

    One setup after the other: the labelled modes first, then those of peaks.
    """

    log_frequency: Floats  # (n_possible,) array: ln f (Hz) at the estimate
    slopes: Floats  # (n_possible, n_constants) array: d ln f / d ln D
    input_slopes: Floats  # (n_possible, n_inputs) array: d ln f / d z
    places: tuple[tuple[ModePlace, ...], ...]  # one tuple per setup
    inputs: Floats  # (n_inputs,) array: z at the estimate
    # one per setup: the likelihood of its peaks, given its modes; None where all labels are certain
    peaks: tuple[PeakLikelihood | None, ...]
    predict: Predict  # ln f (Hz) of all these modes as a function of x, without an effect
    # (n_possible,) array or 0: ln f of the board less that of its plate, at the estimate (`board.sessions`)
    discrepancy: Floats | float = 0.0

    @cached_property
    def starts(self) -> Indices:
        """Index of the first mode of each setup: (n_setups,) array."""
        return np.cumsum([0, *(len(places) for places in self.places)])[:-1]

    @property
    def is_open(self) -> bool:
        """Whether a reading may be another mode than its label says."""
        return any(peaks is not None for peaks in self.peaks)

    @property
    def middle(self) -> Floats:
        """ln f (Hz) at the middle of the priors of the inputs: (n_possible,) array."""
        return np.asarray(self.log_frequency - self.input_slopes @ self.inputs)


@dataclass(frozen=True, eq=False)
class Baseline:
    """A fit without the effect that is searched for, and the mode that each of its readings is."""

    board: Board
    values: Mapping[str, Floats]  # rigidities and inputs at the estimate, SI
    log_rigidities: Floats  # (n_constants,) array: x_hat
    log_readings: Floats  # (n_modes,) array: ln measured (Hz)
    possible_modes: PossibleModes  # all modes that the readings may be
    # (n_modes,) array of int: the index in `possible_modes` of the mode that each reading is; -1: no mode, and then the
    # entries of the arrays below mean nothing for this reading
    rows: Indices
    symmetry: tuple[tuple[bool, bool], ...]  # whether each setup's two halves are alike along x and along y

    def labelled(self, rows: Indices) -> Baseline:
        """The readings as other modes, by indices in `possible_modes` (-1: no mode); itself if none differs."""
        return self if np.array_equal(rows, self.rows) else replace(self, rows=rows)

    @property
    def n_modes(self) -> int:
        return int(self.log_readings.size)

    @cached_property
    def is_mode(self) -> NDArray[np.bool_]:
        """Which readings are a mode of the plate: (n_modes,) array."""
        return np.asarray(self.rows >= 0)

    @cached_property
    def mode_readings(self) -> Indices:
        """Indices of the readings that are a mode."""
        return np.flatnonzero(self.is_mode)

    @cached_property
    def log_frequency(self) -> Floats:
        """g, ln f (Hz) at the estimate: (n_modes,) array."""
        return self.possible_modes.log_frequency[self.rows]

    @cached_property
    def slopes(self) -> Floats:
        """X, d ln f / d ln D: (n_modes, n_constants) array."""
        return self.possible_modes.slopes[self.rows]

    @cached_property
    def input_slopes(self) -> Floats:
        """Z, d ln f / d z: (n_modes, n_inputs) array."""
        return self.possible_modes.input_slopes[self.rows]

    @cached_property
    def middle(self) -> Floats:
        """ln f (Hz) at the middle of the priors of the inputs, from which residuals count: (n_modes,) array."""
        return self.possible_modes.middle[self.rows]

    @cached_property
    def residual(self) -> Floats:
        """ln measured less ln f at the middle of the priors of the inputs: (n_modes,) array."""
        return np.asarray(self.log_readings - self.middle)

    @cached_property
    def places(self) -> tuple[ModePlace, ...]:
        places = [place for setup_places in self.possible_modes.places for place in setup_places]
        return tuple(places[row] for row in self.rows)

    @cached_property
    def setup_index(self) -> Indices:
        """Which setup each reading belongs to: (n_modes,) array."""
        return np.repeat(np.arange(len(self.board.setups)), [len(setup.readings) for setup in self.board.setups])

    @cached_property
    def readings_by_mode(self) -> tuple[tuple[int, ...], ...]:
        """Indices of the readings of each mode; several only where sessions of one setup repeat it."""
        return readings_by_mode(self.board)

    @cached_property
    def mode_index(self) -> Indices:
        """Index in `readings_by_mode` of the mode of each reading: (n_modes,) array."""
        index = np.empty(self.n_modes, dtype=np.intp)
        for i, mode in enumerate(self.readings_by_mode):
            index[list(mode)] = i
        return index

    @cached_property
    def own_variance(self) -> Floats:
        """Stated variance of each reading and that of its rounding, without the noise: (n_modes,) array."""
        return np.concatenate([ReadingErrors.of(setup).own_variance for setup in self.board.setups])

    @cached_property
    def scales(self) -> Floats:
        """Relative uncertainty of each reading at the median noise: (n_modes,) array."""
        return reading_scales(self.board)

    @cached_property
    def absorption(self) -> Floats:
        """Matrix from a shift of ln f to the step in ln D that absorbs it best: (n_constants, n_modes) array."""
        return np.asarray(np.linalg.pinv(self.slopes / self.scales[:, None]) / self.scales)

    @cached_property
    def residual_directions(self) -> Floats:
        """Orthonormal directions that the constants cannot reach: (n_directions, n_modes) array, 0 where no mode is."""
        slopes = self.slopes[self.mode_readings]
        directions = np.linalg.svd(slopes, full_matrices=True)[0][:, slopes.shape[1] :]
        padded = np.zeros((directions.shape[1], self.n_modes))
        padded[:, self.mode_readings] = directions.T
        return padded

    @cached_property
    def half_log_det(self) -> float:
        """Half the logarithm of the determinant of X'X: the restricted density's change of volume."""
        slopes = self.slopes[self.mode_readings]
        return 0.5 * float(np.linalg.slogdet(slopes.T @ slopes)[1])

    def log_spurious(self, reading: int) -> float:
        """ln of the probability density, in ln f, of a spurious reading; 0 where its label is certain."""
        setup = int(self.setup_index[reading])
        peaks = self.possible_modes.peaks[setup]
        position = reading - int(np.flatnonzero(self.setup_index == setup)[0])
        return 0.0 if peaks is None or position not in peaks.readings else peaks.log_density_spurious(position)

    def refitted_to(self, shift: Floats) -> tuple[Floats, Floats]:
        """Rest of an (n_modes,) shift after a weighted refit of the constants, never more than the shift; their step
        in ln D."""
        if not np.isfinite(shift).all():
            return np.full(shift.size, np.nan), np.full(self.log_rigidities.size, np.nan)
        predict = _predict_rows(self.possible_modes.predict, self.rows)
        log_rigidities = refit(predict, self.log_frequency + shift, self.scales, self.log_rigidities)
        return self.log_frequency + shift - predict(log_rigidities[None, :])[0], log_rigidities - self.log_rigidities


def _predict_rows(predict: Predict, rows: Indices) -> Predict:
    return predict.of(rows) if isinstance(predict, Predictor) else lambda x: predict(x)[:, rows]


def baseline_of(problem: PosedProblem) -> Baseline:
    """The baseline of a posed problem, at the centre of its posterior under the exact law."""
    board, parameters, models = problem.board, problem.parameters, problem.posterior.models
    n, columns = parameters.n_constants, parameters.fitted_columns
    predict = all_modes_predictor(board, models, "exact", problem.centre)
    estimate = problem.centre[columns]
    slopes = sensitivities(predict, estimate)
    values = parameters.values_at(problem.centre)
    input_slopes, inputs = rescale_discrepancies(board, values, slopes[:, n:], estimate[n:])
    discrepancies = [np.broadcast_to(model.discrepancies(values)[0], len(model.mode_places)) for model in models]
    modes = PossibleModes(
        log_frequency=predict(estimate[None, :])[0],
        slopes=slopes[:, :n],
        input_slopes=input_slopes,
        places=tuple(model.mode_places for model in models),
        inputs=inputs,
        peaks=problem.posterior.peaks,
        predict=predict.with_fixed(estimate[n:]),
        discrepancy=np.concatenate(discrepancies),
    )
    return Baseline(
        board=board,
        values=values,
        log_rigidities=estimate[:n],
        log_readings=log_measured(board),
        possible_modes=modes,
        rows=labelled_rows(models),
        symmetry=symmetry_of(models),
    )


def labelled_rows(models: Sequence[SetupModel]) -> Indices:
    """Index of each labelled mode among all modes of the models: (n_modes,) array."""
    starts = np.cumsum([0, *(len(model.mode_places) for model in models)])[:-1]
    return np.concatenate([start + np.arange(len(model.places)) for start, model in zip(starts, models, strict=True)])


def symmetry_of(models: Sequence[SetupModel]) -> tuple[tuple[bool, bool], ...]:
    """Whether the plate of each setup is symmetric along x and along y."""
    return tuple((model.plate.x.is_split, model.plate.y.is_split) for model in models)
