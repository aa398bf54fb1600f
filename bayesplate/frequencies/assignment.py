"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks stand in one row, or in two whose modes differ in the sign of their residue. Those of a row and their modes keep
their order of frequency; a mode is one peak of one row or leaves none, and a peak may be no mode. With e_ij what peak i
says of mode j, s_i what it says where it is no mode, and m_j the probability that mode j left no peak, an assignment is
a set of pairs (i, j) that rises in both within a row, and weighs the product of the e_ij of its pairs, and of the s_i
and m_j that stand in no pair: the product of all s_i and m_j, times that of r_ij = e_ij / (s_i m_j) over its pairs. The
sum of the latter over all assignments of the first j modes of which a and b are the last peaks of both rows that stand
in a pair (0: none) runs forward over the modes,

    F_0[0, 0] = 1,    F_j[a, b] = F_(j-1)[a, b] + r_aj sum over i < a of F_(j-1)[i, b]
                                                + r_bj sum over i < b of F_(j-1)[a, i].

This is a pair hidden Markov model in which each assignment has one path: the peaks and modes that stand alone between
two pairs are not counted once for every way to interleave them. A run backward gives the probability of each pair.

Peaks lie near a few modes each. Once no mode to come is near the first peaks of a row it matters no more which of them
stood in the last pair, so that their sums become one; and sums of peaks that no mode was near yet are zero. Of the
table F_j a small window is left, which moves along the peaks with the modes.

References
----------
Durbin, Eddy, Krogh and Mitchison, Biological Sequence Analysis, 1998, chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_LEAST = 1e-3
"""Probability that a mode left no peak, at least: no ratio is beyond all numbers then."""
_MANY = 1e30
"""A draw's sums are divided by the largest once one exceeds this: times one more ratio it is a number still."""
_LOG_NOTHING = float(np.log(1e-18))
"""Of a ratio that changes no sum of one and more; smaller ones come to numbers that processors are slow with."""


@dataclass(frozen=True, eq=False)
class Assignments:
    """What peaks say of modes at many draws: both in the order of frequency, the modes in that of each draw.

    The draws come last: a run over modes then adds whole rows of them.

    Attributes
    ----------
    log_pair : one or two (n_peaks, n_modes, n_draws) arrays
        ln e_ij of each row of peaks.
    log_alone : as many (n_peaks,) arrays
        ln s_i.
    missed : (n_modes, n_draws) array
        m_j, 0 to 1.
    """

    log_pair: tuple[Floats, ...]
    log_alone: tuple[Floats, ...]
    missed: Floats

    def log_sums(self, taking: Sequence[Bools]) -> Floats:
        """ln of the sum over all assignments of some of the peaks, the others not there.

        Parameters
        ----------
        taking : for each row of peaks an (n_subsets, n_peaks) array of bool
            The peaks of each subset.

        Returns
        -------
        (n_subsets, n_draws) array
        """
        taken = np.concatenate(taking, axis=1)
        rows = self._rows(taking)
        *_, (sums, log_scale) = _forward(rows, (len(taken), self.missed.shape[1]))
        found = np.log(sums[0, 0]) + log_scale
        return found + (taken @ np.concatenate(self.log_alone))[:, None] + self._log_missed.sum(axis=0)

    def of(self, taken: Sequence[Bools]) -> Assignments:
        """The same of some of the peaks, the others not there: for each row an (n_peaks,) array of bool."""
        log_pair, log_alone = (
            tuple(each[own] for each, own in zip(rows, taken, strict=True)) for rows in (self.log_pair, self.log_alone)
        )
        return Assignments(log_pair, log_alone, self.missed)

    def pairs(self) -> tuple[Floats, ...]:
        """Probability that each peak is each mode: arrays of the shapes of `log_pair`; the rest: it is none."""
        rows = self._rows([np.ones((1, len(each)), dtype=np.bool_) for each in self.log_pair])
        forward = list(_forward(rows, (1, self.missed.shape[1])))
        sums, log_scale = forward[-1]
        log_total = np.log(sums[0, 0]) + log_scale
        result = tuple(np.zeros(each.shape) for each in self.log_pair)
        behind, log_behind = np.ones_like(sums), np.zeros_like(log_total)
        for j in range(len(self.missed) - 1, -1, -1):
            sums, log_scale = forward[j]
            scale = np.exp(log_scale + log_behind - log_total)
            for axis, row in enumerate(rows):
                behind = row.parted(behind, j, axis)
            before = behind[: sums.shape[0], : sums.shape[1]].copy()
            for axis, row in enumerate(rows):
                if not row.is_near(j):
                    continue
                first, end = row.first[j], row.end[j]
                at = first - row.low[j]
                onward = row.says(j) * behind.swapaxes(0, axis)[at + 1 : at + 1 + end - first, : sums.shape[1 - axis]]
                reached = row.reached(sums.swapaxes(0, axis), j)
                result[axis][first:end, j] = ((reached * onward).sum(axis=1) * scale)[:, 0]
                gained = _cumulated(onward[::-1])[::-1]
                changed = before.swapaxes(0, axis)
                changed[:at] += gained[0]
                changed[at : at + end - first] += gained[: len(changed) - at]
            behind, log_behind = _scaled(before, log_behind)
        return result

    @cached_property
    def _log_missed(self) -> Floats:
        """ln m_j, none of them infinite: (n_modes, n_draws) array."""
        return np.log(np.maximum(self.missed, _LEAST))

    def _rows(self, taking: Sequence[Bools]) -> list[_Row]:
        """The rows of peaks, and which of them are there in each subset."""
        per_row = zip(self.log_pair, self.log_alone, taking, strict=True)
        return [
            _Row.of(log_pair - log_alone[:, None, None], self._log_missed, own) for log_pair, log_alone, own in per_row
        ]


