"""The bands: as many uniform ranks leave them as they say, and ranks that are not uniform do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from validation.calibration.bands import (
    N_SIMULATED,
    band,
    band_p_value,
    central_coverage,
    chi2_p_value,
    coverage_p_value,
)
from validation.calibration.table import MUTANT_LEVEL, Row, is_calibrated

N_DRAWS = 99


@pytest.mark.parametrize("n_ranks", [40, 200])
@pytest.mark.parametrize("p_value", [band_p_value, chi2_p_value])
def test_uniform_ranks_leave_the_band_as_often_as_stated(p_value, n_ranks):
    n_sets = 1000
    rng = np.random.default_rng(n_ranks)
    p = np.array([p_value(rng.integers(0, N_DRAWS + 1, n_ranks), N_DRAWS) for _ in range(n_sets)])
    # five rejections in a hundred, to four binomial errors; chi-squared is approximate at two counts a bin
    slack = 0.02 if (p_value is chi2_p_value and n_ranks == 40) else 0.0
    assert np.mean(p < 0.05) == pytest.approx(0.05, abs=4 * np.sqrt(0.05 * 0.95 / n_sets) + slack)


@pytest.mark.parametrize("spread", [1.0, 0.9])
def test_the_band_that_is_drawn_is_the_one_that_judges(spread):
    rng = np.random.default_rng(5)
    low, high = band(200, N_DRAWS, 0.05)
    at_its_edge = (1 + int(0.05 * N_SIMULATED)) / (N_SIMULATED + 1)  # what ranks just outside it have at most
    verdicts = []
    for _ in range(100):
        ranks = (100 * stats.norm.cdf(rng.standard_normal(200) / spread)).astype(int)
        shares = np.bincount(ranks, minlength=N_DRAWS + 1).cumsum()[:-1] / 200
        is_outside = bool(np.any((shares < low - 1e-9) | (shares > high + 1e-9)))
        assert is_outside == (band_p_value(ranks, N_DRAWS) <= at_its_edge)
        verdicts.append(is_outside)
    assert 0 < sum(verdicts) < 100


@pytest.mark.parametrize(("a", "b"), [(0.5, 0.5), (2.0, 2.0), (1.0, 1.6)], ids=["too narrow", "too wide", "shifted"])
def test_ranks_of_a_wrong_posterior_leave_the_band(a, b):
    ranks = (100 * stats.beta(a, b).rvs(200, random_state=1)).astype(int)
    assert band_p_value(ranks, N_DRAWS) < 1e-3


@pytest.mark.parametrize(("n", "spread", "least", "most"), [
    (32, 0.7, 0.80, 1.0), (200, 0.8, 0.95, 1.0), (200, 0.9, 0.2, 0.7), (200, 1.0, 0.0, 0.05),
])  # fmt: skip
def test_how_many_simulations_a_narrow_posterior_takes_to_be_caught(n, spread, least, most):
    """Power of the bands at the level of the mutants, for four normal parameters and their log likelihood.

    Of 60 experiments each; the limits lie two binomial errors or more from the shares of 100 others: 0.92, 1.00, 0.43
    and 0.00. Spreads of nine tenths are what 200 simulations see in less than half the cases.
    """
    rng = np.random.default_rng(1)
    caught = 0
    for _ in range(60):
        truth, draws = rng.standard_normal((n, 4)), spread * rng.standard_normal((n, N_DRAWS, 4))
        ranks = [np.sum(draws[:, :, k] < truth[:, k, None], axis=1) for k in range(4)]
        ranks.append(np.sum(np.sum(draws**2, axis=2) > np.sum(truth**2, axis=1)[:, None], axis=1))
        caught += len(ranks) * min(band_p_value(one, N_DRAWS) for one in ranks) < MUTANT_LEVEL
    assert least <= caught / 60 <= most


def test_the_band_is_symmetric_and_sees_the_ends():
    rng = np.random.default_rng(2)
    ranks = rng.integers(0, N_DRAWS + 1, 200)
    assert band_p_value(N_DRAWS - ranks, N_DRAWS) == pytest.approx(band_p_value(ranks, N_DRAWS), rel=1e-9)
    ranks[:20] = 0
    assert band_p_value(ranks, N_DRAWS) < 1e-3


def test_central_coverage_counts_whole_ranks():
    everything = np.arange(N_DRAWS + 1)
    assert central_coverage(everything, N_DRAWS, 0.9) == pytest.approx(0.9)
    assert central_coverage(everything, N_DRAWS, 0.5) == pytest.approx(0.5)


def test_intervals_that_hold_the_truth_too_often_are_found_out():
    """The 99 % limits of 1000 simulations: the middle half holds between 45.9 and 54.1 % of them."""
    values = np.arange(N_DRAWS + 1)
    held = (values >= 25) & (values < 75)
    for share, is_right in ((0.541, True), (0.542, False), (0.459, True), (0.458, False)):
        n_within = round(1000 * share)
        ranks = np.concatenate([np.resize(values[held], n_within), np.resize(values[~held], 1000 - n_within)])
        assert (coverage_p_value(ranks, N_DRAWS, 0.5) > 0.01) == is_right


@pytest.mark.parametrize(("coverage", "is_right"), [(0.0018, True), (0.0016, False)])
def test_a_part_is_right_if_its_intervals_are(coverage, is_right):
    """Three quantities, two intervals each: six chances that something leaves a limit of 0.01."""
    table = [Row(name, 0.5, 0.5, 0.5, (0.5, 0.9), p) for name, p in (("a", 0.5), ("b", coverage), ("c", 0.9))]
    assert is_calibrated(table) is is_right
    assert not is_calibrated([*table, Row("d", 0.001, 0.5, 0.5, (0.5, 0.9), 0.5)])
