"""The sampled coordinates: the same density, with its tails drawn in."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import integrate, stats

from bayesplate.posterior.tails import TailCoordinates

CENTRE = np.array([0.7, -2.0, 5.0])
COVARIANCE = np.array([[0.04, 0.005, 0.0], [0.005, 0.01, 0.001], [0.0, 0.001, 1.0]])
HEAVY = stats.t(2, loc=0.9, scale=0.1)
"""A target whose tails are many of its standard errors long, and not centred where the estimate is."""

REACH = 5.8  # of y: 50 units of ln D, beyond which less than 1e-5 of this target is left
QUADRATURE = 1e-5


@pytest.fixture
def coordinates():
    """Two of three columns changed."""
    return TailCoordinates.around(CENTRE, COVARIANCE, [0, 1])


@pytest.fixture
def line():
    """One parameter, changed."""
    return TailCoordinates.around(CENTRE[:1], COVARIANCE[:1, :1], [0])


def heavy(theta):
    return HEAVY.logpdf(theta[:, 0])


def probability_below(log_density, y):
    y_grid = np.linspace(-REACH, y, 40_001)
    return integrate.simpson(np.exp(log_density(y_grid[:, None])), x=y_grid)


def to_y(line, theta):
    return np.arcsinh((theta - line.centre[0]) / line.scale[0])


@pytest.mark.parametrize("probability", [1e-3, 0.05, 0.3, 0.5, 0.95, 0.999])
def test_the_density_in_y_has_the_quantiles_of_the_target(line, probability):
    found = probability_below(line.density(heavy), to_y(line, HEAVY.ppf(probability)))
    assert found == pytest.approx(probability, abs=QUADRATURE)


def test_the_density_in_y_is_normalised_and_without_the_jacobian_it_would_not_be(line):
    assert probability_below(line.density(heavy), REACH) == pytest.approx(1.0, abs=QUADRATURE)

    def forgetful(y):
        return heavy(line.theta(y)) + np.log(line.scale).sum()

    total = probability_below(forgetful, REACH)
    share = probability_below(forgetful, to_y(line, HEAVY.ppf(0.95))) / total
    assert abs(total - 1.0) > 1e3 * QUADRATURE
    assert abs(share - 0.95) > 1e3 * QUADRATURE


def test_only_the_given_columns_change(coordinates):
    y = np.random.default_rng(0).normal(size=(4, 3, 3))
    theta = coordinates.theta(y)
    assert theta.shape == y.shape
    assert np.array_equal(theta[..., 2], y[..., 2])
    assert np.arcsinh((theta[..., :2] - CENTRE[:2]) / coordinates.scale) == pytest.approx(y[..., :2], rel=1e-12)
    assert coordinates.theta(coordinates.start) == pytest.approx(CENTRE, rel=1e-15)


def test_the_jacobian_is_the_determinant_of_the_map(coordinates):
    step = 1e-5
    for y in np.random.default_rng(1).normal(size=(5, 3)):
        columns = [(coordinates.theta(y + e) - coordinates.theta(y - e)) / (2 * step) for e in step * np.eye(3)]
        determinant = np.linalg.det(np.stack(columns, axis=1))
        assert coordinates.log_jacobian(y) == pytest.approx(np.log(determinant), abs=1e-8)  # step^2 times a curvature


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
