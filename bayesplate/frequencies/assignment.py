"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks and modes keep their order of frequency; a mode may leave no peak, and a peak may be no mode. With e_ij what peak
i says of mode j, s_i what it says where it is no mode, and m_j the probability that mode j left no peak, an assignment
is a set of pairs (i, j) that rises in both, and weighs the product of the e_ij of its pairs, and of the s_i and m_j
that stand in no pair. The sum over all of them runs forward over the peaks: with M_j = m_1 ... m_j,

    H_0[j] = M_j,    G_i[j] = e_ij H_(i-1)[j-1],    H_i[j] = s_i H_(i-1)[j] + M_j sum over k <= j of G_i[k] / M_k.

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

    Attributes
    ----------
    log_pair : (n_draws, n_peaks, n_modes) array
        ln e_ij.
    log_alone : (n_peaks,) array
        ln s_i.
    missed : (n_draws, n_modes) array
        m_j, 0 to 1.
    """

    log_pair: Floats
    log_alone: Floats
    missed: Floats

    def log_sum(self) -> Floats:
        """ln of the sum over all assignments: (n_draws,) array."""
        rows, log_scales = self._forward
        return np.asarray(np.log(rows[-1][:, -1]) + log_scales[-1])

    def pairs(self) -> Floats:
        """Probability that each peak is each mode: (n_draws, n_peaks, n_modes) array; the rest: it is none."""
        forward, log_forward = self._forward
        total = self.log_sum()
        result = np.empty(self.log_pair.shape)
        products, (pair, alone, log_largest) = self._products, self._scaled
        behind = products[:, -1:] / products
        log_behind = np.zeros(len(behind))
        for i in range(len(self.log_alone) - 1, -1, -1):
            log_scale = log_forward[i] + log_behind + log_largest[:, i] - total
            ahead = pair[:, i] * behind[:, 1:]
            result[:, i] = forward[i][:, :-1] * ahead * np.exp(log_scale)[:, None]
            onward = np.cumsum((ahead * products[:, :-1])[:, ::-1], axis=1)[:, ::-1] / products[:, :-1]
            behind = alone[:, i, None] * behind
            behind[:, :-1] += onward
            largest = behind.max(axis=1)
            behind /= largest[:, None]
            log_behind = log_behind + log_largest[:, i] + np.log(largest)
        return result

    @cached_property
    def _products(self) -> Floats:
        """M_j, from no mode to all: (n_draws, n_modes + 1) array."""
        missed = np.maximum(self.missed, LEAST)
        return np.concatenate([np.ones((len(missed), 1)), np.cumprod(missed, axis=1)], axis=1)

    @cached_property
    def _scaled(self) -> tuple[Floats, Floats, Floats]:
        """e_ij and s_i over the largest of both for each peak, and the logarithm of that: (n_draws, n_peaks) arrays."""
        largest = np.maximum(self.log_pair.max(axis=2, initial=-np.inf), self.log_alone)
        return np.exp(self.log_pair - largest[:, :, None]), np.exp(self.log_alone - largest), largest

    @cached_property
    def _forward(self) -> tuple[list[Floats], list[Floats]]:
        """H_0 to H_n, each over its largest number, and the logarithm of what they were divided by: (n_draws,) each."""
        products, (pair, alone, log_largest) = self._products, self._scaled
        rows, log_scales = [products], [np.zeros(len(products))]
        for i in range(len(self.log_alone)):
            row = alone[:, i, None] * rows[-1]
            row[:, 1:] += products[:, 1:] * np.cumsum(pair[:, i] * rows[-1][:, :-1] / products[:, 1:], axis=1)
            largest = row.max(axis=1)
            rows.append(row / largest[:, None])
            log_scales.append(log_scales[-1] + log_largest[:, i] + np.log(largest))
        return rows, log_scales
