"""Prior widths, constants as the search sees them, null control, and the size that a refit must find clear of zero."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_searches import baseline, candidate, ground_of, one_level, singles, visible_of
from scipy.stats import binom

from bayesplate.board.quantity import Quantity
from bayesplate.diagnosis.folds import ANY_LOG_ODDS, nested_leave_one_out
from bayesplate.diagnosis.hypotheses import Hypothesis
from bayesplate.diagnosis.null_control import FALSE_ALARMS, NullControl, _share_bounds, force_choices, null_control
from bayesplate.diagnosis.search import SearchResult, run_search, simulate_noise
from bayesplate.diagnosis.sensitivity import (
    _prior_ratio,
    draw_constants,
    under_exact_law,
    variant_searches,
    vary_priors,
)
from bayesplate.diagnosis.shifts import _axis_cells, no_effect_cells
from bayesplate.diagnosis.terms import noise_grid


@pytest.fixture
def small():
    """A board of six readings with one effect whose shift is a direction times a half-normal size."""
    base = baseline(np.random.default_rng(1))
    direction = 0.02 * np.linalg.qr(np.random.default_rng(2).standard_normal((6, 6)))[0][0]
    one = candidate(base, "a", direction)
    return ground_of(base, *singles(base, {"a": one}, prior=0.4), candidates={"a": one}), one


def test_constants_are_those_of_a_direct_regression():
    """One cell and one level: generalised least squares with the place in the cell and the input as unknowns."""
    rng = np.random.default_rng(3)
    base = baseline(rng, n_inputs=1, resolution=1.0)
    thickness = Quantity.from_mean(3e-3, 3e-5)
    base = replace(base, board=base.board.with_priors({"thickness": thickness}))
    prior = Quantity.from_mean(1.0, 1.0, "normal")
    one = candidate(base, "a", 0.02 * rng.standard_normal(6), prior, n_cells=1)
    ground = ground_of(base, Hypothesis(("a",), 1.0, one.fine, one_level(base), base), candidates={"a": one})
    residual = 0.01 * rng.standard_normal(6)
    n = 40_000
    drawn = draw_constants(SearchResult(ground, residual, np.zeros(1), np.ones(1)), rng, n)

    weights = 1.0 / (one_level(base).sd[0, 0] ** 2 + base.own_variance)
    columns = np.hstack([base.slopes, one.fine.slopes[0], base.input_slopes])
    spread = np.linalg.inv(columns.T @ (weights[:, None] * columns) + np.diag([0, 0, 0, 1, 1]))
    middle = spread @ (columns.T @ (weights * (residual - one.fine.shift[0])))
    reach = np.hstack([np.eye(3), one.fine.moved_slopes[0], np.zeros((3, 1))])
    mean = base.log_rigidities + one.fine.moved[0] + reach @ middle
    sd = np.sqrt(np.diagonal(reach @ spread @ reach.T))
    logs = np.log([drawn[name] for name in ("D_x", "D_y", "D_s")])
    assert np.abs((logs.mean(axis=1) - mean) / sd).max() < 4.0 / np.sqrt(n)
    assert np.abs(logs.std(axis=1) / sd - 1.0).max() < 4.0 / np.sqrt(2 * n)

    # G_xy = 3 D_s / h^3: the thickness is drawn along with D_s, not kept
    row = reach[2] - 3.0 * thickness.log_sd * np.eye(5)[4]
    found = np.log(drawn["G_xy"])
    assert found.std() == pytest.approx(np.sqrt(row @ spread @ row), rel=4.0 / np.sqrt(2 * n))
    assert abs(np.sqrt(row @ spread @ row) / sd[2] - 1.0) > 0.05


def test_simulated_nulls_have_the_noise_of_its_prior_are_rounded_and_have_the_spread_of_the_inputs():
    """Covariance of the sets: noise, a rounding of one Hz (variance 1/12 over f^2), and what the inputs do together.

    The noise is log-normal: ln of the mean square over a set is far wider than where it is known.
    """
    plain, rounded = (baseline(np.random.default_rng(1), **kind) for kind in ({}, {"resolution": 1.0, "n_inputs": 2}))
    (setup,) = plain.board.setups
    noise = float(setup.noise.median**2 * np.exp(2.0 * setup.noise.log_sd**2))  # mean square of the noise prior
    without = np.diag(np.full(6, noise))
    more = np.diag(1.0 / 12.0 / np.exp(rounded.log_frequency) ** 2) + rounded.input_slopes @ rounded.input_slopes.T
    n_sets = 40_000
    for base, expected in ((plain, without), (rounded, without + more)):
        simulated = simulate_noise(base, np.random.default_rng(5), n_sets)
        assert np.abs(simulated.mean(axis=0)).max() < 4.0 * np.sqrt(expected.max() / n_sets)
        products = np.einsum("ni,nj->nij", simulated, simulated)
        error = products.std(axis=0) / np.sqrt(n_sets)
        assert np.abs((products.mean(axis=0) - expected) / error).max() < 4.5
    assert np.abs((products.mean(axis=0) - without) / error).max() > 15.0  # control: it shows

    squares = np.log(np.mean(simulate_noise(plain, np.random.default_rng(5), n_sets) ** 2, axis=1))
    known = np.log(np.mean(np.random.default_rng(6).standard_normal((n_sets, 6)) ** 2, axis=1))
    variance = known.var() + (2.0 * setup.noise.log_sd) ** 2
    assert squares.var() == pytest.approx(variance, rel=5.0 * np.sqrt(2.0 / n_sets))
    assert known.var() < 0.7 * variance  # control


def test_the_null_control_finds_little_where_there_is_nothing_and_sees_what_there_is(small):
    ground, one = small
    rng = np.random.default_rng(6)
    calm = null_control(ground, rng, 1000)
    assert calm.log_odds.shape == (1000,)
    assert calm.ratio is None
    assert calm.flagged_share <= FALSE_ALARMS
    there = run_search(ground, 1.5 * visible_of(one) + 0.001 * rng.standard_normal(6))
    assert there.log_odds == pytest.approx(np.log(there.probability[1] / there.probability[0]))
    assert calm.log_odds_percentile(there.log_odds) > 95.0
    assert calm.log_odds_percentile(-np.inf) == 0.0


def test_what_is_needed_begins_at_the_false_alarm_rate_within_its_bounds():
    """Of a hundred null sets two lie above; a quiet control does not make odds below three to one enough, and one full
    of alarms does not ask for more than nine to one.
    """
    even = NullControl(np.linspace(-1.0, 2.0, 101), None)
    assert np.sum(even.log_odds > even.needed_from) == 2
    assert NullControl(np.linspace(-3.0, 0.0, 101), None).needed_from == pytest.approx(np.log(3.0))
    assert NullControl(np.full(100, 9.0), None).needed_from == pytest.approx(np.log(9.0))


def test_fewer_null_sets_are_made_where_chance_is_certain(small):
    """Odds at the middle of the null are judged by the first hundred; what may be needed asks for all of them."""
    ground, _ = small
    whole = null_control(ground, np.random.default_rng(8), 500)
    middle, top = np.quantile(whole.log_odds, [0.5, 0.99])
    few = null_control(ground, np.random.default_rng(8), 500, middle)
    assert few.log_odds.size == len(few.residuals) == 100
    np.testing.assert_array_equal(few.log_odds, whole.log_odds[:100])
    assert middle < few.needed_from
    assert null_control(ground, np.random.default_rng(8), 500, top).log_odds.size == 500
    assert null_control(ground, np.random.default_rng(8), 250).log_odds.size == 250


def test_bounds_of_a_share_are_those_of_the_binomial_distribution():
    """Of a hundred sets with seven above, the lower bound of 99 % is beyond the false alarms, and not with six."""
    for n_above in (5, 6, 7):
        low, high = _share_bounds(np.arange(100) < n_above)
        assert binom.sf(n_above - 1, 100, low) == pytest.approx(0.01)
        assert binom.cdf(n_above, 100, high) == pytest.approx(0.01)
        assert (low > FALSE_ALARMS) is (n_above == 7)
    assert _share_bounds(np.zeros(100, dtype=bool)) == (0.0, pytest.approx(1.0 - 0.01**0.01))
    assert _share_bounds(np.ones(100, dtype=bool)) == (pytest.approx(0.01**0.01), 1.0)


@pytest.mark.parametrize(("place", "n"), [(0.0, 100), (0.5, 100), (0.05, 300)])
def test_fewer_sets_are_made_to_choose_where_the_threshold_is_clearly_passed_or_missed(small, place, n):
    """Below all of them or in their middle a hundred are enough; at the threshold itself all are needed."""
    ground, _ = small
    control = null_control(ground, np.random.default_rng(8), 300)
    whole = force_choices(ground, control)
    board = np.quantile(whole.ratio, place) if place else 0.9 * whole.ratio.min()
    found = force_choices(ground, control, float(board))
    np.testing.assert_array_equal(found.ratio, whole.ratio[:n])
    if place != 0.05:
        assert (board < found.ratio_to_beat) == (board < whole.ratio_to_beat) == (place == 0.0)


def test_null_sets_are_made_to_choose(small):
    """Else hardly any would, and the ratio of those that choose nothing is one."""
    ground, _ = small
    residuals = simulate_noise(ground.baseline, np.random.default_rng(7), 100)
    forced, free = nested_leave_one_out(ground, residuals, ANY_LOG_ODDS), nested_leave_one_out(ground, residuals)
    assert np.all(forced.choices == 1)
    assert np.mean(free.choices == 0) > 0.8
    control = force_choices(ground, null_control(ground, np.random.default_rng(7), 100))
    np.testing.assert_allclose(control.ratio, forced.ratio)
    assert control.ratio_to_beat < 1.0 < np.quantile(control.ratio, 0.95)
    assert control.ratio_to_beat == pytest.approx(np.quantile(forced.ratio, 0.05))
    assert control.ratio_percentile(control.ratio_to_beat) == pytest.approx(95.0, abs=1.1)


@pytest.mark.parametrize("change", [{"width": 0.5}, {"width": 2.0}, {"noise": 1.5}])
def test_a_variant_is_the_search_with_that_prior(change):
    """The same as a search whose candidate was made with the other prior, or whose card has another noise."""
    base = baseline(np.random.default_rng(1))
    direction = 0.03 * np.random.default_rng(2).standard_normal(6)
    residual = 0.02 * np.random.default_rng(3).standard_normal(6)

    def searched(sd: float, noise: float):
        one = candidate(base, "a", direction, Quantity.from_mean(0.0, sd, "normal"), n_cells=99)
        levels = noise_grid(base.board)
        levels = replace(levels, sd=noise * levels.sd)
        return run_search(ground_of(base, *singles(base, {"a": one}, levels, 0.4), candidates={"a": one}), residual)

    usual = searched(1.0, 1.0)
    wanted = searched(change.get("width", 1.0), change.get("noise", 1.0))
    found = vary_priors(usual, **change)
    assert found.probability_of_none == pytest.approx(wanted.probability_of_none, rel=0.02)
    np.testing.assert_allclose(found.log_evidence, wanted.log_evidence, atol=0.05)
    assert np.abs(found.log_evidence - usual.log_evidence).max() > 0.2  # control: the prior matters


@pytest.mark.parametrize("lower", [-np.inf, 0.0], ids=["normal", "half-normal"])
@pytest.mark.parametrize("n", [1, 2, 3, 5, 33])
def test_a_few_cells_have_the_prior_s_width_and_the_total_of_a_wider_one(lower, n):
    prior = Quantity.from_mean(0.0, 1.0, "normal", lower=lower)
    middles, width = _axis_cells(prior, n)
    weights = np.exp(-0.5 * middles**2)
    weights /= weights.sum()
    table = replace(no_effect_cells(6), weights=weights, form=np.zeros(n, dtype=np.intp), z=middles[:, None])
    halved, same, doubled = (float(weights @ _prior_ratio(table, [[prior]], factor)) for factor in (0.5, 1.0, 2.0))

    mean_square = float(weights @ (middles**2 + (0.5 * width) ** 2))
    assert 0.97 < mean_square < 1.05 + (0.0 if n < 3 else (0.5 * width) ** 2)  # more cells reach further, and blur more
    assert same == pytest.approx(1.0)
    assert halved == pytest.approx(1.0, abs=0.003)
    assert doubled == pytest.approx(0.869, abs=0.003)  # within three old standard deviations


def test_a_name_has_to_survive_widths_and_noises(small):
    ground, _ = small
    found = run_search(ground, 0.01 * np.random.default_rng(3).standard_normal(6))
    told = list(variant_searches(found))
    assert [words for words, _ in told] == [
        "with the priors of the sizes halved", "with the priors of the sizes doubled",
        "if the noise is 1.5 times smaller", "if the noise is 1.5 times larger", "under the exact law",
    ]  # fmt: skip
    usual = [
        vary_priors(found, **change).probability_of_none
        for change in ({"width": 0.5}, {"width": 2.0}, {"noise": 2 / 3}, {"noise": 1.5})
    ]
    assert [other.probability_of_none for _, other in told[:-1]] == pytest.approx(usual)
    assert told[-1][1] is under_exact_law(found)
    assert (
        len({round(other.probability_of_none, 6) for _, other in told[:-1]} | {round(found.probability_of_none, 6)})
        == 5
    )
