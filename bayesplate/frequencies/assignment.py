"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks and modes keep their order of frequency; a mode may leave no peak, and a peak may be no mode. With e_ij what peak
i says of mode j, s_i what it says where it is no mode, and m_j the probability that mode j left no peak, an assignment
is a set of pairs (i, j) that rises in both, and weighs the product of the e_ij of its pairs, and of the s_i and m_j
that stand in no pair. The sum over all of them runs forward over the peaks, and for each over the modes:

    H_0[j] = m_1 ... m_j,    A_i[j] = m_j A_i[j-1] + e_ij H_(i-1)[j-1],    H_i[j] = s_i H_(i-1)[j] + A_i[j].

This is a pair hidden Markov model in which each assignment has one path: the peaks and modes that stand alone between
two pairs are not counted once for every way to interleave them. A run backward gives the probability of each pair.

References
----------
Durbin, Eddy, Krogh and Mitchison, Biological Sequence Analysis, 1998, chapter 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

LEAST = 1e-3
"""Probability that a mode left no peak, at least: the product over a hundred modes is a number still."""


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

    def log_sum(self) -> Floats:
        """ln of the sum over all assignments: (n_draws,) array."""
        rows, log_scales = self._forward
        return np.asarray(np.log(rows[-1][-1]) + log_scales[-1])

    def pairs(self) -> Floats:
        """Probability that each peak is each mode: (n_peaks, n_modes, n_draws) array; the rest: it is none."""
        forward, log_forward = self._forward
        total = self.log_sum()
        result = np.empty(self.log_pair.shape)
        pair, alone, log_largest = self._scaled
        behind = self._products(backward=True)
        log_behind = np.zeros(len(total))
        for i in range(len(self.log_alone) - 1, -1, -1):
            onward = pair[i] * behind[1:]
            result[i] = forward[i][:-1] * onward * np.exp(log_forward[i] + log_behind + log_largest[i] - total)
            for j in range(len(onward) - 2, -1, -1):
                onward[j] += self._missed[j] * onward[j + 1]
            behind = alone[i] * behind
            behind[:-1] += onward
            largest = behind.max(axis=0)
            behind /= largest
            log_behind = log_behind + log_largest[i] + np.log(largest)
        return result

    @cached_property
    def _missed(self) -> Floats:
        """m_j, none of them zero: (n_modes, n_draws) array."""
        return np.maximum(self.missed, LEAST)

    def _products(self, *, backward: bool = False) -> Floats:
        """m_1 ... m_j, from no mode to all, or of the modes behind each place: (n_modes + 1, n_draws) array."""
        result = np.ones((len(self.missed) + 1, self.missed.shape[1]))
        run, factors = (result[::-1], self._missed[::-1]) if backward else (result, self._missed)
        for j, factor in enumerate(factors):
            np.multiply(run[j], factor, out=run[j + 1])
        return result

    @cached_property
    def _scaled(self) -> tuple[Floats, Floats, Floats]:
        """e_ij and s_i over the largest of both for each peak, and the logarithm of that: (n_peaks, n_draws) arrays."""
        log_alone = self.log_alone[:, None]
        largest = np.maximum(self.log_pair.max(axis=1, initial=-np.inf), log_alone)
        pair = self.log_pair - largest[:, None, :]
        return np.exp(pair, out=pair), np.exp(log_alone - largest), largest

    @cached_property
    def _forward(self) -> tuple[list[Floats], list[Floats]]:
        """H_0 to H_n, each over its largest number, and the logarithm of what they were divided by: (n_draws,) each."""
        pair, alone, log_largest = self._scaled
        rows, log_scales = [self._products()], [np.zeros(self.missed.shape[1])]
        for i in range(len(self.log_alone)):
            onward = pair[i] * rows[-1][:-1]
            for j in range(1, len(onward)):
                onward[j] += self._missed[j] * onward[j - 1]
            row = alone[i] * rows[-1]
            row[1:] += onward
            largest = row.max(axis=0)
            row /= largest
            rows.append(row)
            log_scales.append(log_scales[-1] + log_largest[i] + np.log(largest))
        return rows, log_scales
