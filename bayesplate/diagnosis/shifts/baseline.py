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

from bayesplate.board.board import Board
from bayesplate.board.sessions import same_modes, under_prior_scales
from bayesplate.diagnosis.shifts.spectrum import Spectrum
from bayesplate.estimates.least_squares import Estimate, log_measured, reading_scales
from bayesplate.estimates.refit import Predict, refit, sensitivities
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.modes.naming import Place
from bayesplate.posterior.laplace import every_predictor
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.posing import PosedProblem

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Baseline:
    """A fit without the effect that is looked for, linear in constants and inputs.

    Attributes
    ----------
    board : Board
    values : dict of float
        Rigidities and inputs at the estimate, SI.
    log_rigidities : (n_constants,) array
        x_hat.
    log_frequency : (n_modes,) array
        g, ln f (Hz) at the estimate.
    residual : (n_modes,) array
        ln measured less g, corrected to inputs at the middle of their priors.
    slopes : (n_modes, n_constants) array
        X, d ln f / d ln D.
    input_slopes : (n_modes, n_inputs) array
        Z, d ln f / d z.
    places : tuple of Place
        Of the labelled modes, setup after setup.
    symmetry : tuple of (bool, bool)
        Whether each setup's two halves are alike along x and along y.
    predict : callable, optional
        ln f (Hz) of the readings as a function of x, without the effect; by default linear.
    spectrum : Spectrum, optional
        All modes that the readings may be, where labels are not certain; by default those of the readings.
    modes : (n_modes,) array of int, optional
        Which mode of the spectrum each reading is; -1: none. By default the first one is the first.
    """

    board: Board
    values: Mapping[str, Floats]
    log_rigidities: Floats
    log_frequency: Floats
    residual: Floats
    slopes: Floats
    input_slopes: Floats
    places: tuple[Place, ...]
    symmetry: tuple[tuple[bool, bool], ...]
    predict: Predict | None = None
    spectrum: Spectrum | None = None
    modes: Rows | None = None

    @property
    def n_modes(self) -> int:
        """Number of readings."""
        return int(self.residual.size)

    @cached_property
    def rows(self) -> Rows:
        """Which mode of `every` each reading is: (n_modes,) array, -1 for none."""
        return np.arange(self.n_modes) if self.modes is None else self.modes

    @cached_property
    def is_mode(self) -> NDArray[np.bool_]:
        """Which readings are a mode of the plate: (n_modes,) array."""
        return np.asarray(self.rows >= 0)

    @cached_property
    def every(self) -> Spectrum:
        """All modes that the readings may be."""
        if self.spectrum is not None:
            return self.spectrum
        ends = np.cumsum([len(setup.readings) for setup in self.board.setups])[:-1]
        parts = np.split(np.arange(self.n_modes), ends)
        places = tuple(tuple(self.places[i] for i in part) for part in parts)
        none = np.zeros(self.input_slopes.shape[1])
        return Spectrum(
            self.log_frequency, self.slopes, self.input_slopes, places, none, (None,) * len(places), self.predict
        )

    def labelled(self, rows: Rows) -> Baseline:
        """The same readings taken for other modes.

        Parameters
        ----------
        rows : (n_modes,) array of int
            Of `every`; -1: none, and then what the arrays say of the reading means nothing.

        Returns
        -------
        Baseline
        """
        every = self.every
        changed = replace(
            self,
            log_frequency=every.log_frequency[rows],
            slopes=every.slopes[rows],
            input_slopes=every.input_slopes[rows],
            places=tuple(every.flat_places[row] for row in rows),
            predict=_of_rows(every.predict, rows),
            modes=rows,
        )
        return replace(changed, residual=self.residual + self.middle - changed.middle)

    def log_alone(self, reading: int) -> float:
        """ln of the probability density, in ln f, of a reading that is no mode; 0 of one whose label is certain."""
        setup = int(self.setup_index[reading])
        peaks = self.every.peaks[setup]
        at = reading - int(np.flatnonzero(self.setup_index == setup)[0])
        return 0.0 if peaks is None or at not in peaks.readings else peaks.log_density_alone(at)

    @property
    def middle(self) -> Floats:
        """ln f (Hz) at the middle of the priors of the inputs, from which residuals count: (n_modes,) array."""
        return np.asarray(self.log_frequency - self.input_slopes @ self.every.inputs)

    @cached_property
    def setup_index(self) -> NDArray[np.intp]:
        """Which setup each reading belongs to: (n_modes,) array."""
        return np.repeat(np.arange(len(self.board.setups)), [len(s.readings) for s in self.board.setups])

    @cached_property
    def same_modes(self) -> tuple[tuple[int, ...], ...]:
        """Readings that are of one mode, in sessions of one setup; most are alone."""
        return same_modes(self.board)

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

    def whitened(self, shift: Floats) -> Floats:
        """What constants leave of a shift, in units of each reading's uncertainty: (n_modes,) arrays."""
        return np.asarray((shift - self.slopes @ (self.absorbing @ shift)) / self.scales)

    def refitted_to(self, shift: Floats) -> tuple[Floats, Floats]:
        """The constants fitted again, by weighted least squares, to frequencies that have shifted.

        Parameters
        ----------
        shift : (n_modes,) array

        Returns
        -------
        visible : (n_modes,) array
            What they leave of the shift: weighted by the readings' uncertainties it is never the larger one.
        step : (n_constants,) array
            Change of ln D.
        """
        if self.predict is None or not np.isfinite(shift).all():
            step = self.absorbing @ shift
            return shift - self.slopes @ step, step
        fitted = refit(self.predict, self.log_frequency + shift, self.scales, self.log_rigidities)
        return self.log_frequency + shift - self.predict(fitted[None, :])[0], fitted - self.log_rigidities

    def weighted_rms(self, shift: Floats) -> float:
        """Rms over the modes, each with the weight that it has in the fit, in the unit of a (n_modes,) array."""
        return weighted_rms(shift, self.scales)


