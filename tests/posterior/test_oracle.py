"""The whole of `infer` against posteriors that are known: two in closed form, one by quadrature.

A difference is more Monte Carlo errors of a mean, a standard deviation or a quantile than chance allows. Draws and
posteriors that are wrong in a known way must differ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
import ritz
from conjugate import ESS, NOISE, closed_form, conjugate, fixed_noise, rigidity_prior, sampled, stated, unknown_noise
from made_boards import CANTILEVER_LABELS, board_of, setup_of, with_noise
from scipy import stats
from scipy.special import ndtr
from statistics_checks import Truth, differences, normal_truth

from bayesplate.board.prior import load_prior
from bayesplate.campaign.evidence import bridge_sampling
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.posing import pose

THINNING_LOSS = 0.9
"""Share of the effective size that thinning to half an autocorrelation time leaves."""


@dataclass(frozen=True, eq=False)
class Case:
    """Draws of `infer`, and what is known of their first columns."""

    inference: Inference
    truth: Truth

    @property
    def draws(self):
        return self.inference.chains.pooled[:, : self.truth.mean.size]

    @property
    def ess(self):
        return self.inference.convergence.ess[: self.truth.mean.size]

    def differs(self, *, draws=None, truth=None):
        """In what the draws, or others, differ from the truth, or from another."""
        draws = self.draws if draws is None else draws
        return differences(draws, self.ess, self.truth if truth is None else truth)


def truth_of(mean, covariance):
    return normal_truth(mean, np.sqrt(np.diagonal(covariance)))


def case_of_known_noise(seed):
    """A problem of known noise, whose constants are normal; the data, and the covariance of the closed form."""
    board, law, data, mean, covariance = conjugate(seed)
    inference = sampled(stated(board, rigidity_prior(), law, mean, covariance), seed=seed + 1)
    return Case(inference, truth_of(mean, covariance)), data, covariance


@pytest.fixture(scope="module")
def known():
    return case_of_known_noise(seed=1)


@pytest.fixture(scope="module")
def unknown():
    """A problem of unknown noise, whose constants are Student's."""
    problem, truth = unknown_noise(1)
    return Case(sampled(problem, seed=11), truth)


def test_a_normal_posterior_is_recovered(known):
    case, _, covariance = known
    inference = case.inference
    assert inference.convergence.ess_min >= ESS
    assert case.differs() == []
    drawn = np.corrcoef(case.draws.T)[np.triu_indices(3, 1)]
    true = (covariance / np.outer(case.truth.sd, case.truth.sd))[np.triu_indices(3, 1)]
    assert np.all(np.abs(drawn - true) < 4 * (1 - true**2) / np.sqrt(case.ess.min()))

    thinned = inference.theta.reshape(-1, 4)
    assert len(thinned) < len(case.draws)
    ess = np.minimum(THINNING_LOSS * case.ess, len(thinned))
    assert differences(thinned[:, :3], ess, case.truth) == []
    assert inference.log_posterior.ravel() == pytest.approx(inference.problem.posterior(thinned), abs=1e-8)


def test_constants_of_unknown_noise_are_student_s(unknown):
    assert unknown.differs() == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 3])
def test_other_normal_posteriors_are_recovered(seed):
    case, _, _ = case_of_known_noise(seed)
    assert case.differs() == []


@pytest.mark.slow
def test_fifty_normal_posteriors_have_normal_errors():
    """At most one of 150 standardised errors of the means beyond three; all of them normal."""
    cases = [case_of_known_noise(seed)[0] for seed in range(100, 150)]
    z = np.ravel([(one.draws.mean(axis=0) - one.truth.mean) / one.truth.sd * np.sqrt(one.ess) for one in cases])
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
    return Case(sampled(problem, seed=4), Quadrature.of(problem).truth())


def test_the_linear_law_with_rounded_readings_agrees_with_quadrature(rounded):
    assert rounded.differs() == []


def test_the_evidence_from_draws_is_that_of_quadrature(rounded):
    """By bridge sampling, as a campaign takes it; the narrow prior of the noise integrates to one."""
    problem, rng = rounded.inference.problem, np.random.default_rng(5)
    exact = Quadrature.of(problem).log_evidence
    found = bridge_sampling(problem.posterior, rng.permutation(rounded.inference.chains.pooled), rng)

    assert found == pytest.approx(exact, abs=0.02)
    assert Quadrature.of(problem, left_out=5).log_evidence != pytest.approx(exact, abs=0.02)


@pytest.mark.parametrize("name", ["known", "unknown", "rounded"])
def test_control_draws_of_another_width_or_with_exchanged_rigidities_differ(request, name):
    case = request.getfixturevalue(name)
    case = case[0] if name == "known" else case
    wider = case.differs(draws=case.truth.mean + 1.15 * (case.draws - case.truth.mean))
    exchanged = case.draws[:, [1, 0, *range(2, case.truth.mean.size)]]

    assert sum("standard deviation" in one for one in wider) == case.truth.mean.size
    assert case.differs(draws=exchanged)


def test_control_a_posterior_without_one_mode_or_without_the_rounding_differs(known, rounded):
    case, data, _ = known
    problem = rounded.inference.problem
    for mode in (0, 3, 5):
        scales = np.where(np.arange(6) == mode, np.inf, NOISE)
        assert case.differs(truth=truth_of(*closed_form(data, scales))), mode
    for mode in (4, 5):
        assert rounded.differs(truth=Quadrature.of(problem, left_out=mode).truth()), mode
    sharp = replace(problem.board, setups=(replace(problem.board.setups[0], resolution=1e-3),))
    assert rounded.differs(truth=Quadrature.of(replace(problem, board=sharp)).truth())


def test_control_a_normal_posterior_of_the_same_width_is_not_student_s(unknown):
    """Five per cent of it lie where Student's has more: what forgetting that the noise is unknown would give."""
    truth = unknown.truth
    draws = np.random.default_rng(1).normal(truth.mean, truth.sd / np.sqrt(1.2), (100_000, 4))  # 12 degrees of freedom
    assert differences(draws, np.full(4, 1e5), truth)
