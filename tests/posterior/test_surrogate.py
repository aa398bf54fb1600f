"""The law between linear and exact: its error is as stated, a wrong one is caught, and the posterior is the law's."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.frequencies.laws import cents
from bayesplate.posterior.inference import infer, pose
from bayesplate.posterior.parameters import N_RIGIDITIES
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.surrogate import Surrogate, find_surrogate, serves, with_surrogate
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import LINEAR_SHARE
from bayesplate.workflow.prepare import prepare

BOARD = "finnish-spruce-cantilever"


@pytest.fixture(scope="module")
def problem():
    prepared = prepare(BOARD)
    return pose(prepared.board, prepared.prior)


@pytest.fixture(scope="module")
def inference(problem):
    return infer(problem, SamplerSettings(seed=5))


def found(problem):
    coordinates = TailCoordinates.around(
        problem.centre, problem.covariance, range(N_RIGIDITIES), problem.parameters.effect_columns
    )
    return find_surrogate(problem.posterior, problem.centre, problem.covariance, coordinates)


def noise_cents(problem):
    (setup,) = problem.board.setups
    return float(cents(setup.noise.median))


def test_the_stated_error_is_that_at_draws_of_the_posterior(problem, inference):
    """The largest rms of a mode, over the chain, to a factor of two: both hang on a few draws in the tails."""
    draws = inference.chains.pooled[::20]
    exact = np.concatenate(problem.posterior.log_frequencies(draws), axis=1)
    errors = cents(inference.surrogate.log_frequencies(draws) - exact)
    rms, stated = (np.sqrt(np.mean(e**2, axis=0)).max() for e in (errors, inference.surrogate.errors))
    assert 0.5 * stated < rms < 2 * stated
    assert rms < LINEAR_SHARE * noise_cents(problem)


def test_only_the_frequencies_are_the_surrogates(problem, inference):
    """Prior and likelihood are the posterior's own: exact frequencies put in give its density."""
    draws = inference.chains.pooled[:20]
    exact = np.concatenate(problem.posterior.log_frequencies(draws), axis=1)

    class Exact(Surrogate):
        def log_frequencies(self, theta):
            return exact

    known = Exact(**vars(inference.surrogate))
    np.testing.assert_allclose(with_surrogate(problem.posterior, known)(draws), problem.posterior(draws), rtol=1e-10)


@pytest.mark.parametrize(("share", "does"), [(0.9 * LINEAR_SHARE, True), (1.1 * LINEAR_SHARE, False), (1.0, False)])
def test_one_mode_off_by_a_share_of_the_noise_decides(problem, share, does):
    errors = np.zeros((100, len(problem.board.setups[0].readings)))
    errors[:, 2] = share * noise_cents(problem)
    assert serves(problem.posterior, errors) == does


def test_a_surrogate_wrong_by_one_noise_level_is_caught_and_the_exact_law_serves_alone(problem, monkeypatch):
    right = Surrogate.log_frequencies
    off = np.zeros(len(problem.board.setups[0].readings))
    off[2] = problem.board.setups[0].noise.median

    monkeypatch.setattr(Surrogate, "log_frequencies", lambda self, theta: right(self, theta) + off)
    assert found(problem) is None
    assert infer(problem, SamplerSettings(seed=5, max_steps=50)).surrogate is None


def test_a_law_that_was_asked_for_serves_alone(problem):
    for law in ("exact", "linear"):
        forced = pose(problem.board, problem.prior, law=law)
        assert forced.is_forced
        assert infer(forced, SamplerSettings(seed=5, max_steps=50)).surrogate is None
    assert infer(problem, SamplerSettings(seed=5, max_steps=50)).surrogate is not None


def test_with_and_without_a_surrogate_the_posterior_is_the_same(problem, inference):
    """Means and deciles of ln D within four Monte Carlo errors."""
    alone = infer(pose(problem.board, problem.prior, law="exact"), SamplerSettings(seed=6))
    assert inference.convergence.passed
    assert alone.convergence.passed
    first, second = (i.chains.pooled[:, :N_RIGIDITIES] for i in (inference, alone))
    inverse_ess = sum(1.0 / i.convergence.ess[:N_RIGIDITIES] for i in (inference, alone))
    assert np.all(np.abs(first.mean(axis=0) - second.mean(axis=0)) < 4 * second.std(axis=0) * np.sqrt(inverse_ess))
    for p in (0.05, 0.25, 0.5, 0.75, 0.95):
        below = (first < np.quantile(second, p, axis=0)).mean(axis=0)
        assert np.all(np.abs(below - p) < 4 * np.sqrt(p * (1 - p) * inverse_ess))
