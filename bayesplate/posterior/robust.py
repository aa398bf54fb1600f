"""The highest peak of the likelihood under Student's errors: constants that most readings agree on despite an outlier.

Under normal errors one wrong reading pulls the constants. Under Student's errors the likelihood has a second peak,
where the noise is small and that reading is an outlier; a sampler that starts at the first peak does not find it. Both
peaks are searched for to first order, from the constants of all readings and from those of all readings but one.
"""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.estimates.least_squares import Estimate
from bayesplate.frequencies.reading_errors import STUDENT, reading_sd

_NOISE_SDS = np.linspace(-1.0, 10.0, 23)
_N_STEPS = 60


def most_likely_student(board: Board, estimate: Estimate) -> tuple[Floats, Floats]:
    """Rigidities (3,), N m, and relative noise (n_setups,) most probable under Student's errors, to first order.

    `estimate` is by weighted least squares of all readings.
    """
    residuals, slopes = estimate.residuals, board.symmetry.along(estimate.sensitivities)
    noises = np.stack([setup.noise.median * np.exp(setup.noise.log_sd * _NOISE_SDS) for setup in board.setups], axis=1)
    scales = np.stack([reading_sd(board.setups, noise) for noise in noises])[:, None, :]
    inclusion = np.concatenate([np.ones((1, residuals.size)), 1.0 - np.eye(residuals.size)])
    steps = _least_squares_steps(inclusion / scales**2, slopes, residuals)
    for _ in range(_N_STEPS):
        steps = _least_squares_steps(
            student_weights((residuals - steps @ slopes.T) / scales) / scales**2, slopes, residuals
        )
    z = (residuals - steps @ slopes.T) / scales
    information = _information(student_weights(z) / scales**2, slopes)
    log_density = np.sum(STUDENT.log(z) - np.log(scales), axis=-1) - 0.5 * np.linalg.slogdet(information)[1]
    log_density -= 0.5 * _NOISE_SDS[:, None] ** 2
    level, start = np.unravel_index(np.argmax(log_density), log_density.shape)
    factors = np.exp(steps[level, start])[list(board.symmetry.follows)]
    return estimate.rigidities * factors, noises[level]


def student_weights(z: Floats) -> Floats:
    """Weights of readings for which least squares has its optimum where Student's likelihood has it: 0 to 1.25."""
    return np.asarray(STUDENT.slope(z) / np.where(z == 0.0, 1.0, z) + STUDENT.curvature * (z == 0.0))


def _least_squares_steps(weights: Floats, slopes: Floats, residuals: Floats) -> Floats:
    """Steps of weighted least squares: (..., n_constants) array."""
    projections = np.einsum("...i,ij,i->...j", weights, slopes, residuals)
    return np.asarray(np.linalg.solve(_information(weights, slopes), projections[..., None])[..., 0])


def _information(weights: Floats, slopes: Floats) -> Floats:
    """Information of the readings on ln D: (..., n_constants, n_constants), slightly increased to be invertible."""
    information = np.einsum("ij,...i,ik->...jk", slopes, weights, slopes)
    trace = np.trace(information, axis1=-2, axis2=-1)[..., None, None]
    return np.asarray(information + 1e-9 * trace * np.eye(slopes.shape[1]))
