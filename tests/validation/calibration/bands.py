"""Whether ranks are uniform: a band that the empirical distribution leaves somewhere with a stated probability.

References
----------
T. Säilynoja, P.-C. Bürkner, A. Vehtari, Graphical test for discrete uniformity and its applications in goodness-of-fit
evaluation and multiple sample comparison, Statistics and Computing 32 (2022), doi:10.1007/s11222-022-10090-6.
S. Talts et al., Validating Bayesian inference algorithms with simulation-based calibration, arXiv:1804.06788.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy import stats

N_SIMULATED = 20_000
"""Sets of uniform ranks behind a band: a probability of 0.05 is known to 0.0015."""

N_BINS = 20


@lru_cache(maxsize=8)
def _reference(n_ranks: int, n_values: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Two-sided binomial probability of each count at each point, and its minimum over points for uniform ranks."""
    expected = np.arange(1, n_values) / n_values
    counts = np.arange(n_ranks + 1)
    below = stats.binom.cdf(counts, n_ranks, expected[:, None])
    above = stats.binom.sf(counts - 1, n_ranks, expected[:, None])
    tails = np.minimum(1.0, 2.0 * np.minimum(below, above))
    rng = np.random.default_rng(0)
    simulated = rng.multinomial(n_ranks, np.full(n_values, 1.0 / n_values), size=N_SIMULATED).cumsum(axis=1)[:, :-1]
    return tails, np.sort(tails[np.arange(n_values - 1), simulated].min(axis=1))


def band_p_value(ranks: NDArray[np.int_], n_draws: int) -> float:
    """How often uniform ranks leave a band as wide as the one these ranks just touch.

    Below 0.05 means that the empirical distribution leaves its simultaneous 95 % band.

    Parameters
    ----------
    ranks : (n,) array of int
        Each from 0 to n_draws.
    n_draws : int

    Returns
    -------
    float
        At least 1 / (N_SIMULATED + 1).
    """
    n_values = n_draws + 1
    tails, smallest = _reference(len(ranks), n_values)
    counts = np.bincount(ranks, minlength=n_values).cumsum()[:-1]
    observed = tails[np.arange(n_values - 1), counts].min()
    return float((1 + np.searchsorted(smallest, observed * (1 + 1e-9))) / (N_SIMULATED + 1))


def band(n_ranks: int, n_draws: int, level: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Ends of the band that the empirical distribution of uniform ranks leaves with a probability.

    Parameters
    ----------
    n_ranks, n_draws : int
    level : float
        That probability.

    Returns
    -------
    low, high : (n_draws,) arrays
        Shares of ranks below 1 to n_draws.
    """
    tails, smallest = _reference(n_ranks, n_draws + 1)
    inside = tails >= smallest[int(level * N_SIMULATED)]
    low = inside.argmax(axis=1)
    high = n_ranks - inside[:, ::-1].argmax(axis=1)
    return low / n_ranks, high / n_ranks


def chi2_p_value(ranks: NDArray[np.int_], n_draws: int) -> float:
    """The older test, blind to the order of the bins: a second opinion."""
    counts, _ = np.histogram(ranks, bins=N_BINS, range=(0, n_draws + 1))
    return float(stats.chisquare(counts).pvalue)


def central_coverage(ranks: NDArray[np.int_], n_draws: int, probability: float) -> float:
    """Share of truths within the central interval of that probability."""
    tail = 0.5 * (1.0 - probability) * (n_draws + 1)
    return float(np.mean((ranks >= tail) & (ranks < n_draws + 1 - tail)))


def coverage_p_value(ranks: NDArray[np.int_], n_draws: int, probability: float) -> float:
    """Two-sided binomial probability that central intervals hold the truth as often or seldom as these."""
    within = round(central_coverage(ranks, n_draws, probability) * len(ranks))
    n_within = central_coverage(np.arange(n_draws + 1), n_draws, probability)
    return float(stats.binomtest(within, len(ranks), n_within).pvalue)
