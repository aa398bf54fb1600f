"""The independent proposal is the Student distribution it claims to be, and only then leaves a posterior unchanged."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from bayesplate.posterior.moves import DEGREES_OF_FREEDOM, Proposal

MEAN = np.array([1.0, -2.0, 1e3])
COVARIANCE = np.array([[2.0, 0.6, 10.0], [0.6, 1.0, -5.0], [10.0, -5.0, 400.0]])
N_STEPS = 4000


def student():
    shape = COVARIANCE * (DEGREES_OF_FREEDOM - 2) / DEGREES_OF_FREEDOM
    return stats.multivariate_t(MEAN, shape, DEGREES_OF_FREEDOM)


def test_the_log_density_is_that_of_the_student_distribution_up_to_a_constant():
    rng = np.random.default_rng(3)
    points = student().rvs(50, random_state=rng)
    difference = Proposal.with_covariance(MEAN, COVARIANCE).log_density(points) - student().logpdf(points)
    assert np.ptp(difference) < 1e-6


def test_a_proposal_fitted_to_draws_has_their_mean_and_covariance():
    rng = np.random.default_rng(3)
    draws = rng.multivariate_normal(MEAN, COVARIANCE, (4, 25, 32))
    proposal = Proposal.fitted(draws)
    flat = draws.reshape(-1, 3)
    scale = proposal.factor @ proposal.factor.T * DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2)
    np.testing.assert_allclose(proposal.centre, flat.mean(axis=0))
    np.testing.assert_allclose(scale, np.cov(flat.T), rtol=1e-8)


def test_proposed_points_follow_the_density():
    """Mahalanobis distances of a t distribution in three dimensions: d^2 / 3 follows F(3, degrees of freedom)."""
    random = np.random.Generator(np.random.MT19937(5))
    proposal = Proposal.with_covariance(MEAN, COVARIANCE)
    points, _ = proposal(np.tile(MEAN, (20_000, 1)), random)
    z = np.linalg.solve(proposal.factor, (points - MEAN).T)
    assert stats.kstest((z**2).sum(axis=0) / 3, stats.f(3, DEGREES_OF_FREEDOM).cdf).pvalue > 1e-3


@pytest.mark.parametrize(("power", "holds"), [(1.0, True), (0.0, False)])
def test_the_ratio_of_proposals_is_what_keeps_the_target(power, holds):
    """Independence sampling of a normal twice as narrow; without the ratio the draws keep the proposal's width."""
    random = np.random.Generator(np.random.MT19937(7))
    target = stats.multivariate_normal(MEAN, COVARIANCE / 4)
    proposal = Proposal.with_covariance(MEAN, COVARIANCE)
    coords = np.tile(MEAN, (64, 1))
    kept = []
    for _ in range(N_STEPS // 64 * 4):
        points, log_ratio = proposal(coords, random)
        log_accept = target.logpdf(points) - target.logpdf(coords) + power * log_ratio
        coords = np.where((np.log(random.random(64)) < log_accept)[:, None], points, coords)
        kept.append(coords)
    draws = np.concatenate(kept[20:])
    z = (draws - MEAN) / np.sqrt(np.diagonal(COVARIANCE / 4))
    # About 15 000 draws, some 5 steps apart in effect: the standard error of a variance is near sqrt(2 / 3000).
    assert np.all(np.abs(z.var(axis=0) - 1.0) < 5 * np.sqrt(2 / 3000)) == holds
