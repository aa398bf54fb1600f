"""The check of every fit against a closed form: it passes right draws, fails wrong ones, and says where it is blind."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import ritz
from conjugate import NOISE, conjugate, rigidity_prior, sampled, stated
from made_boards import CANTILEVER_LABELS, board_of, setup_of, with_noise
from scipy import stats

from bayesplate.cards import load_prior
from bayesplate.posterior.certificate import ALLOWED_ERRORS, FEWEST_EFFECTIVE, certify
from bayesplate.posterior.inference import infer, pose
from bayesplate.posterior.normal_case import NormalCase
from bayesplate.posterior.sampling import Chains, SamplerSettings
from bayesplate.posterior.target import Posterior
from bayesplate.quantities import Quantity


def with_draws(inference, draws, *, is_stale=False):
    """An inference of other draws; their log posterior is that of where they are, unless it is stale."""
    chains = inference.chains
    flat = draws.reshape(-1, draws.shape[-1])
    log_prob = chains.log_prob if is_stale else inference.problem.posterior(flat).reshape(chains.log_prob.shape)
    return replace(inference, chains=Chains(draws, log_prob, chains.burn_in))


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
    theta = conjugate_case[0].chains.pooled[-500:]
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


def test_draws_of_the_normal_case_are_of_its_density(fitted):
    """Both conditional distributions together are the joint one: deviates of independent draws are standard normal."""
    case = NormalCase.of(fitted.problem)
    theta = case.draws(3000, np.random.default_rng(4))
    deviates = np.concatenate([case.column_deviates(theta), case.noise_deviates(theta)], axis=1)

    assert all(stats.kstest(one, stats.norm.cdf).pvalue > 1e-3 for one in deviates.T)
    assert stats.kstest(1.15 * deviates[:, 0], stats.norm.cdf).pvalue < 1e-3  # the control


def test_right_draws_pass(conjugate_case, fitted):
    for inference in (conjugate_case[0], fitted):
        found = certify(inference, 1)
        assert found.applies, found
        assert found.passed, found
        assert found.comparisons == 5 * inference.problem.parameters.n_dim
        assert found.effective_draws >= FEWEST_EFFECTIVE


def test_a_conjugate_posterior_loses_no_draw(conjugate_case):
    inference, *_ = conjugate_case
    kept = inference.chains.pooled.shape[0]
    assert 0.5 * inference.convergence.ess_min < certify(inference, 1).effective_draws <= kept


def test_control_draws_that_spread_too_far_fail(fitted):
    draws = fitted.chains.draws
    middle = fitted.chains.pooled.mean(axis=0)
    found = certify(with_draws(fitted, middle + 1.15 * (draws - middle)), 1)

    assert found.applies
    assert found.passed is False
    assert found.worst_errors > ALLOWED_ERRORS


def test_control_draws_too_close_together_fail_and_cannot_excuse_themselves(fitted):
    draws = fitted.chains.draws
    middle = fitted.chains.pooled.mean(axis=0)
    found = certify(with_draws(fitted, middle + 0.7 * (draws - middle)), 1)

    assert found.applies
    assert found.passed is False


@pytest.mark.parametrize("is_stale", [False, True])
def test_control_exchanged_constants_fail(fitted, is_stale):
    order = [1, 0, *range(2, fitted.problem.parameters.n_dim)]
    found = certify(with_draws(fitted, fitted.chains.draws[..., order], is_stale=is_stale), 1)

    assert found.applies
    assert found.passed is False


def test_control_a_noise_that_is_too_low_fails(fitted):
    draws = fitted.chains.draws.copy()
    draws[..., 3] -= 0.2
    assert certify(with_draws(fitted, draws), 1).passed is False


@pytest.mark.parametrize("mode", range(6))
def test_control_draws_of_a_posterior_without_one_mode_fail(fitted, mode):
    """The draws have seen the mode; the density that they are said to have has not."""
    posterior = fitted.problem.posterior
    draws = fitted.chains.draws
    told = posterior.log_likelihood(draws.reshape(-1, draws.shape[-1]))[:, mode].reshape(fitted.chains.log_prob.shape)
    chains = Chains(draws, fitted.chains.log_prob - told, fitted.chains.burn_in)
    found = certify(replace(fitted, chains=chains), 1)
    assert found.passed is False, found


@dataclass(frozen=True, eq=False, kw_only=True)
class Nowhere(Posterior):
    """A posterior that has nothing where its normal case is."""

    def log_likelihood_of(self, every_log_frequency, theta):
        return np.full((len(theta), 1), -np.inf)


@dataclass(frozen=True, eq=False, kw_only=True)
class AtTheEdge(Posterior):
    """A prior that ends at the estimate."""

    def log_prior_constants(self, theta, values=None):
        return np.where(theta[:, 0] > 0.0, super().log_prior_constants(theta, values), -np.inf)


def test_where_there_is_no_normal_case_the_reason_is_told(fitted, monkeypatch):
    one = fitted.problem.posterior
    nowhere = Nowhere(one.board, one.prior, one.models, one.law)
    at_edge = AtTheEdge(one.board, one.prior, one.models, one.law)
    at = fitted.problem.centre.copy()
    at[0] = 0.0

    found = certify(replace(fitted, problem=replace(fitted.problem, posterior=nowhere)), 1)
    assert "100.0 % of the normal case lies where the posterior has next to nothing" in found.reason
    found = certify(replace(fitted, problem=replace(fitted.problem, posterior=at_edge, centre=at)), 1)
    assert "the prior ends next to the estimate" in found.reason

    def singular(*_: object) -> None:
        raise np.linalg.LinAlgError

    monkeypatch.setattr(NormalCase, "given_noise", singular)
    assert "no solution" in certify(fitted, 1).reason


def test_peaks_without_a_sure_label_have_no_normal_case(fitted):
    class WithPeaks:
        problem = replace(fitted.problem)

    object.__setattr__(WithPeaks.problem, "posterior", replace_peaks(fitted.problem.posterior))
    assert "which mode a peak is of is not sure" in certify(WithPeaks, 1).reason


def replace_peaks(posterior):
    """The same posterior that says it has peaks of which the label is not sure."""
    other = Posterior(posterior.board, posterior.prior, posterior.models, posterior.law)
    object.__setattr__(other, "peaks", (object(),))
    return other


def test_a_posterior_that_is_far_from_normal_is_said_to_be():
    """A clamped board whose stiffness along the grain has next to no say: its logarithm has a level tail."""
    from bayesplate.workflow.problem import Problem

    problem = Problem.from_card("fiemme-spruce-clamped").posed
    found = certify(infer(problem, SamplerSettings(seed=1)), 1)

    assert (found.applies, found.passed, found.worst_errors) == (False, None, None)
    assert "posterior" in found.reason
