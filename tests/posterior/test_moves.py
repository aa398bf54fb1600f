"""Independent proposals: the mixture that they are drawn from, and the posterior kept by the move."""

from __future__ import annotations

import numpy as np
from scipy import stats
from statistics_checks import differences_from_normal

from bayesplate.posterior.convergence import autocorrelation_times
from bayesplate.posterior.mixture import DEGREES_OF_FREEDOM, N_PARTS, Mixture
from bayesplate.posterior.moves import IndependentMove

MEAN = np.array([1.0, -2.0, 1e3])
COVARIANCE = np.array([[2.0, 0.6, 10.0], [0.6, 1.0, -5.0], [10.0, -5.0, 400.0]])
TARGET = stats.multivariate_normal(MEAN, COVARIANCE)
SD = np.sqrt(np.diagonal(COVARIANCE))
N_WALKERS, N_STEPS = 32, 600


def log_density(points):
    return np.atleast_1d(TARGET.logpdf(points))


def one_student():
    shape = COVARIANCE * (DEGREES_OF_FREEDOM - 2) / DEGREES_OF_FREEDOM
    return stats.multivariate_t(MEAN, shape, DEGREES_OF_FREEDOM)


def banana(n, seed):
    """Draws that no single ellipsoid fits."""
    draws = np.random.default_rng(seed).standard_normal((n, 2))
    draws[:, 1] += draws[:, 0] ** 2
    return draws


def test_the_log_density_of_one_part_is_that_of_the_student_distribution():
    points = one_student().rvs(50, random_state=np.random.default_rng(3))
    found = Mixture.with_covariance(MEAN, COVARIANCE).log_density(points)
    np.testing.assert_allclose(found, one_student().logpdf(points), atol=1e-6)


def test_one_distribution_fitted_to_draws_has_their_mean_and_covariance():
    draws = np.random.default_rng(3).multivariate_normal(MEAN, COVARIANCE, (4, 25, 32))
    found = Mixture.fitted_single(draws)
    (centre,), (factor,) = found.centres, found.factors
    flat = draws.reshape(-1, 3)
    scale = factor @ factor.T * DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2)
    np.testing.assert_allclose(centre, flat.mean(axis=0))
    np.testing.assert_allclose(scale, np.cov(flat.T), rtol=1e-8)


def test_a_mixture_is_normalised_and_its_points_follow_it():
    """Importance weights of a known density have a mean of one, with an error that they tell themselves."""
    mixture = Mixture.fitted(banana(3000, seed=1))
    assert len(mixture.weights) == N_PARTS
    points = mixture.points(20_000, np.random.default_rng(5))
    weights = np.exp(one_density(points) - mixture.log_density(points))
    assert abs(weights.mean() - 1.0) < 4 * weights.std() / np.sqrt(len(weights))


def one_density(points):
    return stats.norm.logpdf(points[:, 0]) + stats.norm.logpdf(points[:, 1] - points[:, 0] ** 2)


def test_a_mixture_fits_a_curved_posterior_better_than_one_distribution():
    """By the mean log density at draws that neither has seen, beyond four errors of the difference."""
    train, unseen = banana(3000, seed=1), banana(3000, seed=2)
    gain = Mixture.fitted(train).log_density(unseen) - Mixture.fitted_single(train).log_density(unseen)
    assert gain.mean() > 4 * gain.std() / np.sqrt(len(gain))


def test_few_draws_get_one_distribution():
    assert len(Mixture.fitted(banana(60, seed=1)).weights) == 1


def test_a_wider_mixture_has_half_its_points_farther_out():
    """Squared distances of the wider half are four times as large; densities are those of the mean of both."""
    mixture = Mixture.with_covariance(MEAN, COVARIANCE)
    wider = mixture.widened(2.0)
    points = mixture.points(50, np.random.default_rng(3))
    (near, far) = wider.squared_distances(points)
    np.testing.assert_allclose(near, 4.0 * far)
    outer = Mixture.with_covariance(MEAN, 4.0 * COVARIANCE)
    both = np.logaddexp(mixture.log_density(points), outer.log_density(points)) - np.log(2.0)
    np.testing.assert_allclose(wider.log_density(points), both, atol=1e-6)


class Blind(Mixture):
    """A mixture that does not know its own density."""

    def log_density(self, points):
        return np.zeros(points.shape[:-1])


def walked(mixture, density=log_density):
    """An ensemble that makes independent moves alone, from draws of the mixture."""
    import emcee

    sampler = emcee.EnsembleSampler(N_WALKERS, 3, density, moves=IndependentMove(mixture), vectorize=True)
    sampler._random.seed(5)
    sampler.run_mcmc(mixture.points(N_WALKERS, np.random.default_rng(5)), N_STEPS, skip_initial_state_check=True)
    return sampler.get_chain(discard=100)


def off(kind=Mixture):
    """A mixture that lies beside the posterior."""
    centre, factor = MEAN + 0.5 * SD, np.linalg.cholesky(1.5 * COVARIANCE)
    return kind(np.ones(1), centre[None], factor[None])


def told(chain):
    ess = chain.shape[0] * N_WALKERS / autocorrelation_times(chain)
    return differences_from_normal(chain.reshape(-1, 3), ess, MEAN, SD)


def test_the_posterior_is_kept_by_proposals_from_beside_it_whose_density_is_known():
    assert told(walked(off())) == []
    assert told(walked(off(Blind)))  # control


def test_proposals_of_many_steps_are_evaluated_in_one_call():
    asked = []

    def counted(points):
        asked.append(len(points))
        return log_density(points)

    walked(off(), counted)
    assert asked == [N_WALKERS, *[16 * N_WALKERS] * -(-N_STEPS // 16)]
