"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks stand in one row, or in two rows, one for each sign of the residue. The peaks of a row and their modes keep their
order of frequency; a mode is one peak of one row or leaves none, and a peak may be spurious, that is no mode. With e_ij
the likelihood of peak i if it is mode j, s_i its likelihood if it is spurious, and m_j the probability that mode j left
no peak, an assignment is a set of pairs (i, j) in which both i and j rise within a row. Its weight is the product of
the e_ij of its pairs and of the s_i and m_j of the peaks and modes outside them: the product of all s_i and m_j, times
the product of r_ij = e_ij / (s_i m_j) over its pairs. The sum of these last products over all assignments of the first
j modes, the first a peaks of one row and the first b of the other runs forward over the modes,

    S_0[a, b] = 1,    S_j[a, b] = S_(j-1)[a, b] + sum over i <= a of r_ij S_(j-1)[i - 1, b]
                                                + sum over i <= b of r_ij S_(j-1)[a, i - 1].

This is a pair hidden Markov model in which each assignment has one path: unpaired peaks and modes between two pairs
are not counted once for every way to interleave them. A backward run through the same sums gives the derivatives of the
final sum by each r_ij, and with them the probability of each pair.

Each peak is near a few modes only. Sums that leave out a peak below all those near the coming modes are not used again;
sums that differ only in peaks that no mode has come near yet are equal. So only a small window of the table S_j is
computed, which moves along the peaks with the modes.

A peak of unknown sign stands in both rows and is a mode in one of them at most. Both its signs are summed over the
modes near it: from the first of these to the last there is a table for each sign.

References
----------
Durbin, Eddy, Krogh and Mitchison, Biological Sequence Analysis, 1998, chapter 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats

LOG_NEGLIGIBLE = float(np.log(1e-18))
"""ln of a ratio too small to change a sum of 1 or more; still smaller ratios give denormal numbers, which are slow."""
_LOG_LARGEST = 300.0
"""ln of the size of sums above which they are scaled down; the square of such a sum is still a finite number."""


@dataclass(frozen=True, eq=False)
class NearPeaks:
    """Which peaks of a row are near each mode."""

    n_peaks: int
    first: list[int]  # of each mode: index of the first peak near it
    end: list[int]  # index after the last peak near it; not beyond `first` where no peak is near
    low: list[int]  # index of the first peak near this mode or any later one

    @classmethod
    def of(cls, is_near: Bools) -> NearPeaks:
        """From an (n_peaks, n_modes) array: which peaks are near which modes at any draw."""
        # A row of True after all peaks, then one before them, so that argmax finds a peak for every mode.
        padded = np.ones((len(is_near) + 1, is_near.shape[1]), dtype=np.bool_)
        padded[:-1] = is_near
        first = padded.argmax(axis=0).tolist()
        padded[1:] = is_near
        padded[0] = True
        end = (len(is_near) - padded[::-1].argmax(axis=0)).tolist()
        low = list(accumulate(reversed(first), min))[::-1]
        return cls(len(is_near), first, end, low)

    @cached_property
    def starts(self) -> list[int]:
        """Index of the first pair of each mode among the pairs of the row, and the number of pairs: n_modes + 1 int."""
        counts = (end - first if end > first else 0 for first, end in zip(self.first, self.end, strict=True))
        return list(accumulate(counts, initial=0))

    def pairs(self) -> tuple[list[int], list[int]]:
        """Peaks and modes of the pairs, mode after mode: two lists of n_pairs int."""
        bounds = enumerate(zip(self.first, self.end, strict=True))
        pairs = [(peak, mode) for mode, (first, end) in bounds for peak in range(first, end)]
        return [peak for peak, _ in pairs], [mode for _, mode in pairs]

    def modes(self, peak: int) -> list[int]:
        bounds = zip(self.first, self.end, strict=True)
        return [mode for mode, (first, end) in enumerate(bounds) if first <= peak < end]


class _ModeStep(NamedTuple):
    """Update of the table of sums by one mode with peaks near it."""

    rows: list[tuple[int, slice, slice]]  # of each row with near peaks: its index, its near peaks, their pairs
    tops: tuple[int, int]  # for each row, the highest number of peaks in the sums before this step
    window: tuple[slice, slice]  # the part of the table that this mode and later ones use
    log_growth: float  # ln of the largest factor by which the mode can multiply a sum
    doubtful: tuple[int, ...]  # peaks of unknown sign with an axis of their own, between the two of rows and the draws
    opening: list[int]  # peaks whose axis starts with this mode
    closing: list[int]  # peaks whose axis ends with this mode

    def along(self, table: Floats, row: int) -> Floats:
        """The used part of a table, with the peaks of a row, from none up, along the first axis."""
        if row == 0:
            return table[: self.window[0].stop, self.window[1]]
        return table[self.window[0], : self.window[1].stop].swapaxes(0, 1)


