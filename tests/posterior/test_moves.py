"""The steps of the walkers: independent ensembles in one call, and the posterior kept whatever the surrogate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from statistics_checks import differences_from_normal

from bayesplate.posterior.checkpoint import Chunk
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.ensembles import Learnt, advance, correcting, stepping
from bayesplate.posterior.moves import ORDERS, CorrectedSteps, differences, order_for, walk_order
from bayesplate.posterior.proposals import DEGREES_OF_FREEDOM, N_PARTS, Proposal
from bayesplate.posterior.sampling import SamplerSettings, sample
from bayesplate.posterior.starting import random_numbers

MEAN = np.array([1.0, -2.0, 1e3])
COVARIANCE = np.array([[2.0, 0.6, 10.0], [0.6, 1.0, -5.0], [10.0, -5.0, 400.0]])
TARGET = stats.multivariate_normal(MEAN, COVARIANCE)
SD = np.sqrt(np.diagonal(COVARIANCE))
N_ENSEMBLES, N_WALKERS, N_STEPS = 4, 16, 40


def log_density(points):
    return np.atleast_1d(TARGET.logpdf(points))


def evaluate(points):
    """The log density, and twice the points as what it finds on the way."""
    return log_density(points), 2.0 * points


def shifted(points):
    """A surrogate that is off by one standard deviation in the first parameter, and twice as wide."""
    return np.atleast_1d(stats.multivariate_normal(MEAN + np.array([SD[0], 0, 0]), 2 * COVARIANCE).logpdf(points))


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
    found = Proposal.with_covariance(MEAN, COVARIANCE).log_density(points)
    np.testing.assert_allclose(found, one_student().logpdf(points), atol=1e-6)


def test_one_distribution_fitted_to_draws_has_their_mean_and_covariance():
    draws = np.random.default_rng(3).multivariate_normal(MEAN, COVARIANCE, (4, 25, 32))
    found = Proposal.one_fitted(draws)
    (centre,), (factor,) = found.centres, found.factors
    flat = draws.reshape(-1, 3)
    scale = factor @ factor.T * DEGREES_OF_FREEDOM / (DEGREES_OF_FREEDOM - 2)
    np.testing.assert_allclose(centre, flat.mean(axis=0))
    np.testing.assert_allclose(scale, np.cov(flat.T), rtol=1e-8)


def test_a_mixture_is_normalised_and_its_points_follow_it():
    """Importance weights of a known density have a mean of one, with an error that they tell themselves."""
    mixture = Proposal.fitted(banana(3000, seed=1))
    assert len(mixture.weights) == N_PARTS
    points = mixture.points(20_000, np.random.default_rng(5))
    weights = np.exp(one_density(points) - mixture.log_density(points))
    assert abs(weights.mean() - 1.0) < 4 * weights.std() / np.sqrt(len(weights))


def one_density(points):
    return stats.norm.logpdf(points[:, 0]) + stats.norm.logpdf(points[:, 1] - points[:, 0] ** 2)


def test_a_mixture_fits_a_curved_posterior_better_than_one_distribution():
    """By the mean log density at draws that neither has seen, beyond four errors of the difference."""
    train, unseen = banana(3000, seed=1), banana(3000, seed=2)
    gain = Proposal.fitted(train).log_density(unseen) - Proposal.one_fitted(train).log_density(unseen)
    assert gain.mean() > 4 * gain.std() / np.sqrt(len(gain))


def test_few_draws_get_one_distribution():
    assert len(Proposal.fitted(banana(60, seed=1)).weights) == 1


def test_differences_of_an_archive_are_as_probable_as_their_opposites():
    archive = np.random.default_rng(1).standard_normal((20, 2)) ** 2
    found = differences(archive, 20_000, np.random.default_rng(2))
    assert np.all(np.abs(found.mean(axis=0)) < 4 * found.std(axis=0) / np.sqrt(len(found)))
    assert stats.ks_2samp(found[:, 0], -found[:, 0]).pvalue > 1e-3


@pytest.mark.parametrize("n_dim", [2, 5, 12])
def test_a_walk_reads_the_same_backwards(n_dim):
    for _, order in ORDERS:
        walk = walk_order(order, n_dim)
        assert walk == walk[::-1]
        assert set(walk) == {"I", "D"}


@pytest.mark.parametrize(("sd", "order"), [(0.5, "IIID"), (1.4, "IIID"), (1.6, "ID"), (2.1, "IDDD")])
def test_the_worse_the_proposal_the_fewer_steps_are_independent(sd, order):
    """Acceptance 2 Phi(-sd / sqrt 2): 0.72, 0.32, 0.26, 0.14."""
    assert order_for(sd * np.random.default_rng(0).standard_normal(10_000)) == order


def moves_of(which, ensembles):
    """The moves of some of four ensembles, from their own random numbers and archives."""
    draws = np.random.default_rng(0).multivariate_normal(MEAN, COVARIANCE, (N_ENSEMBLES, 20, N_WALKERS))
    rngs = [random_numbers(7, i, 2) for i in ensembles]
    chunk = Chunk(draws, log_density(draws), np.empty((*draws.shape[:-1], 0)))
    whole = Learnt.of([chunk], MEAN, COVARIANCE, rngs, True)
    learnt = Learnt(whole.proposal, whole.archives[ensembles])
    if which == "plain":
        return stepping(log_density, learnt, N_STEPS, N_WALKERS, rngs), draws[ensembles, -1]
    return correcting(shifted, evaluate, learnt, N_STEPS, N_WALKERS, rngs), draws[ensembles, -1]


@pytest.mark.parametrize("which", ["plain", "corrected"])
def test_four_ensembles_together_draw_what_each_draws_apart(which):
    def run(ensembles):
        move, coords = moves_of(which, ensembles)
        log_prob = log_density(coords.reshape(-1, 3)).reshape(coords.shape[:2])
        return advance(move, coords, log_prob, N_STEPS, 2.0 * coords if which == "corrected" else None)

    together = run([0, 1, 2, 3])
    assert together.draws.shape == (N_ENSEMBLES, N_STEPS, N_WALKERS, 3)
    for i in range(N_ENSEMBLES):
        alone = run([i])
        np.testing.assert_allclose(together.draws[i], alone.draws[0], rtol=1e-12)
        np.testing.assert_allclose(together.log_prob[i], alone.log_prob[0], rtol=1e-12)
    assert not np.array_equal(together.draws[0], together.draws[1])


def test_what_the_density_found_stays_with_the_draw_it_was_found_at():
    move, coords = moves_of("corrected", [0, 1, 2, 3])
    log_prob = log_density(coords.reshape(-1, 3)).reshape(coords.shape[:2])
    chunk = advance(move, coords, log_prob, N_STEPS, 2.0 * coords)
    np.testing.assert_array_equal(chunk.blobs, 2.0 * chunk.draws)
    moved = np.any(np.diff(chunk.draws, axis=1), axis=-1)
    assert moved.any()
    assert not moved.all()


def test_a_chunk_of_steps_asks_for_all_its_independent_proposals_in_one_call():
    asked = []

    def counted(points):
        asked.append(len(points))
        return log_density(points)

    rngs = [random_numbers(7, i, 0) for i in range(N_ENSEMBLES)]
    move = stepping(counted, Learnt.of([], MEAN, COVARIANCE, rngs, False), N_STEPS, N_WALKERS, rngs)
    coords = np.random.default_rng(0).multivariate_normal(MEAN, COVARIANCE, (N_ENSEMBLES, N_WALKERS))
    advance(move, coords, log_density(coords.reshape(-1, 3)).reshape(coords.shape[:2]), N_STEPS)
    assert asked == [3 * N_STEPS // 4 * N_ENSEMBLES * N_WALKERS, *[N_ENSEMBLES * N_WALKERS] * (N_STEPS // 4)]


@pytest.mark.parametrize("surrogate", [None, log_density, shifted])
def test_the_posterior_is_kept_whatever_the_surrogate(surrogate):
    settings = SamplerSettings(seed=3, gate=Gate(ess_min=4000))
    chains, convergence = sample(log_density, MEAN, COVARIANCE, settings, surrogate=surrogate)
    assert convergence.passed, convergence.reasons
    assert differences_from_normal(chains.pooled, convergence.ess, MEAN, SD) == []


def test_without_the_correction_the_draws_would_be_the_surrogates(monkeypatch):
    """Control of the test above: ends of walks that are all accepted follow the surrogate."""

    def uncorrected(self, model, state):
        next(self._is_direct)
        return self.walks.propose(model, state)

    monkeypatch.setattr(CorrectedSteps, "propose", uncorrected)
    settings = SamplerSettings(seed=3, gate=Gate(ess_min=4000))
    chains, convergence = sample(log_density, MEAN, COVARIANCE, settings, surrogate=shifted)
    assert differences_from_normal(chains.pooled, convergence.ess, MEAN, SD)


@pytest.mark.parametrize("seed", [1, 4])
def test_a_surrogate_that_is_blind_to_a_part_of_the_posterior_does_not_pass_in_silence(seed):
    """A tenth of the probability lies where the surrogate has none: some steps go there, and the gate sees it.

    Two thirds of the walkers would pass in silence for one of these seeds, half of them for the other.
    """
    away = 5.0

    def two_parts(points):
        logs = [np.log(w) - 0.5 * (points[:, 0] - at) ** 2 for w, at in ((0.9, 0.0), (0.1, away))]
        return np.logaddexp(*logs) - 0.5 * points[:, 1] ** 2

    def blind(points):
        return np.where(points[:, 0] < away / 2, -0.5 * np.sum(points**2, axis=1), -1e3)

    chains, convergence = sample(
        two_parts, np.zeros(2), np.eye(2), SamplerSettings(seed=seed, max_steps=500), surrogate=blind
    )
    assert np.any(chains.kept[..., 0] > away / 2)
    assert not convergence.passed
