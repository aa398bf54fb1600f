"""Errors of the weighted least-squares fit at the posterior's noise: in sample, and each mode left out in turn."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.leave_one_out import Errors, prediction_errors
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.region import predictor


def mode_errors(inference: Inference, draws: Draws) -> Errors:
    """Errors of the weighted least-squares fit under the exact law, in sample and left out.

    One estimator for both, at the posterior's median noise; uncertain inputs move within their priors. The posterior
    itself may lie closer to a reading that is coarsely rounded, because it knows the interval.
    """
    problem = inference.problem
    predict = predictor(problem.board, problem.posterior.models, "exact", problem.centre)
    start = problem.centre[problem.parameters.fitted_columns]
    scales = reading_scales(inference, draws)
    bounds = problem.parameters.fitted_bounds
    return prediction_errors(predict, log_measured(problem.board), scales, start, bounds)


def reading_scales(inference: Inference, draws: Draws) -> NDArray[np.float64]:
    """Relative uncertainty of each reading at the posterior's median noise: (n_modes,) array."""
    medians = np.median(draws.noise.reshape(-1, draws.noise.shape[-1]), axis=0)
    setups = inference.problem.board.setups
    return np.concatenate([np.hypot(m, setup.relative_sd) for m, setup in zip(medians, setups, strict=True)])
