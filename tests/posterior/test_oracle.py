"""The whole of `infer` against posteriors that are known: one in closed form, one by quadrature.

A difference is more Monte Carlo errors of a mean, a standard deviation or a quantile than chance allows. Each
comparison
is made again with a posterior that is wrong in a known way, which must differ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
import ritz
from conjugate import ESS, NOISE, closed_form, conjugate, fixed_noise, rigidity_prior, sampled, stated, unknown_noise
from made_boards import CANTILEVER_LABELS, board_of, setup_of, with_noise
from scipy import stats
from scipy.special import ndtr
from statistics_checks import Truth, differences, differences_from_normal

from bayesplate.board.prior import load_prior
from bayesplate.campaign.evidence import bridge_sampling
from bayesplate.posterior.posing import pose

THINNING_LOSS = 0.9
"""Share of the effective size that thinning to half an autocorrelation time leaves."""


@pytest.fixture(scope="module")
def known():
    board, law, data, mean, covariance = conjugate(seed=1)
    inference = sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=2)
    return inference, data, mean, covariance


def found_differences(inference, mean, covariance, draws=None):
    draws = inference.chains.pooled[:, :3] if draws is None else draws
    return differences_from_normal(draws, inference.convergence.ess[:3], mean, np.sqrt(np.diagonal(covariance)))


def test_a_normal_posterior_is_recovered(known):
    inference, _, mean, covariance = known
    assert inference.convergence.ess_min >= ESS
    assert found_differences(inference, mean, covariance) == []
    drawn = np.corrcoef(inference.chains.pooled[:, :3].T)[np.triu_indices(3, 1)]
    sd = np.sqrt(np.diagonal(covariance))
    true = (covariance / np.outer(sd, sd))[np.triu_indices(3, 1)]
    error = (1 - true**2) / np.sqrt(inference.convergence.ess[:3].min())
    assert np.all(np.abs(drawn - true) < 4 * error)


def test_the_thinned_draws_are_of_the_same_posterior(known):
    from bayesplate.posterior.statistics import thin_walker_major

    inference, _, mean, covariance = known
    every_second = max(4.0, inference.convergence.tau_max)  # half of it is the step; walkers forget in 3 or 4 steps
    thinned = thin_walker_major(inference.chains.draws, inference.chains.burn_in, every_second)
    flat = thinned.reshape(-1, 4)[:, :3]
    sd = np.sqrt(np.diagonal(covariance))
    n_kept = inference.chains.kept.shape[1]
    assert len(flat) <= len(inference.chains.pooled) * (n_kept // 2 + 1) / n_kept
    assert differences_from_normal(flat, THINNING_LOSS * inference.convergence.ess[:3], mean, sd) == []


def test_the_log_posterior_of_the_draws_is_that_of_theta(known):
    inference, *_ = known
    some = (slice(None), slice(-3, None))
    theta = inference.chains.draws[some]
    expected = inference.problem.posterior(theta.reshape(-1, 4)).reshape(theta.shape[:-1])
    assert inference.chains.log_prob[some] == pytest.approx(expected, abs=1e-8)


def test_control_a_wider_posterior_differs(known):
    inference, _, mean, covariance = known
    wider = mean + 1.15 * (inference.chains.pooled[:, :3] - mean)
    assert sum("standard deviation" in one for one in found_differences(inference, mean, covariance, wider)) == 3


def test_control_exchanged_rigidities_differ(known):
    inference, _, mean, covariance = known
    assert found_differences(inference, mean, covariance, inference.chains.pooled[:, [1, 0, 2]])


@pytest.mark.parametrize("mode", [0, 3, 5])
def test_control_a_posterior_without_one_mode_differs(known, mode):
    inference, data, *_ = known
    scales = np.full(6, NOISE)
    scales[mode] = np.inf
    assert found_differences(inference, *closed_form(data, scales))


@pytest.fixture(scope="module", params=[1])
def unknown(request):
    """Draws of a problem of unknown noise, and its closed form: Student's marginals."""
    problem, truth = unknown_noise(request.param)
    return sampled(problem, seed=10 + request.param), truth