def _of_rows(predict: Predict | None, rows: NDArray[np.intp]) -> Predict | None:
    if predict is None or isinstance(predict, Predictor):
        return predict and predict.of(rows)
    return lambda x: predict(x)[:, rows]


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
    spectrum = Spectrum(
        log_frequency=predict(at[None, :])[0],
        slopes=slopes[:, :n],
        input_slopes=input_slopes,
        places=tuple(model.every_place for model in models),
        inputs=inputs,
        peaks=problem.posterior.peaks,
        predict=predict.with_fixed(at[n:]),
        discrepancy=np.concatenate(discrepancies),
    )
    rows = spectrum.first_of_each([len(setup.readings) for setup in board.setups])
    bare = Baseline(
        board=board,
        values=values,
        log_rigidities=at[:n],
        log_frequency=np.zeros(rows.size),
        residual=log_measured(board),
        slopes=np.zeros((rows.size, n)),
        input_slopes=np.zeros((rows.size, inputs.size)),
        places=(),
        symmetry=symmetry_of(models),
        spectrum=spectrum,
    )
    return bare.labelled(rows)


def weighted_rms(shift: Floats, scales: Floats) -> float:
    """Root of the mean square of (n_modes,) shifts, weighted by the inverse squares of the readings' uncertainties."""
    return float(np.sqrt(np.average(shift**2, weights=1.0 / scales**2)))


def baseline_at(board: Board, estimate: Estimate, predict: Predict | None = None) -> Baseline:
    """The baseline of a board whose inputs are exact, at its least-squares estimate.

    Parameters
    ----------
    board : Board
    estimate : Estimate
    predict : callable, optional
        The exact law without effects: (n, n_modes) ln f (Hz) from (n, n_constants) ln D; by default it is linear.
    """
    if Parameters(board).inputs:
        raise ValueError("wanted a board of exact inputs, got uncertain ones: pose the problem instead")
    return Baseline(
        board=board,
        values=estimate.values,
        log_rigidities=np.log(board.symmetry.free_of(estimate.values)),
        log_frequency=log_measured(board) - estimate.residuals,
        residual=estimate.residuals,
        slopes=board.symmetry.along(estimate.sensitivities),
        input_slopes=np.zeros((estimate.residuals.size, 0)),
        places=places_of(estimate.models),
        symmetry=symmetry_of(estimate.models),
        predict=predict,
    )


def places_of(models: Sequence[SetupModel]) -> tuple[Place, ...]:
    """Places of all labelled modes, setup after setup."""
    return tuple(place for model in models for place in model.places)


def symmetry_of(models: Sequence[SetupModel]) -> tuple[tuple[bool, bool], ...]:
    """Whether the two halves are alike along x and along y, setup after setup."""
    return tuple((model.plate.x.is_split, model.plate.y.is_split) for model in models)