@dataclass(frozen=True, eq=False)
class _Row:
    """A row of peaks, and which of its sums differ on the way along the modes: those of a window.

    Attributes
    ----------
    log_told : (n_peaks, n_modes, n_draws) array
        ln of e_ij / s_i.
    log_missed : (n_modes, n_draws) array
        ln m_j.
    taken : (n_peaks, n_subsets, 1) array
        1 for a peak that is there.
    first, end : lists of n_modes int
        The peaks that are near each mode, the end not among them.
    low : list of n_modes + 1 int
        Before each mode, and after the last: the last peak but for which it does not matter which peaks stand in pairs,
        as no mode to come is near one before it. Its sum holds theirs.
    top : list of n_modes + 1 int
        The last peak that may stand in a pair by then.
    """

    log_told: Floats
    log_missed: Floats
    taken: Floats
    first: list[int]
    end: list[int]
    low: list[int]
    top: list[int]

    @classmethod
    def of(cls, log_told: Floats, log_missed: Floats, taking: Bools) -> _Row:
        """Of what the peaks tell, and an (n_subsets, n_peaks) array of those of each subset."""
        n_peaks = len(log_told)
        highest: Floats = log_told.max(axis=2, initial=-np.inf) - log_missed.min(axis=1, initial=0.0)
        highest[np.logical_not(taking).all(axis=0)] = -np.inf
        near: Bools = np.greater(highest, _LOG_NOTHING)
        first, end = np.full(log_told.shape[1], n_peaks), np.zeros(log_told.shape[1], dtype=np.intp)
        peaks, modes = np.nonzero(near)
        np.minimum.at(first, modes, peaks)
        np.maximum.at(end, modes, peaks + 1)
        low = np.minimum.accumulate([n_peaks, *first[::-1]])[::-1]
        top = np.maximum(np.maximum.accumulate([0, *end]), low)
        taken = taking.T[:, :, None].astype(np.float64)
        return cls(log_told, log_missed, taken, first.tolist(), end.tolist(), low.tolist(), top.tolist())

    def is_near(self, mode: int) -> bool:
        """Whether a peak is near a mode."""
        return self.end[mode] > self.first[mode]

    def n_reached(self, mode: int) -> int:
        """Sums of a window before a mode and of the peaks near it."""
        return max(self.top[mode], self.end[mode]) - self.low[mode] + 1

    def says(self, mode: int) -> Floats:
        """r_ij of the peaks near a mode, 0 where they are not there: (n_near, 1, n_subsets, n_draws) array."""
        near = slice(self.first[mode], self.end[mode])
        ratios = np.exp(np.maximum(self.log_told[near, mode] - self.log_missed[mode], _LOG_NOTHING))
        return (ratios[:, None] * self.taken[near])[:, None]

    def reached(self, along: Floats, mode: int) -> Floats:
        """For each peak near a mode the sum over those before it: from a window's sums, this row along the first axis.

        An (n_near, n_other, n_subsets, n_draws) array.
        """
        at = self.first[mode] - self.low[mode]
        there = np.zeros((self.end[mode] - self.first[mode], *along.shape[1:]))
        own = along[at : at + len(there)]
        there[: len(own)] = own
        if at:
            there[0] += along[:at].sum(axis=0)
        return _cumulated(there)

    def gathered(self, sums: Floats, mode: int, axis: int) -> Floats:
        """Sums after a mode, those in one of which the modes to come see no difference any more."""
        along = sums.swapaxes(0, axis)
        n_gathered = min(self.low[mode + 1] - self.low[mode], len(along) - 1)
        if n_gathered:
            along[n_gathered] += along[:n_gathered].sum(axis=0)
        return along[n_gathered:].swapaxes(0, axis)

    def parted(self, behind: Floats, mode: int, axis: int) -> Floats:
        """What is behind each peak after a mode, from what is behind those that differ for the modes to come."""
        at = np.arange(self.n_reached(mode)) + (self.low[mode] - self.low[mode + 1])
        return behind.take(np.maximum(at, 0), axis=axis) if len(at) > behind.shape[axis] else behind