def unknown_differences(inference, truth, draws=None):
    draws = inference.chains.pooled if draws is None else draws
    return differences(draws, inference.convergence.ess, truth)


def test_constants_of_unknown_noise_are_student_s(unknown):
    inference, truth = unknown
    assert unknown_differences(inference, truth) == []

    wider = truth.mean + 1.15 * (inference.chains.pooled - truth.mean)
    assert sum("standard deviation" in one for one in unknown_differences(inference, truth, wider)) == 4
    assert unknown_differences(inference, truth, inference.chains.pooled[:, [1, 0, 2, 3]])


def test_control_a_normal_posterior_of_the_same_width_is_not_student_s(unknown):
    """Five per cent of it lie where Student's has more: what forgetting that the noise is unknown would give."""
    _, truth = unknown
    draws = np.random.default_rng(1).normal(truth.mean, truth.sd / np.sqrt(1.2), (100_000, 4))  # 12 degrees of freedom
    assert differences(draws, np.full(4, 1e5), truth)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_other_normal_posteriors_are_recovered(seed):
    board, law, _, mean, covariance = conjugate(seed)
    inference = sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=seed + 1)
    assert found_differences(inference, mean, covariance) == []


@pytest.mark.slow
def test_fifty_normal_posteriors_have_normal_errors():
    """At most one of 150 standardised errors of the means beyond three; all of them normal."""
    z = []
    for seed in range(50):
        board, law, _, mean, covariance = conjugate(seed=100 + seed)
        inference = sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=seed)
        error = np.sqrt(np.diagonal(covariance) / inference.convergence.ess[:3])
        z.extend((inference.chains.pooled[:, :3].mean(axis=0) - mean) / error)
    z = np.array(z)
    assert np.sum(np.abs(z) > 3) <= 1
    assert stats.kstest(z, stats.norm.cdf).pvalue > 1e-3
    assert stats.kstest(1.5 * z, stats.norm.cdf).pvalue < 0.05  # control: the errors are not merely small


N_GRID, REACH = 121, 8.0


@dataclass(frozen=True, eq=False)
class Quadrature:
    """The posterior of a board under the linear law, rounded readings, known noise: a sum over a grid in ln D."""

    grids: list
    density: np.ndarray
    log_evidence: float

    @classmethod
    def of(cls, problem, left_out=None):
        setup = problem.board.setups[0]
        model = problem.posterior.models[0]
        columns = model.linear.stiffness @ _columns(problem)
        sd = np.sqrt(np.diagonal(problem.covariance))[:3]
        grids = [c + s * np.linspace(-REACH, REACH, N_GRID) for c, s in zip(problem.centre, sd, strict=False)]
        log_D = np.stack(np.meshgrid(*grids, indexing="ij"), axis=-1)
        log_f = 0.5 * np.log(np.exp(log_D) @ columns.T) - np.log(2 * np.pi)
        noise, half = setup.noise.median, setup.resolution / 2
        total = _log_prior(problem, log_D)
        for mode, f in enumerate(setup.measured):
            if mode != left_out:
                low, high = ((np.log(f + end) - log_f[..., mode]) / noise for end in (-half, half))
                total += _log_between(low, high)
        cell = np.prod([grid[1] - grid[0] for grid in grids])
        log_evidence = total.max() + np.log(np.exp(total - total.max()).sum() * cell)
        return cls(grids, np.exp(total - total.max()), float(log_evidence))

    def truth(self):
        marginals = [self.density.sum(axis=tuple({0, 1, 2} - {i})) for i in range(3)]
        assert all(max(m[0], m[-1]) < 1e-6 * m.max() for m in marginals)  # the box holds it all
        return Truth.from_marginals(self.grids, marginals)


