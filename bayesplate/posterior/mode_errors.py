"""Errors of the most likely constants: in sample, and each mode left out in turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.sessions import same_modes
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.leave_one_out import CarryingMode, Errors, carrying_modes, prediction_errors
from bayesplate.estimates.refit import deviance_misfit
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import PosedProblem

_N_STARTS = 500


def mode_errors(inference: Inference, draws: Draws) -> Errors:
    """Errors of the most likely constants under the exact law, in sample and left out.

    One estimator for both, with the likelihood of the fit at the posterior's median noise: rounded readings are
    intervals, a robust fit has Student's errors. Uncertain inputs move within their priors.
    """
    problem = inference.problem
    predict = predictor(problem.board, problem.posterior.models, "exact", problem.centre)
    misfit = deviance_misfit(problem.posterior.readings, median_noise(draws))
    starts, bounds = _starts(problem, draws), problem.parameters.fitted_bounds
    scales = reading_sd(problem.board.setups, median_noise(draws))
    target, modes = log_measured(problem.board), same_modes(problem.board)
    return prediction_errors(predict, target, misfit, starts, bounds, modes, scales)


def carried_in_fit(inference: Inference, errors: Errors) -> tuple[CarryingMode, ...]:
    """The modes that alone carry a constant or a size of a fit."""
    board = inference.problem.board
    names = (*board.symmetry.moduli, *(one.effect or one.name for one in board.uncertain))
    return carrying_modes(board, errors.leverages, names)


def median_noise(draws: Draws) -> NDArray[np.float64]:
    """The posterior's median noise of each setup: (n_setups,) array, relative."""
    return np.asarray(np.median(draws.noise.reshape(-1, draws.noise.shape[-1]), axis=0))


def _starts(problem: PosedProblem, draws: Draws) -> NDArray[np.float64]:
    """Where fits may begin: the centre and, as Student's likelihood has several peaks, draws: (n_starts, n_free)."""
    theta = problem.centre[None, :]
    if problem.posterior.robust:
        theta = np.concatenate([theta, draws.flat[:: max(1, len(draws.flat) // _N_STARTS)]])
    return np.asarray(theta[:, problem.parameters.fitted_columns])
