"""Likelihoods of what is shared from nothing but draws, against closed forms."""

from __future__ import annotations

from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from linear_boards import linear_boards
from scipy import stats

from bayesplate.board.quantity import Quantity
from bayesplate.campaign.boards import FittedBoard, Sample
from bayesplate.campaign.evidence import bridge_sampling
from bayesplate.campaign.likelihood import _REACH, SharedLikelihood, _within_reach
from bayesplate.diagnosis.terms import log_sum

N = 6000


def log_standard_normal(z):
    return stats.norm.logpdf(z).sum(axis=1)


def test_a_prior_with_an_edge_and_a_likelihood_that_leans():
    """A mass cannot be negative: half-normal prior, and a likelihood that falls faster on one side."""
    rng = np.random.default_rng(5)
    grid = np.linspace(0.0, 6.0, 6001)

    def log_likelihood(z):
        return -0.5 * ((z - 0.6) / 0.7) ** 2 - 0.15 * (z - 0.6) ** 3

    def log_reference(z):
        return np.where(z[:, 0] >= 0.0, stats.halfnorm.logpdf(z[:, 0]), -np.inf)

    shares = np.exp(log_reference(grid[:, None]) + log_likelihood(grid))
    z = np.interp(rng.random(20_000), np.cumsum(shares) / shares.sum(), grid)[:, None]
    exact = np.log(np.trapezoid(shares, grid))
    found = SharedLikelihood.from_draws(z, np.full(len(z), 1 / len(z)), len(z), log_reference, exact)

    off = found.at(z) - log_likelihood(z[:, 0])
    assert np.sqrt(np.mean(off**2)) < 2.0 * np.sqrt(found.coefficients.size / len(z))


def test_far_from_the_draws_it_falls_like_a_normal_one():
    """At ten standard deviations, where there are no draws: within a tenth of the closed form, and never upwards."""
    rng = np.random.default_rng(8)
    (board,) = linear_boards(rng, 1, 1, [0.5], sd=0.1)
    _, z = board.draws(rng, N)
    found = SharedLikelihood.from_draws(z, np.full(N, 1 / N), N, log_standard_normal, 0.0)
    far = z.mean() + z.std() * np.array([[-10.0], [10.0]])

    fall = found.at(far) - found.at(z.mean(axis=0)[None])
    exact = board.at(far) - board.at(z.mean(axis=0)[None])
    assert fall == pytest.approx(exact, rel=0.1)


def test_what_a_board_does_not_say_does_not_rise_beyond_its_draws():
    """A board without a mass: a polynomial that suits the flat end must not turn up at the other one."""
    rng = np.random.default_rng(9)
    grid = np.linspace(-8.0, 8.0, 16_001)
    log_likelihood = -np.exp(2.0 * grid)
    shares = np.exp(stats.norm.logpdf(grid) + log_likelihood)
    z = np.interp(rng.random(8000), np.cumsum(shares) / shares.sum(), grid)[:, None]
    found = SharedLikelihood.from_draws(z, np.full(len(z), 1 / len(z)), len(z), log_standard_normal, 0.0)
    top = found.at(np.quantile(z, 0.5, axis=0)[None])[0]

    assert (found.at(np.linspace(2.0, 8.0, 13)[:, None]) < top - 3.0).all()


@pytest.mark.parametrize(("n_effective", "degree"), [(300, 2), (3000, 4)])
def test_few_draws_give_few_terms(n_effective, degree):
    z = np.random.default_rng(6).standard_normal((n_effective, 3))
    found = SharedLikelihood.from_draws(z, np.full(len(z), 1 / len(z)), n_effective, log_standard_normal, 0.0)

    assert found.degree == degree


def test_the_evidence_of_a_linear_board_is_the_closed_form():
    rng = np.random.default_rng(7)
    (board,) = linear_boards(rng, 1, 2, [1.2, -0.7])
    own, z = board.draws(rng, N)

    def log_density(x):
        return board.log_density(x[:, :-2], x[:, -2:]) + log_standard_normal(x[:, -2:])

    exact = stats.multivariate_normal(cov=board.covariance + board.shared @ board.shared.T).logpdf(board.readings)
    found, from_elsewhere = (bridge_sampling(log_density, np.column_stack([own, z + off]), rng) for off in (0.0, 0.5))
    assert found == pytest.approx(exact, abs=0.05)
    assert abs(from_elsewhere - exact) > 0.05  # control


def test_a_polynomial_is_believed_in_a_ball_about_its_draws():
    """Not in a box: in its corners, six standard deviations off, the sum over boards rose to peaks of its own."""
    corners = 3.4 * np.array(list(product((-1.0, 1.0), repeat=3)))

    assert np.linalg.norm(_within_reach(corners), axis=1) == pytest.approx(_REACH)
    assert _within_reach(corners) == pytest.approx(corners * _REACH / np.linalg.norm(corners[0]))
    assert np.array_equal(_within_reach(0.5 * corners), 0.5 * corners)


def test_a_board_that_was_walked_anew_is_known_where_its_own_draws_are_as_well():
    """The others learn of it from there: from draws near what they teach it alone, its peak would be extrapolated."""
    rng, grid = np.random.default_rng(6), np.linspace(-6.0, 6.0, 24001)[:, None]
    prior = Quantity.from_mean(0.0, 1.0, "normal")
    member = FittedBoard(None, (SimpleNamespace(prior=prior),))

    def log_likelihood(z):
        """A narrow peak, and a wide foot of what the board's noise makes up for."""
        return np.logaddexp(-0.5 * ((z - 1.7) / 0.2) ** 2, -4.0 - 0.5 * ((z - 1.7) / 0.8) ** 2)[:, 0]

    def log_near(z):
        return -0.5 * ((z[:, 0] - 0.2) / 0.3) ** 2

    def sample_of(log_reference, n):
        log_density = log_reference(grid) + log_likelihood(grid)
        weights = np.exp(log_density - log_density.max())
        z = rng.choice(grid[:, 0], size=n, p=weights / weights.sum())[:, None]
        log_evidence = float(np.log(np.exp(log_density).sum() * (grid[1, 0] - grid[0, 0])))
        return Sample(z, z, np.zeros(n), n, log_reference, log_evidence, ())

    def log_evidence_of(likelihood, log_reference):
        return float(log_sum(log_reference(grid) + likelihood.at(grid)) + np.log(grid[1, 0] - grid[0, 0]))

    vars(member)["own_sample"] = sample_of(member.log_prior, 8000)
    anew = sample_of(log_near, 2048)
    found = member.likelihood(anew, log_near)
    extrapolated = SharedLikelihood.from_draws(anew.z, anew.weights, 2048, log_near, anew.log_evidence)

    assert log_evidence_of(found, log_near) == pytest.approx(anew.log_evidence, abs=0.1)
    assert log_evidence_of(found, member.log_prior) == pytest.approx(member.own_sample.log_evidence, abs=0.1)
    assert abs(log_evidence_of(extrapolated, member.log_prior) - member.own_sample.log_evidence) > 0.2
