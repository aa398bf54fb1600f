"""Sums over assignments of peaks to modes against enumeration, one by one."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations, product

import numpy as np
import pytest

from bayesplate.frequencies.assignment import LOG_NEGLIGIBLE, Assignments, NearPeaks

SIZES = [((1,), 1), ((1,), 4), ((3,), 3), ((4,), 2), ((4,), 6), ((0,), 3), ((2,), 0)]
SIZES += [((1, 1), 1), ((2, 2), 3), ((3, 2), 5), ((1, 4), 3), ((0, 2), 3)]
N_DRAWS = 4


@dataclass(frozen=True)
class Told:
    """What peaks say of modes: ln e_ij of each row, ln s_i, m_j; and where peaks of either sign stand in both rows."""

    log_pair: tuple[np.ndarray, ...]
    log_alone: tuple[np.ndarray, ...]
    missed: np.ndarray
    unsigned: tuple[tuple[int, int], ...] = ()

    @property
    def assignments(self) -> Assignments:
        logs = [
            pair - alone[:, None, None] - np.log(self.missed)
            for pair, alone in zip(self.log_pair, self.log_alone, strict=True)
        ]
        near = [NearPeaks.of((each > LOG_NEGLIGIBLE).any(axis=2)) for each in logs]
        ratios = [np.exp(each[one.pairs()]) for each, one in zip(logs, near, strict=True)]
        return Assignments(near, ratios, self.unsigned)

    @property
    def log_of_all_alone(self) -> np.ndarray:
        """ln of the assignment without a pair; a peak that stands in both rows is one."""
        twice = sum(self.log_alone[1][peak] for _, peak in self.unsigned)
        return sum(each.sum() for each in self.log_alone) - twice + np.log(self.missed).sum(axis=0)


def made(n_peaks: tuple[int, ...], n_modes: int, seed: int = 0) -> Told:
    rng = np.random.default_rng(seed)
    log_pair = tuple(8.0 * rng.standard_normal((n, n_modes, N_DRAWS)) for n in n_peaks)
    log_alone = tuple(5.0 * rng.standard_normal(n) for n in n_peaks)
    return Told(log_pair, log_alone, rng.uniform(0.05, 1.0, (n_modes, N_DRAWS)))


def made_apart(n_peaks: tuple[int, ...], n_modes: int, seed: int) -> Told:
    """Peaks that are near a few modes each, and say next to nothing of the others."""
    rng = np.random.default_rng(seed)
    modes = np.sort(rng.uniform(0.0, 1.0, n_modes))[:, None] + 0.05 * rng.standard_normal((n_modes, N_DRAWS))
    peaks = [np.sort(rng.uniform(0.0, 1.0, n)) for n in n_peaks]
    log_pair = tuple(5.0 - 0.5 * ((own[:, None, None] - modes) / 0.02) ** 2 for own in peaks)
    log_alone = tuple(rng.standard_normal(n) for n in n_peaks)
    return Told(log_pair, log_alone, rng.uniform(0.05, 1.0, (n_modes, N_DRAWS)))


def made_in_disorder(n_peaks: tuple[int, ...], n_modes: int, seed: int) -> Told:
    """Every other pair out of the question, in no order."""
    one, rng = made(n_peaks, n_modes, seed), np.random.default_rng(seed)
    log_pair = tuple(np.where(rng.random((*row.shape[:2], 1)) < 0.5, row, -100.0) for row in one.log_pair)
    return replace(one, log_pair=log_pair)


def of_either_sign(one: Told, seed: int) -> Told:
    """The same with as many peaks of unknown sign as both rows can share, two at most."""
    n = min(2, *(len(row) for row in one.log_alone))
    rng = np.random.default_rng(seed)
    places = [np.sort(rng.permutation(len(row))[:n]) for row in one.log_alone]
    other = one.log_alone[1].copy()
    other[places[1]] = one.log_alone[0][places[0]]
    unsigned = tuple((int(i), int(j)) for i, j in zip(*places, strict=True))
    return replace(one, log_alone=(one.log_alone[0], other), unsigned=unsigned)


def ascending(n_peaks: int, n_modes: int) -> list[list[tuple[int, int]]]:
    """All sets of pairs of a row that rise in both."""
    return [
        list(zip(peaks, modes, strict=True))
        for size in range(min(n_peaks, n_modes) + 1)
        for peaks in combinations(range(n_peaks), size)
        for modes in combinations(range(n_modes), size)
    ]


def enumerated(one: Told, draw: int) -> tuple[float, list[np.ndarray]]:
    """The sum, and the probability of each pair of each row, assignment by assignment; no mode is in two pairs.

    For each sign of the peaks that may have either, these stand in the row of that sign alone.
    """
    n_modes = len(one.missed)
    total, pairs = 0.0, [np.zeros(each.shape[:2]) for each in one.log_pair]
    all_rows = list(product(*(ascending(len(each), n_modes) for each in one.log_pair)))
    for signs in product(range(2), repeat=len(one.unsigned)):
        absent = [(1 - sign, places[1 - sign]) for sign, places in zip(signs, one.unsigned, strict=True)]
        for rows in all_rows:
            taken = [j for row in rows for _, j in row]
            if len(set(taken)) < len(taken) or any(i == gone for row, gone in absent for i, _ in rows[row]):
                continue
            weight = np.prod([one.missed[j, draw] for j in range(n_modes) if j not in taken])
            for at, (row, log_alone, log_pair) in enumerate(zip(rows, one.log_alone, one.log_pair, strict=True)):
                elsewhere = {i for i, _ in row} | {gone for of_row, gone in absent if of_row == at}
                weight *= np.exp(sum(log_alone[i] for i in range(len(log_alone)) if i not in elsewhere))
                weight *= np.exp(sum(log_pair[i, j, draw] for i, j in row))
            total += weight
            for row, own in zip(rows, pairs, strict=True):
                for i, j in row:
                    own[i, j] += weight
    return total, [own / total for own in pairs]


def found_pairs(one: Told) -> list[np.ndarray]:
    """The probabilities of all pairs: of those that are near none, zero."""
    assignments = one.assignments
    result = [np.zeros(each.shape) for each in one.log_pair]
    for whole, near, pairs in zip(result, assignments.near_peaks, assignments.pairs(), strict=True):
        whole[near.pairs()] = pairs
    return result


def every_kind(n_peaks: tuple[int, ...], n_modes: int) -> list[Told]:
    """Peaks near all modes, near a few each, and near some in no order; of two rows also with peaks of either sign."""
    found = [made(n_peaks, n_modes)]
    if n_modes > 2:
        found += [make(n_peaks, n_modes, seed) for make in (made_apart, made_in_disorder) for seed in range(3)]
    if len(n_peaks) == 2:
        found += [of_either_sign(one, seed) for seed, one in enumerate(found)]
    return found


@pytest.mark.parametrize(("n_peaks", "n_modes"), SIZES)
def test_the_sums_and_the_pairs_are_those_of_every_assignment_counted_once(n_peaks, n_modes) -> None:
    for which, one in enumerate(every_kind(n_peaks, n_modes)):
        log_sum, pairs = one.assignments.log_sum() + one.log_of_all_alone, found_pairs(one)
        for draw in range(N_DRAWS):
            total, expected = enumerated(one, draw)
            assert log_sum[draw] == pytest.approx(np.log(total), rel=1e-12, abs=1e-10), which
            for found, wanted in zip(pairs, expected, strict=True):
                assert found[..., draw] == pytest.approx(wanted, abs=1e-10), which


def test_a_spectrum_of_a_hundred_modes_neither_underflows_nor_overflows() -> None:
    modes = np.linspace(4.0, 7.0, 100)[:, None]
    peaks = modes[:, 0] + 1e-4
    pair = np.log(0.5) - 0.5 * ((peaks[:, None, None] - modes) / 1e-3) ** 2
    alone = np.full(peaks.size, np.log(1e-3))
    whole = Told((pair,), (alone,), np.full(modes.shape, 1e-3))
    split = Told((pair[::2], pair[1::2]), (alone[::2], alone[1::2]), np.full(modes.shape, 1e-3))
    sums = [one.assignments.log_sum() + one.log_of_all_alone for one in (whole, split)]
    assert np.isfinite(sums[0]).all()
    assert sums[0] == pytest.approx(sums[1], rel=1e-9)  # the rows hardly compete for a mode
    # A peak and its mode that both stand alone are a thousandth of a thousandth, beside the half of their pair.
    assert found_pairs(whole)[0][np.arange(100), np.arange(100), 0] == pytest.approx(
        1.0 - 1e-6 / (0.5 * np.exp(-0.005)), abs=1e-9
    )


def test_a_peak_that_no_mode_explains_stands_alone() -> None:
    one = Told((np.full((1, 2, 1), -np.inf),), (np.log([0.1]),), np.full((2, 1), 0.5))
    assert one.assignments.log_sum() + one.log_of_all_alone == pytest.approx(np.log(0.1 * 0.25))
    assert found_pairs(one)[0].sum() == 0.0


def test_a_peak_of_either_sign_counts_with_both_where_no_mode_explains_it() -> None:
    nothing = np.full((1, 2, 1), -np.inf)
    one = Told((nothing, nothing), (np.log([0.1]), np.log([0.1])), np.full((2, 1), 0.5), ((0, 0),))
    assert one.assignments.log_sum() + one.log_of_all_alone == pytest.approx(np.log(2 * 0.1 * 0.25))
