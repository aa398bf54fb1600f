"""Sums over assignments of peaks to modes against enumeration, one by one."""

from __future__ import annotations

from itertools import combinations, product

import numpy as np
import pytest

from bayesplate.frequencies.assignment import Assignments

SIZES = [((1,), 1), ((1,), 4), ((3,), 3), ((4,), 2), ((4,), 6), ((0,), 3), ((2,), 0)]
SIZES += [((1, 1), 1), ((2, 2), 3), ((3, 2), 5), ((1, 4), 3), ((0, 2), 3)]
N_DRAWS = 7


def made(n_peaks: tuple[int, ...], n_modes: int, seed: int = 0) -> Assignments:
    rng = np.random.default_rng(seed)
    log_pair = tuple(8.0 * rng.standard_normal((n, n_modes, N_DRAWS)) for n in n_peaks)
    log_alone = tuple(5.0 * rng.standard_normal(n) for n in n_peaks)
    return Assignments(log_pair, log_alone, rng.uniform(0.05, 1.0, (n_modes, N_DRAWS)))


def made_apart(n_peaks: tuple[int, ...], n_modes: int, seed: int) -> Assignments:
    """Peaks that are near a few modes each, and say next to nothing of the others."""
    rng = np.random.default_rng(seed)
    modes = np.sort(rng.uniform(0.0, 1.0, n_modes))[:, None] + 0.05 * rng.standard_normal((n_modes, N_DRAWS))
    peaks = [np.sort(rng.uniform(0.0, 1.0, n)) for n in n_peaks]
    log_pair = tuple(5.0 - 0.5 * ((own[:, None, None] - modes) / 0.02) ** 2 for own in peaks)
    log_alone = tuple(rng.standard_normal(n) for n in n_peaks)
    return Assignments(log_pair, log_alone, rng.uniform(0.05, 1.0, (n_modes, N_DRAWS)))


def made_in_disorder(n_peaks: tuple[int, ...], n_modes: int, seed: int) -> Assignments:
    """Every other pair out of the question, in no order."""
    one, rng = made(n_peaks, n_modes, seed), np.random.default_rng(seed)
    log_pair = tuple(np.where(rng.random((*row.shape[:2], 1)) < 0.5, row, -100.0) for row in one.log_pair)
    return Assignments(log_pair, one.log_alone, one.missed)


def ascending(n_peaks: int, n_modes: int) -> list[list[tuple[int, int]]]:
    """All sets of pairs of a row that rise in both."""
    return [
        list(zip(peaks, modes, strict=True))
        for size in range(min(n_peaks, n_modes) + 1)
        for peaks in combinations(range(n_peaks), size)
        for modes in combinations(range(n_modes), size)
    ]


def enumerated(one: Assignments, draw: int) -> tuple[float, list[np.ndarray]]:
    """The sum, and the probability of each pair of each row, assignment by assignment; no mode is in two pairs."""
    n_modes = len(one.missed)
    total, pairs = 0.0, [np.zeros(each.shape[:2]) for each in one.log_pair]
    for rows in product(*(ascending(len(each), n_modes) for each in one.log_pair)):
        taken = [j for row in rows for _, j in row]
        if len(set(taken)) < len(taken):
            continue
        weight = np.prod([one.missed[j, draw] for j in range(n_modes) if j not in taken])
        for row, log_alone, log_pair in zip(rows, one.log_alone, one.log_pair, strict=True):
            paired = [i for i, _ in row]
            weight *= np.exp(sum(log_alone[i] for i in range(len(log_alone)) if i not in paired))
            weight *= np.exp(sum(log_pair[i, j, draw] for i, j in row))
        total += weight
        for row, own in zip(rows, pairs, strict=True):
            for i, j in row:
                own[i, j] += weight
    return total, [own / total for own in pairs]


@pytest.mark.parametrize(
    "one",
    [made(*size) for size in SIZES]
    + [
        make(*size, seed)
        for make in (made_apart, made_in_disorder)
        for size in SIZES
        if size[1] > 2
        for seed in range(3)
    ],
)
def test_the_sums_and_the_pairs_are_those_of_every_assignment_counted_once(one) -> None:
    n_peaks = [len(row) for row in one.log_alone]
    rng = np.random.default_rng(1)
    taking = [np.array([[True] * n, *(rng.random((3, n)) < 0.6)]) for n in n_peaks]
    for *some, log_sum in zip(*taking, one.log_sums(taking), strict=True):
        part = one.of(some)
        pairs = part.pairs()
        for draw in range(N_DRAWS):
            total, expected = enumerated(part, draw)
            assert log_sum[draw] == pytest.approx(np.log(total), rel=1e-12, abs=1e-10)
            for found, wanted in zip(pairs, expected, strict=True):
                assert found[..., draw] == pytest.approx(wanted, abs=1e-10)


def test_a_spectrum_of_a_hundred_modes_neither_underflows_nor_overflows() -> None:
    modes = np.linspace(4.0, 7.0, 100)[:, None]
    peaks = modes[:, 0] + 1e-4
    pair = np.log(0.5) - 0.5 * ((peaks[:, None, None] - modes) / 1e-3) ** 2
    alone = np.full(peaks.size, np.log(1e-3))
    whole = Assignments((pair,), (alone,), np.full(modes.shape, 1e-3))
    split = Assignments((pair[::2], pair[1::2]), (alone[::2], alone[1::2]), np.full(modes.shape, 1e-3))
    sums = [one.log_sums([np.ones((1, len(row)), dtype=bool) for row in one.log_alone]) for one in (whole, split)]
    assert np.isfinite(sums[0]).all()
    assert sums[0] == pytest.approx(sums[1], rel=1e-9)  # the rows hardly compete for a mode
    # A peak and its mode that both stand alone are a thousandth of a thousandth, beside the half of their pair.
    assert whole.pairs()[0][np.arange(100), np.arange(100), 0] == pytest.approx(
        1.0 - 1e-6 / (0.5 * np.exp(-0.005)), abs=1e-9
    )


def test_a_peak_that_no_mode_explains_stands_alone() -> None:
    one = Assignments((np.full((1, 2, 1), -np.inf),), (np.log([0.1]),), np.full((2, 1), 0.5))
    assert one.log_sums([np.ones((1, 1), dtype=bool)])[0] == pytest.approx(np.log(0.1 * 0.25))
    assert one.pairs()[0].sum() == 0.0
