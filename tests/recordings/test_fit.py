"""The local fit: exact on what it describes, with errors that are those of the noise, and close pairs told apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.recordings.local_fit import Window, fit_at_poles, refine_poles, search_modes

RATE, N = 4000.0, 6000
LINES = np.arange(N // 2) * RATE / N
PAIR = np.array([[210.0, 1.2], [212.1, 1.5]])
"""Two modes 1 % apart: frequency and decay rate, Hz."""
KEPT = (LINES > 160.0) & (LINES < 260.0)


def decays(rng: np.random.Generator, poles: np.ndarray, n_records: int, noise: float) -> np.ndarray:
    """Spectra of sums of decays, cut off as they are: by the sum of their samples, not by the rational form."""
    times = np.arange(N) / RATE
    columns = []
    for _ in range(n_records):
        sizes, phases = rng.uniform(0.5, 1.0, len(poles)), rng.uniform(0.0, 2.0 * np.pi, len(poles))
        waves = np.exp(-2.0 * np.pi * poles[:, 1:] * times) * np.cos(
            2.0 * np.pi * poles[:, :1] * times + phases[:, None]
        )
        heard = sizes @ waves + noise * rng.standard_normal(N)
        columns.append(np.fft.rfft(heard)[: N // 2] / RATE)
    return np.stack(columns, axis=1)


def window(values: np.ndarray) -> Window:
    """The lines about the pair."""
    return Window(LINES[KEPT], values[KEPT], np.zeros((0, 2)))


def test_without_noise_the_modes_are_exact_however_short_the_record():
    """Two slow decays, cut off when much of them is left: leakage is part of the rational form."""
    slow = PAIR * [1.0, 0.1]
    fit = refine_poles(window(decays(np.random.default_rng(1), slow, 3, 0.0)), slow + np.array([0.3, 0.05]))

    np.testing.assert_allclose(fit.poles, slow, rtol=0.0, atol=2e-6)


def test_errors_are_those_of_the_noise():
    """Forty sets of one noise: the scatter is that of the information, within four of its own errors."""
    rng = np.random.default_rng(2)
    off, sds = [], []
    for _ in range(40):
        fit = refine_poles(window(decays(rng, PAIR, 4, 0.1)), PAIR)
        inverse = np.linalg.inv(fit.information()[1].sum(axis=0))
        off.append((fit.poles - PAIR).T.ravel())
        sds.append(np.sqrt(np.diagonal(inverse)))
    z = np.array(off) / np.array(sds)

    spread = np.sqrt(np.mean(z**2))
    assert abs(spread - 1.0) < 4.0 / np.sqrt(2.0 * z.size)
    assert np.abs(z.mean(axis=0)).max() < 4.0 / np.sqrt(len(z))


def test_a_close_pair_is_told_apart_and_a_single_mode_is_left_single():
    rng = np.random.default_rng(3)
    noisy = decays(rng, PAIR, 4, 0.02)
    single = decays(rng, PAIR[:1], 4, 0.02)

    both = search_modes(replace(window(noisy / _level(noisy)), least_variance=1.0), 45.0)[-1]
    one = search_modes(replace(window(single / _level(single)), least_variance=1.0), 45.0)[-1]

    np.testing.assert_allclose(np.sort(both[:, 0]), PAIR[:, 0], atol=0.05)
    assert one.shape == (1, 2)


def _level(values: np.ndarray) -> np.ndarray:
    far = (LINES > 1000.0) & (LINES < 1500.0)
    return np.sqrt(np.mean(np.abs(values[far]) ** 2, axis=0))


def test_the_jacobian_is_the_derivative():
    """Against differences: what a step in each parameter does to what is left, other shapes free."""
    values = decays(np.random.default_rng(4), PAIR, 2, 0.05)
    at = fit_at_poles(window(values), PAIR)
    scores, _ = at.information()
    for k, (mode, which) in enumerate([(0, 0), (1, 0), (0, 1), (1, 1)]):
        step = np.zeros((2, 2))
        step[mode, which] = 1e-4
        sums = [
            np.sum(np.abs(fit_at_poles(window(values), PAIR + sign * step).residual) ** 2, axis=0) for sign in (1, -1)
        ]
        slope = -(sums[0] - sums[1]) / 2e-4 / at.variance
        assert scores[:, k] == pytest.approx(slope, rel=1e-3)
