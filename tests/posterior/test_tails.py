"""The sampled coordinates: the same density, with its tails drawn in."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.posterior.tails import TailCoordinates

CENTRE = np.array([0.7, -2.0, 5.0])
COVARIANCE = np.array([[0.04, 0.005, 0.0], [0.005, 0.01, 0.001], [0.0, 0.001, 1.0]])


@pytest.fixture
def coordinates():
    """Two of three columns changed."""
    return TailCoordinates.around(CENTRE, COVARIANCE, [0, 1])


def test_only_the_given_columns_change(coordinates):
    y = np.random.default_rng(0).normal(size=(4, 3, 3))
    theta = coordinates.theta(y)
    assert theta.shape == y.shape
    assert np.array_equal(theta[..., 2], y[..., 2])
    assert np.arcsinh((theta[..., :2] - CENTRE[:2]) / coordinates.scale) == pytest.approx(y[..., :2], rel=1e-12)
    assert coordinates.y(theta) == pytest.approx(y, rel=1e-12)
    assert coordinates.theta(coordinates.start) == pytest.approx(CENTRE, rel=1e-15)


def test_the_density_is_that_of_theta_times_the_determinant_of_the_map(coordinates):
    def log_density(theta):
        return -((theta - 0.3) ** 2).sum(axis=1)

    step = 1e-5
    for y in np.random.default_rng(1).normal(size=(5, 3)):
        columns = [(coordinates.theta(y + e) - coordinates.theta(y - e)) / (2 * step) for e in step * np.eye(3)]
        log_determinant = np.log(np.linalg.det(np.stack(columns, axis=1)))
        # differences: step^2 times a curvature
        assert coordinates.log_jacobian(y) == pytest.approx(log_determinant, abs=1e-8)
        expected = log_density(coordinates.theta(y)[None]) + log_determinant
        assert coordinates.density(log_density)(y[None]) == pytest.approx(expected, abs=1e-8)


def test_the_starts_have_the_covariance_of_the_estimate(coordinates):
    inverse = np.diag([*(1.0 / coordinates.scale), 1.0])
    assert coordinates.start_covariance(COVARIANCE) == pytest.approx(inverse @ COVARIANCE @ inverse, rel=1e-14)


def test_a_parameter_of_an_effect_starts_three_standard_deviations_wide():
    """Three standard deviations of the starts in y are three of the estimate in theta, whatever the scale."""
    coordinates = TailCoordinates.around(CENTRE, COVARIANCE, [0], [2])
    y = coordinates.start
    y[2] = 3.0 * np.sqrt(coordinates.start_covariance(COVARIANCE)[2, 2])
    wanted = CENTRE[2] + 3.0 * np.sqrt(COVARIANCE[2, 2])
    assert coordinates.theta(y) == pytest.approx([*CENTRE[:2], wanted], rel=1e-12)


def test_beyond_every_prior_there_is_nothing_and_no_overflow(coordinates):
    y = np.array([[10.0, 0.0, 0.0], [0.0, -800.0, 0.0], [0.0, 0.0, 800.0]])
    found = coordinates.density(lambda theta: np.zeros(len(theta)))(y)
    assert found[0] == found[1] == -np.inf
    assert found[2] == pytest.approx(np.log(coordinates.scale).sum())
