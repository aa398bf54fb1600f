"""What several boards say of what they share, against closed forms: linear boards with Gaussian errors."""

from __future__ import annotations

import numpy as np
import pytest
from linear_boards import joint_posterior, linear_boards, log_evidence, standard_shared

from bayesplate.campaigns.marginal import marginal_likelihood
from bayesplate.campaigns.space import Pull, Space
from bayesplate.campaigns.together import Together, walk
from bayesplate.posterior.sampling import SamplerSettings

Z_TRUE = {1: [1.2], 2: [1.2, -0.7], 3: [1.2, -0.7, 0.4]}


def together_of(boards, rng, n_draws=1024):
    """What the machinery makes of linear boards, from nothing but draws and densities."""
    n = boards[0].shared.shape[1]
    drawn = [one.draws(rng, 6000) for one in boards]
    pulls = tuple(Pull.of_draws(z) for _, z in drawn)
    space = Space.around(pulls)
    marginals = [
        marginal_likelihood(one.log_density, own, z, space.nodes, rng, n_draws)
        for one, (own, z) in zip(boards, drawn, strict=True)
    ]
    names = tuple(f"board {i}" for i in range(len(boards)))
    values = np.stack([one.log_likelihood for one in marginals])
    return Together(standard_shared(n), space, names, values, pulls), marginals


@pytest.mark.parametrize("n_shared", [1, 2, 3])
def test_the_marginal_likelihood_of_a_linear_board_is_the_closed_form(n_shared):
    rng = np.random.default_rng(n_shared)
    boards = linear_boards(rng, 2, n_shared, Z_TRUE[n_shared])
    together, (found, _) = together_of(boards, rng)

    near = np.abs(together.space.u(found.nodes)).max(axis=1) < 3.1
    errors = (found.log_likelihood - boards[0].log_likelihood(found.nodes))[near]
    own_errors = found.effective[near] ** -0.5

    assert np.abs(errors / own_errors).max() < 4.0
    assert own_errors.max() < 0.06
    assert np.ptp(errors) < 0.05  # the same random numbers everywhere: what is left over is nearly one constant


@pytest.mark.parametrize("n_shared", [1, 2, 3])
def test_all_boards_and_all_but_one_are_the_closed_form(n_shared):
    rng = np.random.default_rng(10 + n_shared)
    boards = linear_boards(rng, 5, n_shared, Z_TRUE[n_shared])
    together, _ = together_of(boards, rng)

    for without in [(), (0,), (3,)]:
        kept = [one for i, one in enumerate(boards) if i not in without]
        mean, covariance = joint_posterior(kept)
        found_mean, found_covariance = together.moments(without)
        sd = np.sqrt(np.diagonal(covariance))
        assert np.abs((found_mean - mean) / sd).max() < 0.05
        assert np.abs(np.sqrt(np.diagonal(found_covariance)) / sd - 1.0).max() < 0.03
        assert together.log_evidence(without) == pytest.approx(log_evidence(kept), abs=0.15)
        assert together.rim(without) < 1e-3


def test_a_board_taken_twice_is_found_out():
    """The negative control: the tolerances above tell five boards from six."""
    rng = np.random.default_rng(12)
    boards = linear_boards(rng, 5, 2, Z_TRUE[2])
    together, _ = together_of([*boards, boards[0]], rng)
    mean, covariance = joint_posterior(boards)
    sd = np.sqrt(np.diagonal(covariance))
    found_mean, found_covariance = together.moments()

    assert (
        np.abs((found_mean - mean) / sd).max() > 0.05
        or np.abs(np.sqrt(np.diagonal(found_covariance)) / sd - 1.0).max() > 0.03
    )


def test_the_walk_has_the_moments_of_the_sums():
    rng = np.random.default_rng(3)
    together, _ = together_of(linear_boards(rng, 4, 2, Z_TRUE[2]), rng)
    chains, convergence = walk(together, SamplerSettings(seed=1))
    mean, covariance = together.moments()
    sd = np.sqrt(np.diagonal(covariance))

    assert convergence.passed
    assert np.abs((chains.pooled.mean(axis=0) - mean) / sd * np.sqrt(convergence.ess)).max() < 4.0
    assert np.abs(chains.pooled.std(axis=0) / sd - 1.0).max() < 4.0 / np.sqrt(2 * convergence.ess.min())


def test_one_board_that_stands_apart_is_inside_the_box():
    rng = np.random.default_rng(4)
    boards = linear_boards(rng, 8, 2, [3.0, 3.0], without=(0,))
    together, _ = together_of(boards, rng)

    for without in [(), *((i,) for i in range(8))]:
        assert together.rim(without) < 1e-3
