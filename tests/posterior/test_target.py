"""The posterior density: its priors, its support, and what must leave it unchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, FREE_LABELS, board_of, models_at, setup_of, swapped, with_noise
from scipy import stats

from bayesplate.board.parameter import BOARD_OWNER
from bayesplate.board.prior import StatedPrior, load_prior
from bayesplate.board.quantity import Quantity
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.posterior.posing import pose
from bayesplate.posterior.target import Posterior

EXACT = 1e-10
"""Relative, of frequencies and estimates; the eigenvalues themselves are good to some 1e-12."""


def two_setups(nu_xy=ritz.FINNISH.nu_xy, seed=5, **inputs):
    """A board measured as a cantilever and free, with noise and rounding."""
    rng = np.random.default_rng(seed)
    held = replace(ritz.FINNISH, nu_xy=nu_xy)
    free = replace(held, edges=ritz.ALL_FREE, L_x=held.L_x + 0.03)
    cantilever = with_noise(ritz.simulate(held, CANTILEVER_LABELS), 0.005, rng)
    hung = with_noise(ritz.simulate(free, FREE_LABELS), 0.003, rng)
    clamped = {"x0": Quantity.exact(0.03)}
    setups = [
        setup_of(ritz.CANTILEVER, cantilever, name="cantilever", clamped=clamped, resolution=1.0),
        setup_of(ritz.ALL_FREE, hung, name="free"),
    ]
    return board_of(held, setups, **inputs)


def points(problem, n=20, seed=3):
    """theta around the estimate, two standard errors wide."""
    factor = np.linalg.cholesky(problem.covariance)
    return problem.centre + 2.0 * np.random.default_rng(seed).normal(size=(n, problem.centre.size)) @ factor.T


def slope(posterior, theta):
    """How much the log posterior of each draw moves with ln f of all modes: the sum of |z| / scale, plus 1."""
    away = np.concatenate(
        [
            np.abs(readings.log_frequency - predicted) / np.exp(2 * posterior.parameters.log_noise(theta)[:, i : i + 1])
            for i, (readings, predicted) in enumerate(
                zip(posterior.readings, posterior.log_frequencies(theta), strict=True)
            )
        ],
        axis=1,
    )
    return 1.0 + away.sum(axis=1)


def assert_same(found, expected, tolerance):
    """Compare with a tolerance for each element."""
    assert np.all(np.abs(found - expected) <= tolerance), np.max(np.abs(found - expected) / tolerance)


@pytest.fixture(scope="module")
def prior():
    return load_prior("weakly-informative")


@pytest.fixture(scope="module")
def problem(prior):
    return pose(two_setups(), prior, law="exact")


def test_a_prior_on_moduli_is_the_same_prior_on_rigidities_where_nothing_couples_them(prior):
    """At nu_xy = 0, D = E h^3 / 12 and G h^3 / 3: a log-normal density keeps its factor and moves its median."""
    board = two_setups(nu_xy=0.0)
    h = ritz.FINNISH.h
    scales = {"D_x": ("E_x", h**3 / 12), "D_y": ("E_y", h**3 / 12), "D_s": ("G_xy", h**3 / 3)}
    stated = {
        **{name: StatedPrior(prior.constants[e].scaled(factor), "") for name, (e, factor) in scales.items()},
        **dict.fromkeys(("E_x", "E_y", "G_xy"), None),
    }
    theta = np.random.default_rng(1).normal(size=(30, 5))
    of_moduli = Posterior(board, prior, (), "linear").log_prior(theta)
    of_rigidities = Posterior(board, prior.model_copy(update=stated), (), "linear").log_prior(theta)
    assert of_moduli == pytest.approx(of_rigidities, rel=1e-12)


def test_outside_nu_xy_nu_yx_below_one_there_is_nothing(prior):
    setup = setup_of(ritz.CANTILEVER, dict.fromkeys(CANTILEVER_LABELS, 100.0))
    board = board_of(ritz.FINNISH, [setup], poisson_xy=Quantity.from_mean(0.5, 0.1, "normal"))
    posterior = Posterior(board, prior, (), "linear")
    limit = 2 * np.log(1 / 0.5)  # of ln(D_y / D_x) at nu_xy = 0.5
    theta = np.zeros((2, posterior.parameters.n_dim))
    theta[:, 1] = limit + np.array([-1e-9, 1e-9])
    log_prior = posterior.log_prior(theta)
    assert np.isfinite(log_prior[0])
    assert log_prior[1] == posterior.log_prior_constants(theta)[1] == -np.inf
    assert posterior(theta[1:])[0] == -np.inf  # without any model: the likelihood is not even asked


def test_the_noise_prior_is_the_card_s(prior):
    board = two_setups()
    posterior = Posterior(board, prior, (), "linear")
    theta = np.zeros((3, 5))
    theta[:, 3] = np.log([0.003, 0.005, 0.02])
    theta[:, 4] = np.log(0.003)
    noise = board.setups[0].noise
    expected = stats.norm.logpdf(theta[:, 3], np.log(noise.median), noise.log_sd)
    difference = posterior.log_prior(theta)
    assert difference - difference[0] == pytest.approx(expected - expected[0], rel=1e-12)


def test_the_likelihood_is_a_sum_over_setups(problem, prior):
    theta = points(problem)
    both = problem.posterior
    for i, part in enumerate((slice(0, 6), slice(6, None))):
        setup = both.board.setups[i]
        kept = tuple(one for one in both.board.parameters if one.owner in (BOARD_OWNER, setup.owner))
        alone = Posterior(replace(both.board, setups=(setup,), parameters=kept), prior, (both.models[i],), "exact")
        columns = [0, 1, 2, 3 + i]
        assert alone.log_likelihood(theta[:, columns]) == pytest.approx(both.log_likelihood(theta)[:, part], rel=EXACT)
    total = both.log_prior(theta) + both.log_likelihood(theta).sum(axis=1)
    assert both(theta) == pytest.approx(total, rel=1e-13)


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
def test_the_order_of_the_modes_changes_nothing(prior, robust):
    board, order = two_setups(), np.random.default_rng(6).permutation(6)
    shuffled = replace(board.setups[0], readings=tuple(board.setups[0].readings[i] for i in order))
    both = [pose(one, prior, robust=robust) for one in (board, replace(board, setups=(shuffled, board.setups[1])))]
    for law in ("linear", "exact"):
        first, second = (problem.under(law) for problem in both)
        assert second.estimate.rigidities == pytest.approx(first.estimate.rigidities, rel=EXACT)
        assert second.identifiability.leverages[:6] == pytest.approx(first.identifiability.leverages[order], rel=1e-9)
        theta = points(first)
        (found, of_free), (expected, free) = (one.posterior.log_frequencies(theta) for one in (second, first))
        assert found == pytest.approx(expected[:, order], rel=0, abs=EXACT)
        assert of_free == pytest.approx(free, rel=0, abs=EXACT)
        allowed = EXACT * slope(first.posterior, theta)
        assert_same(second.posterior(theta), first.posterior(theta), allowed)
        by_mode = first.posterior.log_likelihood(theta)[:, order]
        assert_same(second.posterior.log_likelihood(theta)[:, :6], by_mode, allowed[:, None])


def test_exchanging_x_and_y_changes_nothing(prior):
    """The exchanged board without Poisson coupling is the same problem: estimate, leverages, log posterior."""
    board, exchange = two_setups(nu_xy=0.0), [1, 0, 2]
    both = [pose(one, prior) for one in (board, swapped(board))]
    for law in ("linear", "exact"):
        first, second = (problem.under(law) for problem in both)
        assert second.estimate.rigidities == pytest.approx(first.estimate.rigidities[exchange], rel=EXACT)
        assert second.identifiability.leverages == pytest.approx(first.identifiability.leverages, rel=1e-8)
        covariance = first.identifiability.covariance[np.ix_(exchange, exchange)]
        assert second.identifiability.covariance == pytest.approx(covariance, rel=1e-8)
        theta = points(first)
        allowed = EXACT * slope(first.posterior, theta)
        assert_same(second.posterior(theta[:, [1, 0, 2, 3, 4]]), first.posterior(theta), allowed)
        # control: columns not exchanged
        assert np.all(np.abs(second.posterior(theta) - first.posterior(theta)) > allowed)


def test_exchanging_x_and_y_takes_the_other_poisson_ratio_along(prior):
    """With coupling nu_yx = nu_xy D_y / D_x stands where nu_xy stood; at that point every number is the same."""
    board = two_setups()
    estimate = weighted_least_squares(board)
    D_x, D_y, D_s = estimate.rigidities
    point = np.log([D_x, D_y, D_s, 0.008, 0.003])
    nu_yx = float(board.inputs["poisson_xy"].mean * D_y / D_x)
    exchanged = swapped(board)
    right = exchanged.with_priors({"poisson_xy": Quantity.exact(nu_yx)})
    models = [models_at(b, D) for b, D in ((board, (D_x, D_y, D_s)), (right, (D_y, D_x, D_s)))]
    wrong = models_at(exchanged, (D_y, D_x, D_s))
    first = Posterior(board, prior, models[0], "linear")(point[None, :])
    other = point[[1, 0, 2, 3, 4]][None, :]
    allowed = EXACT * slope(Posterior(board, prior, models[0], "linear"), point[None, :])
    assert_same(Posterior(right, prior, models[1], "linear")(other), first, allowed)
    assert np.all(np.abs(Posterior(exchanged, prior, wrong, "linear")(other) - first) > 1e3 * allowed)


def test_a_denser_board_is_as_much_stiffer(problem, prior):
    board, factor = problem.board, 0.1
    heavy = board.with_priors({"density": Quantity.exact(ritz.FINNISH.rho * factor)})
    estimate = weighted_least_squares(heavy)
    assert estimate.rigidities == pytest.approx(factor * problem.estimate.rigidities, rel=EXACT)
    found = identifiability(estimate.sensitivities, estimate.scales)
    assert found.leverages == pytest.approx(problem.identifiability.leverages, rel=1e-8)
    theta = points(problem)
    moved = theta + np.log(factor) * np.r_[np.ones(3), np.zeros(theta.shape[1] - 3)]
    as_heavy = Posterior(heavy, prior, problem.posterior.models, "exact")
    allowed = EXACT * slope(problem.posterior, theta)[:, None]
    assert_same(as_heavy.log_likelihood(moved), problem.posterior.log_likelihood(theta), allowed)
