"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks and modes keep their order of frequency; a mode may leave no peak, and a peak may be no mode. With e_ij what peak
i says of mode j, s_i what it says where it is no mode, and m_j the probability that mode j left no peak, an assignment
is a set of pairs (i, j) that rises in both, and weighs the product of the e_ij of its pairs, and of the s_i and m_j
that stand in no pair: the product of all s_i and m_j, times that of r_ij = e_ij / (s_i m_j) over its pairs. The sum of
the latter over all assignments of the first i peaks to the first j modes runs forward over the peaks,

    H_0[j] = 1,    H_i[j] = H_(i-1)[j] + sum over k <= j of r_ik H_(i-1)[k-1].

This is a pair hidden Markov model in which each assignment has one path: the peaks and modes that stand alone between
two pairs are not counted once for every way to interleave them. A run backward gives the probability of each pair.

References
----------
Durbin, Eddy, Krogh and Mitchison, Biological Sequence Analysis, 1998, chapter 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

LEAST = 1e-3
"""Probability that a mode left no peak, at least: no ratio is beyond all numbers then."""
_MANY = 1e30
"""A draw's sums are divided by the largest once it exceeds this: times one more ratio it is a number still."""


@dataclass(frozen=True, eq=False)
class Assignments:
    """What peaks say of modes at many draws: both in the order of frequency, the modes in that of each draw.

    The draws come last: a run over modes then adds whole rows of them.

    Attributes
    ----------
    log_pair : (n_peaks, n_modes, n_draws) array
        ln e_ij.
    log_alone : (n_peaks,) array
        ln s_i.
    missed : (n_modes, n_draws) array
        m_j, 0 to 1.
    """

    log_pair: Floats
    log_alone: Floats
    missed: Floats

    def log_sums(self, taking: Bools) -> Floats:
        """ln of the sum over all assignments of some of the peaks, the others not there.

        Parameters
        ----------
        taking : (n_subsets, n_peaks) array of bool
            The peaks of each subset. Those at the beginning that subsets have in common are run over once.

        Returns
        -------
        (n_subsets, n_draws) array
        """
        n_peaks, _, n_draws = self.log_pair.shape
        result = np.empty((len(taking), n_draws))
        left = [(0, np.arange(len(taking)), *self._start)]
        while left:
            i, subsets, row, log_scale = left.pop()
            if i == n_peaks:
                result[subsets] = np.log(row[-1]) + log_scale
                continue
            for takes in (False, True):
                some = subsets[taking[subsets, i] == takes]
                if some.size:
                    left.append((i + 1, some, *(self._onward(i, row, log_scale) if takes else (row, log_scale))))
        return result + (taking @ self.log_alone)[:, None] + np.log(self._missed).sum(axis=0)

    def of(self, taken: Bools) -> Assignments:
        """The same of some of the peaks, the others not there: (n_peaks,) array of bool."""
        return Assignments(self.log_pair[taken], self.log_alone[taken], self.missed)

    def pairs(self) -> Floats:
        """Probability that each peak is each mode: (n_peaks, n_modes, n_draws) array; the rest: it is none."""
        n_peaks = len(self.log_alone)
        forward = [self._start]
        for i in range(n_peaks):
            forward.append(self._onward(i, *forward[-1]))
        log_total = np.log(forward[-1][0][-1]) + forward[-1][1]
        result = np.empty(self.log_pair.shape)
        behind, log_behind = self._start
        for i in range(n_peaks - 1, -1, -1):
            row, log_scale = forward[i]
            onward = self._ratios[i] * behind[1:]
            result[i] = row[:-1] * onward * np.exp(log_scale + log_behind - log_total)
            behind = behind.copy()
            behind[:-1] += _cumulated(onward[::-1])[::-1]
            behind, log_behind = _scaled(behind, log_behind, behind[0])
        return result

    @property
    def _start(self) -> tuple[Floats, Floats]:
        """H_0, and the logarithm of what it was divided by: (n_modes + 1, n_draws) and (n_draws,) arrays."""
        n_modes, n_draws = self.missed.shape
        return np.ones((n_modes + 1, n_draws)), np.zeros(n_draws)

    def _onward(self, i: int, row: Floats, log_scale: Floats) -> tuple[Floats, Floats]:
        """H_i from H_(i-1): it rises with j, so that the last number is the largest."""
        result = row.copy()
        result[1:] += _cumulated(self._ratios[i] * row[:-1])
        return _scaled(result, log_scale, result[-1])

    @cached_property
    def _missed(self) -> Floats:
        """m_j, none of them zero: (n_modes, n_draws) array."""
        return np.maximum(self.missed, LEAST)

    @cached_property
    def _ratios(self) -> Floats:
        """r_ij: array of the shape of `log_pair`."""
        ratios = self.log_pair - self.log_alone[:, None, None]
        ratios -= np.log(self._missed)
        return np.exp(ratios, out=ratios)


def _cumulated(rows: Floats) -> Floats:
    """Sums from the first row to each, in place: rows of draws are added in compiled code, one after another."""
    for before, here in pairwise(rows):
        here += before
    return rows


def _scaled(row: Floats, log_scale: Floats, largest: Floats) -> tuple[Floats, Floats]:
    """A row over its largest number at the draws where that is large; the others do not depend on it."""
    if largest.max(initial=1.0) < _MANY:
        return row, log_scale
    scale = np.where(largest < _MANY, 1.0, largest)
    return row / scale, log_scale + np.log(scale)
