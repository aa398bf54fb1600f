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
_NOTHING = 1e-25
"""A ratio that changes no sum of one and more."""


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
        ratios = [_beside(each, own) for each, own in zip(self._ratios, taking, strict=True)]
        *_, (sums, log_scale) = _forward(ratios)
        found = (np.log(sums.sum(axis=(0, 1))) + log_scale).reshape(len(taken), self.missed.shape[1])
        return found + (taken @ np.concatenate(self.log_alone))[:, None] + np.log(self._missed).sum(axis=0)

    def of(self, taken: Sequence[Bools]) -> Assignments:
        """The same of some of the peaks, the others not there: for each row an (n_peaks,) array of bool."""
        log_pair, log_alone = (
            tuple(each[own] for each, own in zip(rows, taken, strict=True)) for rows in (self.log_pair, self.log_alone)
        )
        return Assignments(log_pair, log_alone, self.missed)

    def pairs(self) -> tuple[Floats, ...]:
        """Probability that each peak is each mode: arrays of the shapes of `log_pair`; the rest: it is none."""
        forward = list(_forward(self._ratios))
        sums, log_scale = forward[-1]
        log_total = np.log(sums.sum(axis=(0, 1))) + log_scale
        result = tuple(np.empty(each.shape) for each in self.log_pair)
        behind, log_behind = np.ones_like(sums), np.zeros_like(log_total)
        for j in range(len(self.missed) - 1, -1, -1):
            sums, log_scale = forward[j]
            scale = np.exp(log_scale + log_behind - log_total)
            before = behind.copy()
            for axis, ratios in enumerate(self._ratios):
                onward = ratios[:, j, None] * behind.swapaxes(0, axis)[1:]
                reached = _cumulated(sums.swapaxes(0, axis)[:-1].copy())
                result[axis][:, j] = (reached * onward).sum(axis=1) * scale
                before.swapaxes(0, axis)[:-1] += _cumulated(onward[::-1])[::-1]
            behind, log_behind = _scaled(before, log_behind)
        return result

    @cached_property
    def _missed(self) -> Floats:
        """m_j, none of them zero: (n_modes, n_draws) array."""
        return np.maximum(self.missed, _LEAST)

    @cached_property
    def _ratios(self) -> tuple[Floats, ...]:
        """r_ij: arrays of the shapes of `log_pair`."""
        found = []
        for log_pair, log_alone in zip(self.log_pair, self.log_alone, strict=True):
            ratios = log_pair - log_alone[:, None, None]
            ratios -= np.log(self._missed)
            found.append(np.exp(ratios, out=ratios))
        return tuple(found)


def _beside(ratios: Floats, taken: Bools) -> Floats:
    """Ratios of each subset of the peaks beside those of the others, zero for a peak that is not there.

    An (n_peaks, n_modes, n_subsets * n_draws) array from (n_peaks, n_modes, n_draws) and (n_subsets, n_peaks).
    """
    every = ratios[:, :, None] * taken.T[:, None, :, None]
    return every.reshape(*ratios.shape[:2], len(taken) * ratios.shape[2])


def _forward(rows: Sequence[Floats]) -> Iterator[tuple[Floats, Floats]]:
    """F_0, F_1 and so on, an (n_a + 1, n_b + 1, n_draws) array each, and the logarithm of what it was divided by.

    Only those peaks gain that are near a mode: from one or two (n_peaks, n_modes, n_draws) arrays of ratios.
    """
    n_a, n_b = (*(len(ratios) for ratios in rows), 0)[:2]
    _, n_modes, n_draws = rows[0].shape
    sums, log_scale = np.zeros((n_a + 1, n_b + 1, n_draws)), np.zeros(n_draws)
    sums[0, 0] = 1.0
    yield sums, log_scale
    near = [ratios.max(axis=2, initial=0.0) > _NOTHING for ratios in rows]
    for j in range(n_modes):
        after = sums
        for axis, (ratios, says) in enumerate(zip(rows, near, strict=True)):
            at = np.flatnonzero(says[:, j])
            if at.size:
                first, end = int(at[0]), int(at[-1]) + 1
                along = sums.swapaxes(0, axis)
                reached = along[first:end].copy()
                reached[0] += along[:first].sum(axis=0)
                after = sums.copy() if after is sums else after
                after.swapaxes(0, axis)[first + 1 : end + 1] += ratios[first:end, j, None] * _cumulated(reached)
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
