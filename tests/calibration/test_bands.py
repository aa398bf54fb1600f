"""The bands: as many uniform ranks leave them as they say, and ranks that are not uniform do."""

from __future__ import annotations

import numpy as np
import pytest
from calibration.bands import band_p_value, central_coverage, chi2_p_value
from scipy import stats

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


@pytest.mark.parametrize(("a", "b"), [(0.5, 0.5), (2.0, 2.0), (1.0, 1.6)], ids=["too narrow", "too wide", "shifted"])
def test_ranks_of_a_wrong_posterior_leave_the_band(a, b):
    ranks = (100 * stats.beta(a, b).rvs(200, random_state=1)).astype(int)
    assert band_p_value(ranks, N_DRAWS) < 1e-3


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
