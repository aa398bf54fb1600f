"""Sums over assignments of peaks to modes against enumeration, one by one."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from bayesplate.frequencies.assignment import Assignments

SIZES = [(1, 1), (1, 4), (3, 3), (4, 2), (4, 6), (5, 5), (0, 3), (2, 0)]
N_DRAWS = 7


def made(n_peaks: int, n_modes: int, seed: int = 0) -> Assignments:
    rng = np.random.default_rng(seed)
    log_pair = 8.0 * rng.standard_normal((n_peaks, n_modes, N_DRAWS))
    return Assignments(log_pair, 5.0 * rng.standard_normal(n_peaks), rng.uniform(0.05, 1.0, (n_modes, N_DRAWS)))


def enumerated(one: Assignments, draw: int) -> tuple[float, np.ndarray]:
    """The sum, and the probability of each pair, assignment by assignment."""
    n_peaks, n_modes = one.log_pair.shape[:2]
    total, pairs = 0.0, np.zeros((n_peaks, n_modes))
    for size in range(min(n_peaks, n_modes) + 1):
        for peaks in combinations(range(n_peaks), size):
            for modes in combinations(range(n_modes), size):
                weight = np.prod([one.missed[j, draw] for j in range(n_modes) if j not in modes])
                weight *= np.exp(sum(one.log_alone[i] for i in range(n_peaks) if i not in peaks))
                weight *= np.exp(sum(one.log_pair[i, j, draw] for i, j in zip(peaks, modes, strict=True)))
                total += weight
                pairs[list(peaks), list(modes)] += weight
    return total, pairs / total


@pytest.mark.parametrize(("n_peaks", "n_modes"), SIZES)
def test_the_sums_and_the_pairs_are_those_of_every_assignment_counted_once(n_peaks: int, n_modes: int) -> None:
    one = made(n_peaks, n_modes)
    taking = np.array([[True] * n_peaks, *(np.random.default_rng(1).random((5, n_peaks)) < 0.6)])
    log_sums = one.log_sums(taking)
    for some, log_sum in zip(taking, log_sums, strict=True):
        part = one.of(some)
        pairs = part.pairs()
        for draw in range(N_DRAWS):
            total, expected = enumerated(part, draw)
            assert log_sum[draw] == pytest.approx(np.log(total), rel=1e-12, abs=1e-10)
            assert pairs[..., draw] == pytest.approx(expected, abs=1e-10)


def test_a_spectrum_of_a_hundred_modes_neither_underflows_nor_overflows() -> None:
    modes = np.linspace(4.0, 7.0, 100)[:, None]
    peaks = modes[:, 0] + 1e-4
    pair = np.log(0.5) - 0.5 * ((peaks[:, None, None] - modes) / 1e-3) ** 2
    one = Assignments(pair, np.full(peaks.size, np.log(1e-3)), np.full(modes.shape, 1e-3))
    assert np.isfinite(one.log_sums(np.ones((1, peaks.size), dtype=bool))).all()
    # A peak and its mode that both stand alone are a thousandth of a thousandth, beside the half of their pair.
    assert one.pairs()[np.arange(100), np.arange(100), 0] == pytest.approx(
        1.0 - 1e-6 / (0.5 * np.exp(-0.005)), abs=1e-9
    )


def test_a_peak_that_no_mode_explains_stands_alone() -> None:
    one = Assignments(np.full((1, 2, 1), -np.inf), np.log([0.1]), np.full((2, 1), 0.5))
    assert one.log_sums(np.ones((1, 1), dtype=bool))[0] == pytest.approx(np.log(0.1 * 0.25))
    assert one.pairs().sum() == 0.0