def _columns(problem):
    """(D_x, D_y, D_s) to the weights of the four thin terms, written out again from the paper's eq. (11)."""
    plate = ritz.FINNISH
    sigma, area = plate.L_x / plate.L_y, plate.L_x * plate.L_y
    columns = np.zeros((4, 3))
    columns[0, 0] = sigma**-2.0
    columns[1, 1] = sigma**2
    columns[2, 1] = plate.nu_xy
    columns[3, 2] = 1.0
    return columns / (plate.rho * plate.h * area**2)


def _log_prior(problem, log_D):
    """Log-normal densities of the moduli, in ln E, of equal volume with ln D."""
    plate, density = ritz.FINNISH, problem.prior.constants["E_x"]
    log_factor = np.log1p(-(plate.nu_xy**2) * np.exp(log_D[..., 1] - log_D[..., 0]))
    log_E = log_D + np.log(np.array([12.0, 12.0, 3.0]) / plate.h**3)
    log_E[..., :2] += log_factor[..., None]
    width = np.log(density.factor)
    normal = ((log_E - np.log(density.median)) / width) ** 2 + 2.0 * np.log(width) + np.log(2.0 * np.pi)
    return -0.5 * np.sum(normal, axis=-1)


def _log_between(low, high):
    """ln(Phi(high) - Phi(low)) where it matters; nothing below e^-600."""
    flip = np.where(low > 0, -1.0, 1.0)  # in the lower tail, where differences are exact
    p = np.abs(ndtr(flip * high) - ndtr(flip * low))
    return np.log(np.maximum(p, 1e-260))


@pytest.fixture(scope="module")
def rounded():
    """A cantilever board read to 1 Hz, noise 0.5 %, under the linear law."""
    hertz = with_noise(ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS), 0.005, np.random.default_rng(3), resolution=1.0)
    setup = setup_of(ritz.CANTILEVER, hertz, resolution=1.0, noise=fixed_noise(0.005))
    problem = pose(board_of(ritz.FINNISH, [setup]), load_prior("weakly-informative"), law="linear")
    return sampled(problem, seed=4)


@pytest.fixture(scope="module")
def quadrature(rounded):
    """The posterior by quadrature, with all modes or without one: each computed once."""
    return cache(lambda left_out=None: Quadrature.of(rounded.problem, left_out))


def test_the_linear_law_with_rounded_readings_agrees_with_quadrature(rounded, quadrature):
    truth = quadrature().truth()
    draws, ess = rounded.chains.pooled[:, :3], rounded.convergence.ess[:3]
    assert differences(draws, ess, truth) == []

    wider = truth.mean + 1.15 * (draws - truth.mean)
    assert differences(wider, ess, truth)
    assert differences(draws[:, [1, 0, 2]], ess, truth)


def test_the_evidence_from_draws_is_that_of_quadrature(rounded, quadrature):
    """By bridge sampling, as a campaign takes it; the narrow prior of the noise integrates to one."""
    problem = rounded.problem
    exact = quadrature().log_evidence
    rng = np.random.default_rng(5)
    found = bridge_sampling(problem.posterior, rng.permutation(rounded.chains.pooled), rng)

    assert found == pytest.approx(exact, abs=0.02)
    assert quadrature(5).log_evidence != pytest.approx(exact, abs=0.02)


@pytest.mark.parametrize("mode", [4, 5])
def test_control_quadrature_without_one_mode_differs(rounded, quadrature, mode):
    truth = quadrature(mode).truth()
    assert differences(rounded.chains.pooled[:, :3], rounded.convergence.ess[:3], truth)


def test_control_quadrature_that_ignores_the_rounding_differs(rounded):
    setup = rounded.problem.board.setups[0]
    sharp = replace(rounded.problem.board, setups=(replace(setup, resolution=1e-3),))
    truth = Quadrature.of(replace(rounded.problem, board=sharp)).truth()
    assert differences(rounded.chains.pooled[:, :3], rounded.convergence.ess[:3], truth)