@dataclass(frozen=True, eq=False)
class Assignments:
    """Likelihood ratios of peaks and modes at many draws, both in order of frequency: of the modes, that of each draw.

    The draws are the last axis: a run over modes then adds contiguous rows of draws.
    """

    near_peaks: Sequence[NearPeaks]  # of each row
    ratios: Sequence[Floats]  # (n_pairs, n_draws): r_ij of the pairs of each row
    unsigned: Sequence[tuple[int, int]] = ()  # places in both rows of each peak of unknown sign

    def log_sum(self) -> Floats:
        """ln of the sum of the products of r_ij over all assignments and all signs that peaks may have: (n_draws,)."""
        return self._forward(None)

    def pairs(self) -> list[Floats]:
        """Probability of each of the pairs: arrays of the shapes of `ratios`."""
        history: list[tuple[Floats, list[Floats]]] = []
        log_total = self._forward(history)
        result = [np.zeros(ratios.shape) for ratios in self.ratios]
        backward = np.zeros((*self._table_shape, log_total.size))  # derivatives of the final sum by earlier sums
        backward[self._last_cell] = 1.0
        log_backward, log_bound = np.full_like(log_total, self._log_free_signs), 0.0
        for step, (log_scale, gains) in zip(reversed(self._steps), reversed(history), strict=True):
            for peak in reversed(step.closing):
                backward = np.stack((backward, backward), axis=2 + step.doubtful.index(peak))
            if log_bound + step.log_growth > _LOG_LARGEST:
                log_backward, log_bound = log_backward + _scale_down(backward[step.window]), 0.0
            log_bound += step.log_growth
            scale = np.exp(log_scale + log_backward - log_total)
            additions = []
            for (row, peaks, pairs), gain in zip(step.rows, gains, strict=True):
                view = step.along(backward, row)
                slopes = view[peaks.start + 1 : peaks.stop + 1].copy()
                slopes[-1] += view[peaks.stop + 1 :].sum(axis=0)
                _cumulate(slopes[::-1])
                result[row][pairs] = (gain * slopes).reshape(len(gain), -1, scale.size).sum(axis=1) * scale
                additions.append(self._times_ratios(slopes, step, row, peaks, pairs))
            for (row, peaks, _), addition in zip(step.rows, additions, strict=True):
                step.along(backward, row)[peaks] += addition
            (a, b), (top_a, top_b) = step.window, step.tops
            backward[a, top_b] += backward[a, top_b + 1 : b.stop].sum(axis=1)
            filled = slice(min(b.start, top_b), top_b + 1)
            backward[top_a, filled] += backward[top_a + 1 : a.stop, filled].sum(axis=0)
            for peak in reversed(step.opening):
                backward = backward.sum(axis=2 + step.doubtful.index(peak))
        return result

    def _forward(self, history: list[tuple[Floats, list[Floats]]] | None) -> Floats:
        """`log_sum`; appends to `history`, for each step, ln of the scale of the table and what each peak adds."""
        n_draws = self.ratios[0].shape[1]
        table, log_scale, log_bound = np.zeros((*self._table_shape, n_draws)), np.zeros(n_draws), 0.0
        table[0, 0] = 1.0
        for step in self._steps:
            for _ in step.opening:
                table = np.stack((table, table), axis=-2)
            (a, b), (top_a, top_b) = step.window, step.tops
            if a.stop > top_a + 1:
                filled = slice(min(b.start, top_b), top_b + 1)
                table[top_a + 1 : a.stop, filled] = table[top_a, filled]
            if b.stop > top_b + 1:
                table[a, top_b + 1 : b.stop] = table[a, top_b : top_b + 1]
            if log_bound + step.log_growth > _LOG_LARGEST:
                log_scale, log_bound = log_scale + _scale_down(table[a, b]), 0.0
            log_bound += step.log_growth
            views, gains = [], []
            for row, peaks, pairs in step.rows:
                view = step.along(table, row)
                gains.append(self._times_ratios(view[peaks], step, row, peaks, pairs))
                views.append(view[peaks.start + 1 :])
            if history is not None:
                history.append((log_scale, [gain.copy() for gain in gains]))
            for view, gain in zip(views, gains, strict=True):
                n_near = len(gain)
                if n_near > 1:
                    _cumulate(gain)
                near_sums = view[:n_near]
                near_sums += gain
                if len(view) > n_near:
                    far_sums = view[n_near:]
                    far_sums += gain[-1]
            for peak in step.closing:
                table = table.sum(axis=2 + step.doubtful.index(peak))
        return np.asarray(np.log(table[self._last_cell]) + log_scale + self._log_free_signs)

    def _times_ratios(self, sums: Floats, step: _ModeStep, row: int, peaks: slice, pairs: slice) -> Floats:
        """Sums of each near peak of a row times its r_ij; 0 where the peak has the sign of the other row."""
        ratios = self.ratios[row][pairs]
        if not step.doubtful:
            return sums * ratios[:, None]
        result = sums * ratios.reshape(len(ratios), *[1] * (sums.ndim - 2), -1)
        for axis, k in enumerate(step.doubtful):
            peak = self.unsigned[k][row] - peaks.start
            if 0 <= peak < len(result):
                result[(peak, slice(None), *(slice(None) for _ in range(axis)), 1 - row)] = 0.0
        return result

    @property
    def _table_shape(self) -> tuple[int, int]:
        """Size of the table: along each row, the numbers of peaks from none to all."""
        a, *b = (near.n_peaks + 1 for near in self.near_peaks)
        return a, b[0] if b else 1

    @property
    def _last_cell(self) -> tuple[int, int]:
        """Indices in the table of the sum over all assignments."""
        a, b = self._steps[-1].window if self._steps else (slice(1), slice(1))
        return a.stop - 1, b.stop - 1

    @cached_property
    def _spans(self) -> list[tuple[int, int] | None]:
        """The first and the last mode near each peak of unknown sign; None where no mode is near."""
        near_modes = (
            [j for near, peak in zip(self.near_peaks, peaks, strict=True) for j in near.modes(peak)]
            for peaks in self.unsigned
        )
        return [(min(modes), max(modes)) if modes else None for modes in near_modes]

    @property
    def _log_free_signs(self) -> float:
        """ln of the number of sign combinations of the peaks of unknown sign that are near no mode."""
        return self._spans.count(None) * float(np.log(2.0))

    @cached_property
    def _steps(self) -> list[_ModeStep]:
        """One step for each mode with peaks near it, in order of frequency."""
        steps: list[_ModeStep] = []
        tops, windows = [0, 0], [slice(0, 1), slice(0, 1)]
        spans = [(*span, peak) for peak, span in enumerate(self._spans) if span is not None]
        ends = [(last, peak) for _, last, peak in spans]
        doubtful: tuple[int, ...] = ()
        log_growths = [np.log1p(ratios.max(axis=1, initial=0.0)).tolist() for ratios in self.ratios]
        bounds_by_row = (zip(near.first, near.end, near.low, near.starts[:-1], strict=True) for near in self.near_peaks)
        for mode, mode_bounds in enumerate(zip(*bounds_by_row, strict=True)):
            (top_a, top_b), log_growth, near_rows = tops, 0.0, []
            for row, (first, end, low, start) in enumerate(mode_bounds):
                if first < end:
                    pairs = slice(start, start + end - first)
                    near_rows.append((row, slice(first, end), pairs))
                    log_growth += sum(log_growths[row][pairs])
                    if end > tops[row]:
                        tops[row] = end
                windows[row] = slice(min(low, tops[row]), tops[row] + 1)
            if not near_rows:
                continue
            opening = [peak for first, _, peak in spans if first == mode]
            doubtful = (*doubtful, *opening)
            closing = [peak for peak in reversed(doubtful) if (mode, peak) in ends]
            steps.append(
                _ModeStep(near_rows, (top_a, top_b), (windows[0], windows[1]), log_growth, doubtful, opening, closing)
            )
            if closing:
                doubtful = tuple(peak for peak in doubtful if peak not in closing)
        return steps


def _cumulate(rows: Floats) -> None:
    """Add to each row all rows before it, in place: a row of draws at a time, in compiled code."""
    for previous, row in pairwise(rows):
        row += previous


def _scale_down(sums: Floats) -> Floats:
    """Divide sums by the largest at each draw, in place, and return ln of the largest: (n_draws,) array."""
    largest = sums.max(axis=tuple(range(sums.ndim - 1)))
    sums /= largest
    return np.log(largest)
