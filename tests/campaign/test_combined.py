"""What several boards say of what they share, against closed forms: linear boards with Gaussian errors."""

from __future__ import annotations

import numpy as np
import pytest
from linear_boards import exactly_together, joint_posterior, linear_boards, log_evidence, standard_shared

from bayesplate.campaign.combined import FEWEST_POINTS, CombinedBoards, sample_shared
from bayesplate.campaign.likelihood import SharedLikelihood
from bayesplate.campaign.normal_likelihood import NormalLikelihood
from bayesplate.posterior.sampling import SamplerSettings

N = 6000


def together_of(boards, rng):
    """What the machinery makes of linear boards, from nothing but draws and each one's evidence."""
    shared = standard_shared(boards[0].shared.shape[1])
    weights = np.full(N, 1 / N)
    drawn = [one.draws(rng, N)[1] for one in boards]

    def log_prior(z):
        return np.sum([one.prior.log_prior(z[:, i]) for i, one in enumerate(shared)], axis=0)

    found = [
        SharedLikelihood.from_draws(z, weights, N, log_prior, log_evidence([one]))
        for one, z in zip(boards, drawn, strict=True)
    ]
    names = [f"board {i}" for i in range(len(boards))]
    return CombinedBoards.of(shared, names, found, [NormalLikelihood.of_draws(z, weights) for z in drawn])


def tolerance(together):
    """Four standard errors of a mean of all boards, in its own standard deviations.

    The slope of a board's log likelihood errs by sqrt((1 + q) / N) in units of that board's own spread, q being the
    squared distance from its middle: one for each shared number, on average.
    """
    return 4.0 * np.sqrt((1.0 + len(together.shared)) / N)


def test_all_boards_and_all_but_one_are_the_closed_form():
    rng = np.random.default_rng(13)
    boards = linear_boards(rng, 5, 3, [1.2, -0.7, 0.4])
    together = together_of(boards, rng)

    for without in [(), (0,), (3,)]:
        kept = [one for i, one in enumerate(boards) if i not in without]
        mean, covariance = joint_posterior(kept)
        found_mean, found_covariance = together.moments(without)
        sd = np.sqrt(np.diagonal(covariance))
        assert np.abs((found_mean - mean) / sd).max() < tolerance(together)
        assert np.abs(np.sqrt(np.diagonal(found_covariance)) / sd - 1.0).max() < tolerance(together)
        assert together.log_evidence(without) == pytest.approx(log_evidence(kept), abs=0.15)


def test_the_walk_has_the_moments_of_the_sums():
    rng = np.random.default_rng(3)
    together = exactly_together(linear_boards(rng, 4, 2, [1.2, -0.7]))
    chains, convergence = sample_shared(together, SamplerSettings(seed=1))
    mean, covariance = together.moments()
    sd = np.sqrt(np.diagonal(covariance))

    assert convergence.passed
    assert np.abs((chains.pooled.mean(axis=0) - mean) / sd * np.sqrt(convergence.ess)).max() < 4.0
    assert np.abs(chains.pooled.std(axis=0) / sd - 1.0).max() < 4.0 / np.sqrt(2 * convergence.ess.min())


def test_points_find_their_way_to_where_the_boards_are():
    """The boards are sharp, and the normal likelihoods that the points are laid out by say nothing of them."""
    rng = np.random.default_rng(6)
    boards = linear_boards(rng, 4, 2, [2.5, -2.0], sd=0.01)
    nothing = NormalLikelihood(np.zeros((2, 2)), np.zeros(2))
    together = CombinedBoards.of(standard_shared(2), [f"board {i}" for i in range(4)], boards, [nothing] * 4)
    mean, covariance = joint_posterior(boards)
    found_mean, found_covariance = together.moments()
    sd = np.sqrt(np.diagonal(covariance))

    assert together.fewest_points >= FEWEST_POINTS
    assert np.abs((found_mean - mean) / sd).max() < 0.05
    assert np.abs(np.sqrt(np.diagonal(found_covariance)) / sd - 1.0).max() < 0.05
