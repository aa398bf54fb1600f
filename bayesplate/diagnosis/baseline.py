"""The fit that is questioned: its residual, what its constants and inputs can absorb, and what counts as noise.

Around the estimate the logarithms of the readings are

    y = g + X (x - x_hat) + Z z + noise,

with g the frequencies at the estimate, x the logarithms of the free rigidities (D_x, D_y, D_s, of an isotropic board D
alone), and z the standard coordinates of the uncertain inputs. The constants are projected out, so that of a residual
only as many directions as there are readings beyond them are left to be judged; the inputs have their priors and count
as one more covariance.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.sessions import same_modes, under_prior_scales
from bayesplate.estimates.least_squares import log_measured, reading_scales
from bayesplate.estimates.refit import Predict, refit, sensitivities
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.plate.naming import Place
from bayesplate.posterior.laplace import every_predictor
from bayesplate.posterior.posing import PosedProblem

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class PossibleModes:
    """All modes that the readings of a board may be, linear in constants and inputs around the estimate.

    One setup after the other: the labelled modes first, then those of peaks.
    """

    log_frequency: Floats  # (n_every,) array: ln f (Hz) at the estimate
    slopes: Floats  # (n_every, n_constants) array: d ln f / d ln D
    input_slopes: Floats  # (n_every, n_inputs) array: d ln f / d z
    places: tuple[tuple[Place, ...], ...]  # one tuple per setup
    inputs: Floats  # (n_inputs,) array: z at the estimate
    # for each setup what its peaks say of its modes; None where all labels are certain
    peaks: tuple[PeakLikelihood | None, ...]
    predict: Predict  # ln f (Hz) of all of them as a function of x, without an effect
    # (n_every,) array or 0: ln f of the board less that of its plate, at the estimate (`board.sessions`)
    discrepancy: Floats | float = 0.0

    @cached_property
    def starts(self) -> Rows:
        """Where each setup begins: (n_setups,) array."""
        return np.cumsum([0, *(len(part) for part in self.places)])[:-1]

    @property
    def is_open(self) -> bool:
        """Whether a reading may be another mode than its label says."""
        return any(peaks is not None for peaks in self.peaks)

    @property
    def middle(self) -> Floats:
        """ln f (Hz) at the middle of the priors of the inputs: (n_every,) array."""
        return np.asarray(self.log_frequency - self.input_slopes @ self.inputs)


@dataclass(frozen=True, eq=False)
class Baseline:
    """A fit without the effect that is looked for, and the modes that its readings are taken for."""

    board: Board
    values: Mapping[str, Floats]  # rigidities and inputs at the estimate, SI
    log_rigidities: Floats  # (n_constants,) array: x_hat
    log_readings: Floats  # (n_modes,) array: ln measured (Hz)
    every: PossibleModes  # all modes that the readings may be
    # (n_modes,) array of int: which of them each reading is; -1: none, and then what the arrays below say of the
    # reading means nothing
    rows: Rows
    symmetry: tuple[tuple[bool, bool], ...]  # whether each setup's two halves are alike along x and along y

    def labelled(self, rows: Rows) -> Baseline:
        """The same readings taken for other modes, rows of `every` (-1: none); itself where they are the same."""
        return self if np.array_equal(rows, self.rows) else replace(self, rows=rows)

    @property
    def n_modes(self) -> int:
        return int(self.log_readings.size)

    @cached_property
    def is_mode(self) -> NDArray[np.bool_]:
        """Which readings are a mode of the plate: (n_modes,) array."""
        return np.asarray(self.rows >= 0)

    @cached_property
    def used(self) -> Rows:
        """Indices of the readings that are a mode."""
        return np.flatnonzero(self.is_mode)

    @cached_property
    def log_frequency(self) -> Floats:
        """g, ln f (Hz) at the estimate: (n_modes,) array."""
        return self.every.log_frequency[self.rows]

    @cached_property
    def slopes(self) -> Floats:
        """X, d ln f / d ln D: (n_modes, n_constants) array."""
        return self.every.slopes[self.rows]

    @cached_property
    def input_slopes(self) -> Floats:
        """Z, d ln f / d z: (n_modes, n_inputs) array."""
        return self.every.input_slopes[self.rows]

    @cached_property
    def middle(self) -> Floats:
        """ln f (Hz) at the middle of the priors of the inputs, from which residuals count: (n_modes,) array."""
        return self.every.middle[self.rows]

    @cached_property
    def residual(self) -> Floats:
        """ln measured less ln f at the middle of the priors of the inputs: (n_modes,) array."""
        return np.asarray(self.log_readings - self.middle)

    @cached_property
    def places(self) -> tuple[Place, ...]:
        flat = [place for part in self.every.places for place in part]
        return tuple(flat[row] for row in self.rows)

    @cached_property
    def setup_index(self) -> Rows:
        """Which setup each reading belongs to: (n_modes,) array."""
        return np.repeat(np.arange(len(self.board.setups)), [len(s.readings) for s in self.board.setups])

    @cached_property
    def same_modes(self) -> tuple[tuple[int, ...], ...]:
        """Readings that are of one mode, in sessions of one setup; most are alone."""
        return same_modes(self.board)

    @cached_property
    def mode_index(self) -> Rows:
        """Which of these each reading belongs to: (n_modes,) array."""
        index = np.empty(self.n_modes, dtype=np.intp)
        for i, mode in enumerate(self.same_modes):
            index[list(mode)] = i
        return index

    @cached_property
    def own_variance(self) -> Floats:
        """Variance of each reading apart from the noise: its own and that of its rounding, (n_modes,) array."""
        return np.concatenate([ReadingErrors.of(setup).own_variance for setup in self.board.setups])

    @cached_property
    def scales(self) -> Floats:
        """Relative uncertainty of each reading at the median noise: (n_modes,) array."""
        return reading_scales(self.board)

    @cached_property
    def absorbing(self) -> Floats:
        """The matrix that takes a shift of the frequencies to the constants that absorb it best: (n, n_modes) array."""
        return np.asarray(np.linalg.pinv(self.slopes / self.scales[:, None]) / self.scales)

    @cached_property
    def blind(self) -> Floats:
        """Orthonormal directions that the constants cannot reach: (n_left, n_modes) array, zero where no mode is."""
        slopes = self.slopes[self.used]
        left = np.linalg.svd(slopes, full_matrices=True)[0][:, slopes.shape[1] :]
        full = np.zeros((left.shape[1], self.n_modes))
        full[:, self.used] = left.T
        return full

    @cached_property
    def half_log_det(self) -> float:
        """Half the logarithm of the determinant of X'X: the restricted density's change of volume."""
        slopes = self.slopes[self.used]
        return 0.5 * float(np.linalg.slogdet(slopes.T @ slopes)[1])

    def log_alone(self, reading: int) -> float:
        """ln of the probability density, in ln f, of a reading that is no mode; 0 of one whose label is certain."""
        setup = int(self.setup_index[reading])
        peaks = self.every.peaks[setup]
        at = reading - int(np.flatnonzero(self.setup_index == setup)[0])
        return 0.0 if peaks is None or at not in peaks.readings else peaks.log_density_alone(at)

    def refitted_to(self, shift: Floats) -> tuple[Floats, Floats]:
        """What constants, fitted again by weights, leave of an (n_modes,) shift, never more than it; their step in ln
        D."""
        if not np.isfinite(shift).all():
            return np.full(shift.size, np.nan), np.full(self.log_rigidities.size, np.nan)
        predict = _of_rows(self.every.predict, self.rows)
        fitted = refit(predict, self.log_frequency + shift, self.scales, self.log_rigidities)
        return self.log_frequency + shift - predict(fitted[None, :])[0], fitted - self.log_rigidities


def _of_rows(predict: Predict, rows: Rows) -> Predict:
    return predict.of(rows) if isinstance(predict, Predictor) else lambda x: predict(x)[:, rows]


def baseline_of(problem: PosedProblem) -> Baseline:
    """The baseline of a problem that is ready to be sampled, at the centre of its posterior under the exact law."""
    board, parameters, models = problem.board, problem.parameters, problem.posterior.models
    n, columns = parameters.n_constants, parameters.fitted_columns
    predict = every_predictor(board, models, "exact", problem.centre)
    at = problem.centre[columns]
    slopes = sensitivities(predict, at)
    values = parameters.values_at(problem.centre)
    input_slopes, inputs = under_prior_scales(board, values, slopes[:, n:], at[n:])
    discrepancies = [np.broadcast_to(one.discrepancies(values)[0], len(one.every_place)) for one in models]
    every = PossibleModes(
        log_frequency=predict(at[None, :])[0],
        slopes=slopes[:, :n],
        input_slopes=input_slopes,
        places=tuple(model.every_place for model in models),
        inputs=inputs,
        peaks=problem.posterior.peaks,
        predict=predict.with_fixed(at[n:]),
        discrepancy=np.concatenate(discrepancies),
    )
    return Baseline(
        board=board,
        values=values,
        log_rigidities=at[:n],
        log_readings=log_measured(board),
        every=every,
        rows=labelled_rows(models),
        symmetry=symmetry_of(models),
    )


def labelled_rows(models: Sequence[SetupModel]) -> Rows:
    """Where the labelled modes of each setup stand among all that its model has: (n_modes,) array."""
    starts = np.cumsum([0, *(len(model.every_place) for model in models)])[:-1]
    return np.concatenate([start + np.arange(len(one.places)) for start, one in zip(starts, models, strict=True)])


def symmetry_of(models: Sequence[SetupModel]) -> tuple[tuple[bool, bool], ...]:
    """Whether the two halves are alike along x and along y, setup after setup."""
    return tuple((model.plate.x.is_split, model.plate.y.is_split) for model in models)
