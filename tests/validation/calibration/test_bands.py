"""The bands: as many uniform ranks leave them as they say, and ranks that are not uniform do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from validation.calibration.bands import (
    N_SIMULATED,
    band,
    band_p_value,
    chi2_p_value,
    coverage_p_value,
)
from validation.calibration.table import Row, is_calibrated

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
