"""Draws of a fit, weighted to the linear normal case of its board, against the closed form of that case."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from conjugate import NOISE, conjugate, rigidity_prior, sampled, stated
from made_boards import CANTILEVER_LABELS, board_of, setup_of, with_noise
from normal_case import NormalCase, differences, draws_of

from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import pose
from bayesplate.posterior.sampling import SamplerSettings


@pytest.fixture(scope="module")
def conjugate_case():
    """A posterior that is its own normal case."""
    board, law, _, mean, covariance = conjugate(seed=1)
    return sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=2), mean, covariance


@pytest.fixture(scope="module")
def fitted():
    """A fit of a simulated board: rounded readings, unknown noise, an uncertain thickness, the plate's own law."""
    hertz = with_noise(ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS), 0.004, np.random.default_rng(1), resolution=1.0)
    thickness = Quantity.from_mean(3e-3, 3e-5)
    board = board_of(ritz.FINNISH, [setup_of(ritz.CANTILEVER, hertz, resolution=1.0)], thickness=thickness)
    return infer(pose(board, load_prior("spruce"), law="linear"), SamplerSettings(seed=3))


def test_the_normal_case_of_a_conjugate_board_is_its_closed_form(conjugate_case):
    inference, mean, covariance = conjugate_case
    found, spread = NormalCase.of(inference.problem).given_noise(np.log([[NOISE]]))

    assert found[0] == pytest.approx(mean, abs=1e-6)
    assert spread[0] == pytest.approx(covariance, rel=1e-6)


def test_the_normal_case_differs_from_a_conjugate_posterior_by_a_constant(conjugate_case):
    problem = conjugate_case[0].problem
    theta = draws_of(conjugate_case[0])[0].reshape(-1, problem.parameters.n_dim)[-500:]
    ratio = NormalCase.of(problem).log_density(theta) - problem.posterior(theta)

    assert np.ptp(ratio) < 1e-5


def test_the_noise_given_the_constants_is_normalised_by_hand():
    """One setup, six readings: the deviate of the median of the density, by a grid of its own, is zero."""
    board, law, _, mean, covariance = conjugate(seed=1)
    problem = stated(board, rigidity_prior(), law, mean, covariance)
    case = NormalCase.of(problem)
    wide = replace(case.parameters.noises[0], prior=Quantity.from_median(NOISE, 1.6))
    case.parameters.__dict__["noises"] = (wide,)
    grid = np.linspace(np.log(NOISE) - 3.0, np.log(NOISE) + 3.0, 20_001)
    theta = np.tile(np.r_[mean, 0.0], (grid.size, 1))
    theta[:, 3] = grid
    density = np.exp(case.log_density(theta) - case.log_density(theta).max())
    median = np.interp(0.5, np.cumsum(density) / density.sum(), grid)

    assert case.noise_deviates(np.r_[mean, median][None]) == pytest.approx(0.0, abs=5e-3)


def moved(inference, theta):
    """In what draws that were moved differ; their log posterior is that of where they are."""
    posterior = inference.problem.posterior
    log_posterior = posterior(theta.reshape(-1, theta.shape[-1])).reshape(theta.shape[:-1])
    return differences(NormalCase.of(inference.problem), theta, log_posterior)


def test_right_draws_agree(conjugate_case, fitted):
    for inference in (conjugate_case[0], fitted):
        assert differences(NormalCase.of(inference.problem), *draws_of(inference)) == []


@pytest.mark.parametrize("factor", [1.15, 0.7], ids=["spread too far", "too close together"])
def test_control_draws_of_another_width_differ(fitted, factor):
    theta, _ = draws_of(fitted)
    middle = theta.mean(axis=(0, 1, 2))

    found = moved(fitted, middle + factor * (theta - middle))
    assert [one for one in found if one.startswith("standard deviation of ln D_")]


@pytest.mark.parametrize("is_stale", [False, True])
def test_control_exchanged_constants_differ(fitted, is_stale):
    theta, log_posterior = draws_of(fitted)
    theta = theta[..., [1, 0, *range(2, theta.shape[-1])]]
    case = NormalCase.of(fitted.problem)

    assert differences(case, theta, log_posterior) if is_stale else moved(fitted, theta)


def test_control_a_noise_that_is_too_low_differs(fitted):
    theta = draws_of(fitted)[0].copy()
    theta[..., 3] -= 0.2
    assert [one for one in moved(fitted, theta) if one.startswith("mean of ln noise")]


@pytest.mark.parametrize("mode", range(6))
def test_control_draws_of_a_posterior_without_one_mode_differ(fitted, mode):
    """The draws have seen the mode; the density that they are said to have has not."""
    theta, log_posterior = draws_of(fitted)
    of_modes = fitted.problem.posterior.log_likelihood(theta.reshape(-1, theta.shape[-1]))
    without = log_posterior - of_modes[:, mode].reshape(log_posterior.shape)
    found = differences(NormalCase.of(fitted.problem), theta, without)

    assert found
    assert not any("draws count" in one for one in found)
