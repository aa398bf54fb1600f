"""The convergence gate: what passes, what must not, and the numbers it judges by."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

from bayesplate.posterior.convergence import (
    Gate,
    autocorrelation_times,
    burn_in_steps,
    judge_convergence,
    length_in_taus,
)
from bayesplate.posterior.statistics import rhat

RHO = 0.8  # kept with probability RHO, otherwise drawn anew: autocorrelation RHO**lag, acceptance 1 - RHO
TAU = (1 + RHO) / (1 - RHO)


def renewal_draws(n_steps=1000, n_ensembles=4, n_walkers=16, n_dim=2, seed=0):
    """Chains whose autocorrelation time and acceptance are known."""
    rng = np.random.default_rng(seed)
    draws = rng.standard_normal((n_ensembles, n_steps, n_walkers, n_dim))
    stays = rng.random((n_ensembles, n_steps, n_walkers)) < RHO
    for step in range(1, n_steps):
        draws[:, step][stays[:, step]] = draws[:, step - 1][stays[:, step]]
    return draws


def test_good_draws_pass_with_the_known_autocorrelation_time():
    convergence = judge_convergence(renewal_draws())
    assert convergence.passed
    assert convergence.reasons == ()
    assert convergence.tau == pytest.approx(TAU, rel=0.2)
    assert np.all(convergence.ess < 1.2 * 4 * 1000 * 16 / TAU)
    assert np.all(convergence.ess > 0.5 * 4 * 1000 * 16 / TAU)  # that of the tails is smaller
    assert convergence.acceptance == pytest.approx(1 - RHO, abs=0.01)
    assert convergence.n_kept_steps == 1000


def test_autocorrelation_times_are_the_known_one_and_of_independent_draws_at_least_one():
    assert autocorrelation_times(renewal_draws(n_ensembles=1, n_steps=3000)[0]) == pytest.approx(TAU, rel=0.1)
    assert autocorrelation_times(np.random.default_rng(0).standard_normal((500, 16, 3))).min() >= 1.0


def test_the_length_is_that_of_the_slowest_parameter_of_the_slowest_ensemble():
    draws = renewal_draws(n_steps=200, n_dim=3)
    quick = length_in_taus(draws)
    assert quick == pytest.approx(200 / TAU, rel=0.3)
    draws[2, :, :, 1] = np.cumsum(draws[2, :, :, 1], axis=0)
    assert length_in_taus(draws) < 0.5 * quick


def test_a_walker_that_stays_apart_does_not_pass():
    """Its mean is another one than that of the others, at any length: the effective size sees it."""
    draws = renewal_draws()
    draws[:, :, 0] += 20.0
    found = judge_convergence(draws)
    assert not found.passed
    assert found.ess_min < Gate().ess_min


def test_a_stuck_ensemble_fails():
    draws = renewal_draws()
    draws[2] += 3.0
    convergence = judge_convergence(draws, names=("D_x", "D_y"))
    assert not convergence.passed
    assert "disagree about D_" in convergence.reasons[0]
    assert "The effective sample size" in convergence.reasons[1]


def test_ensembles_of_unlike_width_fail_rhat():
    draws = renewal_draws()
    draws[1] *= 2.0
    assert judge_convergence(draws).rhat_max > 1.01


def test_a_drift_fails_rhat():
    draws = renewal_draws() + np.linspace(0, 1, 1000)[:, None, None]
    assert judge_convergence(draws).rhat.min() > 1.01


def test_rhat_is_not_taken_over_single_walkers():
    draws = renewal_draws(n_steps=650)
    assert rhat(np.moveaxis(draws, 2, 1).reshape(-1, 650, 2)).max() > 1.01
    convergence = judge_convergence(draws)
    assert convergence.passed, convergence.reasons
    assert convergence.rhat_max < 1.005


def test_a_short_run_is_told_how_long_it_should_be():
    convergence = judge_convergence(renewal_draws(n_steps=200))
    assert not convergence.passed
    assert convergence.suggested_steps == pytest.approx(100 * TAU, rel=0.3)
    assert f"{convergence.suggested_steps} steps after burn-in would do" in convergence.reasons[0]


def test_the_effective_size_can_be_asked_for():
    convergence = judge_convergence(renewal_draws(), Gate(ess_min=50_000))
    assert len(convergence.reasons) == 1
    assert "50000 is wanted" in convergence.reasons[0]


def test_a_parameter_that_never_moves_is_named():
    draws = renewal_draws()
    draws[..., 1] = 7.0
    convergence = judge_convergence(draws, names=("D_x", "tension"))
    assert not convergence.passed
    assert convergence.reasons[0].startswith("tension never moves")
    assert np.isinf(convergence.tau[1])
    assert convergence.ess[1] == 0.0


def test_a_number_that_is_none_never_passes():
    draws = renewal_draws()
    draws[0, 10, 3, 0] = np.nan
    with np.errstate(invalid="ignore"):
        assert not judge_convergence(draws).passed


@pytest.mark.parametrize("n_steps", [1, 50, 200, 600, 3000, 20_000])
def test_the_burn_in_leaves_fifty_times_and_takes_at_least_five(n_steps):
    burn_in = burn_in_steps(n_steps)
    kept = n_steps - burn_in
    assert kept >= n_steps / 2
    assert burn_in >= min(5 * kept / 50, n_steps // 2)


def moving(fractions):
    """Draws of walkers that move in exactly these fractions of 1000 steps: (n_ensembles, n_walkers) array."""
    rng = np.random.default_rng(4)
    draws = rng.standard_normal((fractions.shape[0], 1001, fractions.shape[1], 1))
    for ensemble, walker in np.ndindex(fractions.shape):
        still = 1 + rng.permutation(1000)[round(1000 * fractions[ensemble, walker]) :]
        for step in np.sort(still):
            draws[ensemble, step, walker] = draws[ensemble, step - 1, walker]
    return draws


def apart(rhat_max):
    """Draws whose ensembles disagree so much that the split R-hat has this value."""
    draws = renewal_draws(n_dim=1)
    shift = np.array([0.0, 0.0, 1.0, 0.0])[:, None, None, None]
    return draws + shift * brentq(
        lambda s: judge_convergence(draws + s * shift).rhat_max - rhat_max, 0.0, 1.0, xtol=1e-9
    )


def cut_where(name, limit, draws):
    """The draws cut short: just below a limit of a figure of theirs that grows with the steps, and just above it."""
    values = {n: getattr(judge_convergence(draws[:, :n]), name) for n in range(300, draws.shape[1], 10)}
    below = max(n for n, value in values.items() if 0.96 * limit < value < limit)
    above = min(n for n, value in values.items() if limit < value < 1.04 * limit)
    return draws[:, :below], draws[:, :above]


def moving_elsewhere(fraction, *, elsewhere, where):
    """Draws of which some walkers move in this fraction of the steps, and all others in another."""
    fractions = np.full((4, 8), elsewhere)
    fractions[where] = fraction
    return moving(fractions)


RULES = {
    "R-hat above 1.01": ("disagree about parameter 1 ", lambda: (apart(1.0102), apart(1.0098))),
    "fewer than 400 independent draws": (
        "The effective sample size of parameter 1 ",
        lambda: cut_where("ess_min", 400.0, renewal_draws(n_steps=700, n_walkers=2, n_dim=1)),
    ),
    "fewer than 50 autocorrelation times": (
        "autocorrelation times of parameter 1, 50 are wanted",
        lambda: cut_where("n_taus", 50.0, renewal_draws(n_steps=700, n_dim=1)),
    ),
    "an ensemble that accepts less than 0.15": (
        "Ensemble 3 accepts 15 % of its proposals",
        # the mean of walkers that are not alike
        lambda: tuple(moving_elsewhere(f + np.tile([-0.05, 0.05], 4), elsewhere=0.3, where=2) for f in (0.149, 0.151)),
    ),
    "a walker that accepts less than 0.01": (
        "1 of 32 walkers hardly ever move",
        lambda: tuple(moving_elsewhere(f, elsewhere=0.3, where=(2, 5)) for f in (0.009, 0.011)),
    ),
}


@pytest.mark.parametrize("rule", RULES)
def test_each_limit_of_the_default_gate(rule):
    """Draws on either side of it, four per cent apart at most."""
    sentence, make = RULES[rule]
    failing, passing = make()

    assert sum(sentence in reason for reason in judge_convergence(failing).reasons) == 1
    assert not any(sentence in reason for reason in judge_convergence(passing).reasons)