def _forward(rows: Sequence[_Row], shape: tuple[int, int]) -> Iterator[tuple[Floats, Floats]]:
    """The windows of F_0, F_1 and so on, and the logarithms of what they were divided by, one per draw.

    Of one or two rows; windows are (n_a, n_b, n_subsets, n_draws) arrays, after the last mode of the one sum of all.
    """
    sums, log_scale = np.ones((1, 1, *shape)), np.zeros(shape)
    yield sums, log_scale
    for j in range(len(rows[0].first)):
        if not any(row.is_near(j) for row in rows):
            yield sums, log_scale
            continue
        n_a, n_b = (*(row.n_reached(j) for row in rows), 1)[:2]
        after = np.zeros((n_a, n_b, *shape))
        after[: sums.shape[0], : sums.shape[1]] = sums
        for axis, row in enumerate(rows):
            if row.is_near(j):
                at = row.first[j] + 1 - row.low[j]
                own = after.swapaxes(0, axis)[at : at + row.end[j] - row.first[j], : sums.shape[1 - axis]]
                own += row.says(j) * row.reached(sums.swapaxes(0, axis), j)
        for axis, row in enumerate(rows):
            after = row.gathered(after, j, axis)
        sums, log_scale = _scaled(after, log_scale)
        yield sums, log_scale


def _cumulated(rows: Floats) -> Floats:
    """Sums from the first row to each, in place: rows of draws are added in compiled code, one after another."""
    for before, here in pairwise(rows):
        here += before
    return rows


def _scaled(sums: Floats, log_scale: Floats) -> tuple[Floats, Floats]:
    """Sums over their largest at the draws where that is large; the others do not depend on it."""
    if sums.max(initial=1.0) < _MANY:
        return sums, log_scale
    largest = sums.max(axis=(0, 1))
    scale = np.where(largest < _MANY, 1.0, largest)
    return sums / scale, log_scale + np.log(scale)
