"""Draws of a fit, weighted to the linear normal case of its board, against the closed form of that case."""

from __future__ import annotations

import numpy as np
import pytest
import ritz
from conjugate import conjugate, rigidity_prior, sampled, stated
from made_boards import CANTILEVER_LABELS, board_of, setup_of, with_noise
from normal_case import NormalCase, differences, draws_of

from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import pose
from bayesplate.posterior.sampling import SamplerSettings


@pytest.fixture(scope="module")
def fitted():
    """A fit of a simulated board: rounded readings, unknown noise, an uncertain thickness, the plate's own law."""
    hertz = with_noise(ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS), 0.004, np.random.default_rng(1), resolution=1.0)
    thickness = Quantity.from_mean(3e-3, 3e-5)
    board = board_of(ritz.FINNISH, [setup_of(ritz.CANTILEVER, hertz, resolution=1.0)], thickness=thickness)
    return infer(pose(board, load_prior("spruce"), law="linear"), SamplerSettings(seed=3))


def moved(inference, theta):
    """In what draws that were moved differ; their log posterior is that of where they are."""
    posterior = inference.problem.posterior
    log_posterior = posterior(theta.reshape(-1, theta.shape[-1])).reshape(theta.shape[:-1])
    return differences(NormalCase.of(inference.problem), theta, log_posterior)


def test_right_draws_agree(fitted):
    board, law, _, mean, covariance = conjugate(seed=1)
    its_own_case = sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=2)
    for inference in (its_own_case, fitted):
        assert differences(NormalCase.of(inference.problem), *draws_of(inference)) == []


def test_control_draws_that_were_moved_differ(fitted):
    theta, log_posterior = draws_of(fitted)
    middle = theta.mean(axis=(0, 1, 2))
    for factor in (1.15, 0.7):
        found = moved(fitted, middle + factor * (theta - middle))
        assert [one for one in found if one.startswith("standard deviation of ln D_")], factor
    quieter = theta - 0.2 * (np.arange(theta.shape[-1]) == 3)
    assert [one for one in moved(fitted, quieter) if one.startswith("mean of ln noise")]
    exchanged = theta[..., [1, 0, *range(2, theta.shape[-1])]]
    assert moved(fitted, exchanged)
    assert differences(NormalCase.of(fitted.problem), exchanged, log_posterior)


def test_control_draws_of_a_posterior_without_one_mode_differ(fitted):
    """The draws have seen the mode; the density that they are said to have has not."""
    theta, log_posterior = draws_of(fitted)
    of_modes = fitted.problem.posterior.log_likelihood(theta.reshape(-1, theta.shape[-1]))
    for mode in range(6):
        without = log_posterior - of_modes[:, mode].reshape(log_posterior.shape)
        found = differences(NormalCase.of(fitted.problem), theta, without)
        assert found, mode
        assert not any("draws count" in one for one in found), mode
