"""Without a likelihood the sampler returns the prior: every parameter, and the truncation where no material exists."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of
from scipy import stats

from bayesplate.board.prior import load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.inference import infer
from bayesplate.posterior.posing import pose
from bayesplate.posterior.sampling import SamplerSettings
from bayesplate.posterior.statistics import thin_walker_major
from bayesplate.posterior.target import Posterior


@dataclass(frozen=True, eq=False, kw_only=True)
class WithoutReadings(Posterior):
    """The posterior of readings that say nothing."""

    def log_likelihood_of(self, mode_log_frequencies, theta):
        return np.zeros((len(theta), len(self.factors)))


@pytest.fixture(scope="module")
def drawn():
    """Draws of the sampler, thinned to independence, and independent draws of the prior: (n, n_dim) arrays."""
    hertz = ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS)
    inputs = {"thickness": Quantity.from_mean(3e-3, 1e-4), "poisson_xy": Quantity.from_mean(0.4, 0.08)}
    board = board_of(ritz.FINNISH, [setup_of(ritz.CANTILEVER, hertz)], **inputs)
    problem = pose(board, load_prior("spruce"), law="linear")
    posterior = problem.posterior
    silent = WithoutReadings(posterior.board, posterior.prior, posterior.models, "linear", posterior.robust)
    prior = posterior.prior_transform(np.random.default_rng(1).random((20_000, problem.parameters.n_dim)))
    prior = prior[np.isfinite(posterior.log_prior(prior))]
    problem = replace(problem, posterior=silent, centre=prior.mean(axis=0), covariance=np.cov(prior.T), is_forced=True)
    inference = infer(problem, SamplerSettings(seed=3, gate=Gate(tau_count_min=400.0)))
    assert inference.convergence.passed, inference.convergence.reasons
    chains = inference.chains
    apart = thin_walker_major(chains.draws, chains.burn_in, 6.0 * inference.convergence.tau_max)
    return apart.reshape(-1, prior.shape[1]), prior


def p_values(found, prior):
    return np.array([stats.ks_2samp(one, other).pvalue for one, other in zip(found.T, prior.T, strict=True)])


def test_the_sampler_returns_the_prior(drawn):
    """Each parameter, and the p-values of all of them together."""
    found = p_values(*drawn)

    assert found.size == 6
    assert found.min() * found.size > 0.01
    assert stats.kstest(found, "uniform").pvalue > 0.01


def test_another_prior_is_told_apart(drawn):
    """The negative control: each parameter a tenth of its spread too wide, or a fifth of it beside."""
    found, prior = drawn
    middle = prior.mean(axis=0)

    assert p_values(middle + 1.1 * (found - middle), prior).min() < 1e-3
    assert p_values(found + 0.2 * prior.std(axis=0), prior).max() < 0.05
