"""Peaks assigned to modes: the probability of a spectrum, summed over every assignment that keeps the order.

Peaks stand in one row, or in two whose modes differ in the sign of their residue. Those of a row and their modes keep
their order of frequency; a mode is one peak of one row or leaves none, and a peak may be no mode. With e_ij what peak i
says of mode j, s_i what it says where it is no mode, and m_j the probability that mode j left no peak, an assignment is
a set of pairs (i, j) that rises in both within a row, and weighs the product of the e_ij of its pairs, and of the s_i
and m_j that stand in no pair: the product of all s_i and m_j, times that of r_ij = e_ij / (s_i m_j) over its pairs. The
sum of the latter over all assignments of the first j modes, the first a peaks of one row and the first b of the other
runs forward over the modes,

    S_0[a, b] = 1,    S_j[a, b] = S_(j-1)[a, b] + sum over i <= a of r_ij S_(j-1)[i - 1, b]
                                                + sum over i <= b of r_ij S_(j-1)[a, i - 1].

This is a pair hidden Markov model in which each assignment has one path: the peaks and modes that stand alone between
two pairs are not counted once for every way to interleave them. A run backward through the same sums gives the
derivatives of the last by each r_ij, and with them the probability of each pair.

Peaks lie near a few modes each. Sums of fewer peaks than come before all those that are near a mode to come are not
asked for again; those that differ in peaks that no mode was near yet are equal. Of the table S_j a small window is
left, which moves along the peaks with the modes.

A peak of unknown sign stands in both rows and is a mode in one of them at most. The sum over both its signs is taken
where it matters: from the first mode that it is near to the last there is a table for each sign.

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

LOG_NOTHING = float(np.log(1e-18))
"""Of a ratio that changes no sum of one and more; smaller ones come to numbers that processors are slow with."""
_LOG_MOST = 300.0
"""Sums are divided by the largest before they can exceed e to this: times as much again they are numbers still."""


@dataclass(frozen=True, eq=False)
class Near:
    """Which peaks of a row are near each mode."""

    n_peaks: int
    first: list[int]  # of each mode: the first of these peaks
    end: list[int]  # and the one after the last: none where it is not beyond the first
    low: list[int]  # the first of them and of those near the modes to come

    @classmethod
    def of(cls, is_near: Bools) -> Near:
        """Rows from an (n_peaks, n_modes) array: which peaks any draw has near which modes."""
        # Every mode is near a peak after all others, then to one before them: so one is found for each.
        near = np.ones((len(is_near) + 1, is_near.shape[1]), dtype=np.bool_)
        near[:-1] = is_near
        first = near.argmax(axis=0).tolist()
        near[1:] = is_near
        near[0] = True
        end = (len(is_near) - near[::-1].argmax(axis=0)).tolist()
        low = list(accumulate(reversed(first), min))[::-1]
        return cls(len(is_near), first, end, low)

    @cached_property
    def starts(self) -> list[int]:
        """Index of the first pair of each mode among those of the row, and of the end: n_modes + 1 int."""
        counts = (end - first if end > first else 0 for first, end in zip(self.first, self.end, strict=True))
        return list(accumulate(counts, initial=0))

    def pairs(self) -> tuple[list[int], list[int]]:
        """Peaks and modes of the pairs, mode after mode: two lists of n_pairs int."""
        found = enumerate(zip(self.first, self.end, strict=True))
        pairs = [(peak, mode) for mode, (first, end) in found for peak in range(first, end)]
        return [peak for peak, _ in pairs], [mode for _, mode in pairs]

    def modes(self, peak: int) -> list[int]:
        ends = zip(self.first, self.end, strict=True)
        return [mode for mode, (first, end) in enumerate(ends) if first <= peak < end]


class _Passage(NamedTuple):
    """What a mode does that peaks are near, and where in the table."""

    # row of these peaks; in it which peaks they are, and which pairs with the mode
    rows: list[tuple[int, slice, slice]]
    tops: tuple[int, int]  # the most peaks of each row of which the table had sums before
    window: tuple[slice, slice]  # the part of the table that this mode and those to come ask for
    log_growth: float  # ln of the number by which the mode multiplies a sum, at most
    # peaks of unknown sign that have an axis of the table, in order between its two and the draws
    doubtful: tuple[int, ...]
    opening: list[int]  # those that have it from this mode on
    closing: list[int]  # those that have it up to this mode

    def along(self, table: Floats, row: int) -> Floats:
        """The part of a table that is asked for, up to the most peaks of a row: these along the first axis."""
        if row == 0:
            return table[: self.window[0].stop, self.window[1]]
        return table[self.window[0], : self.window[1].stop].swapaxes(0, 1)


@dataclass(frozen=True, eq=False)
class Assignments:
    """What peaks say of modes at many draws: both in the order of frequency, the modes in that of each draw.

    The draws come last: a run over modes then adds whole rows of them.
    """

    near: Sequence[Near]  # one for each row
    ratios: Sequence[Floats]  # (n_pairs, n_draws): r_ij of the pairs of each row
    unsigned: Sequence[tuple[int, int]] = ()  # places in both rows of each peak of unknown sign

    def log_sum(self) -> Floats:
        """ln of the sum of the products of r_ij over all assignments and all signs that peaks may have: (n_draws,)."""
        return self._forward(None)

    def pairs(self) -> list[Floats]:
        """Probability of each of the pairs: arrays of the shapes of `ratios`."""
        met: list[tuple[Floats, list[Floats]]] = []
        log_total = self._forward(met)
        result = [np.zeros(each.shape) for each in self.ratios]
        behind = np.zeros((*self._shape, log_total.size))  # derivatives of the last sum by those before it
        behind[self._last] = 1.0
        log_behind, log_most = np.full_like(log_total, self._log_untold), 0.0
        for passage, (log_scale, added) in zip(reversed(self._passages), reversed(met), strict=True):
            for which in reversed(passage.closing):
                behind = np.stack((behind, behind), axis=2 + passage.doubtful.index(which))
            if log_most + passage.log_growth > _LOG_MOST:
                log_behind, log_most = log_behind + _scale_down(behind[passage.window]), 0.0
            log_most += passage.log_growth
            scale = np.exp(log_scale + log_behind - log_total)
            led = []
            for (row, peaks, own), gain in zip(passage.rows, added, strict=True):
                along = passage.along(behind, row)
                onward = along[peaks.start + 1 : peaks.stop + 1].copy()
                onward[-1] += along[peaks.stop + 1 :].sum(axis=0)
                _cumulate(onward[::-1])
                result[row][own] = (gain * onward).reshape(len(gain), -1, scale.size).sum(axis=1) * scale
                led.append(self._times_ratios(onward, passage, row, peaks, own))
            for (row, peaks, _), each in zip(passage.rows, led, strict=True):
                passage.along(behind, row)[peaks] += each
            (a, b), (top_a, top_b) = passage.window, passage.tops
            behind[a, top_b] += behind[a, top_b + 1 : b.stop].sum(axis=1)
            held = slice(min(b.start, top_b), top_b + 1)
            behind[top_a, held] += behind[top_a + 1 : a.stop, held].sum(axis=0)
            for which in reversed(passage.opening):
                behind = behind.sum(axis=2 + passage.doubtful.index(which))
        return result

    def _forward(self, met: list[tuple[Floats, list[Floats]]] | None) -> Floats:
        """`log_sum`; for each passage ln of what the table was divided by, and what each peak adds, go to a list."""
        n_draws = self.ratios[0].shape[1]
        table, log_scale, log_most = np.zeros((*self._shape, n_draws)), np.zeros(n_draws), 0.0
        table[0, 0] = 1.0
        for passage in self._passages:
            for _ in passage.opening:
                table = np.stack((table, table), axis=-2)
            (a, b), (top_a, top_b) = passage.window, passage.tops
            if a.stop > top_a + 1:
                held = slice(min(b.start, top_b), top_b + 1)
                table[top_a + 1 : a.stop, held] = table[top_a, held]
            if b.stop > top_b + 1:
                table[a, top_b + 1 : b.stop] = table[a, top_b : top_b + 1]
            if log_most + passage.log_growth > _LOG_MOST:
                log_scale, log_most = log_scale + _scale_down(table[a, b]), 0.0
            log_most += passage.log_growth
            alongs, gains = [], []
            for row, peaks, own in passage.rows:
                along = passage.along(table, row)
                gains.append(self._times_ratios(along[peaks], passage, row, peaks, own))
                alongs.append(along[peaks.start + 1 :])
            if met is not None:
                met.append((log_scale, [gain.copy() for gain in gains]))
            for along, gain in zip(alongs, gains, strict=True):
                n_near = len(gain)
                if n_near > 1:
                    _cumulate(gain)
                here = along[:n_near]
                here += gain
                if len(along) > n_near:
                    beyond = along[n_near:]
                    beyond += gain[-1]
            for which in passage.closing:
                table = table.sum(axis=2 + passage.doubtful.index(which))
        return np.asarray(np.log(table[self._last]) + log_scale + self._log_untold)

    def _times_ratios(self, sums: Floats, passage: _Passage, row: int, peaks: slice, own: slice) -> Floats:
        """Sums of each peak of a row that is near a mode times r_ij, 0 where the peak has the other row's sign."""
        ratios = self.ratios[row][own]
        if not passage.doubtful:
            return sums * ratios[:, None]
        result = sums * ratios.reshape(len(ratios), *[1] * (sums.ndim - 2), -1)
        for at, which in enumerate(passage.doubtful):
            peak = self.unsigned[which][row] - peaks.start
            if 0 <= peak < len(result):
                result[(peak, slice(None), *(slice(None) for _ in range(at)), 1 - row)] = 0.0
        return result

    @property
    def _shape(self) -> tuple[int, int]:
        """Numbers of peaks of which there may be a sum, none among them."""
        a, *b = (near.n_peaks + 1 for near in self.near)
        return a, b[0] if b else 1

    @property
    def _last(self) -> tuple[int, int]:
        """Place in the table of the sum over all."""
        a, b = self._passages[-1].window if self._passages else (slice(1), slice(1))
        return a.stop - 1, b.stop - 1

    @cached_property
    def _spans(self) -> list[tuple[int, int] | None]:
        """The first and the last mode that each peak of unknown sign is near."""
        each = (
            [j for near, peak in zip(self.near, peaks, strict=True) for j in near.modes(peak)]
            for peaks in self.unsigned
        )
        return [(min(modes), max(modes)) if modes else None for modes in each]

    @property
    def _log_untold(self) -> float:
        """ln of how many signs those of them have together that are near no mode."""
        return self._spans.count(None) * float(np.log(2.0))

    @cached_property
    def _passages(self) -> list[_Passage]:
        """The way along all modes that peaks are near."""
        passages: list[_Passage] = []
        tops, windows = [0, 0], [slice(0, 1), slice(0, 1)]
        spans = [(*span, which) for which, span in enumerate(self._spans) if span is not None]
        ends = [(last, which) for _, last, which in spans]
        doubtful: tuple[int, ...] = ()
        log_growths = [np.log1p(ratios.max(axis=1, initial=0.0)).tolist() for ratios in self.ratios]
        rows = (zip(near.first, near.end, near.low, near.starts[:-1], strict=True) for near in self.near)
        for mode, at in enumerate(zip(*rows, strict=True)):
            (top_a, top_b), log_growth, found = tops, 0.0, []
            for row, (first, end, low, start) in enumerate(at):
                if first < end:
                    own = slice(start, start + end - first)
                    found.append((row, slice(first, end), own))
                    log_growth += sum(log_growths[row][own])
                    if end > tops[row]:
                        tops[row] = end
                windows[row] = slice(min(low, tops[row]), tops[row] + 1)
            if not found:
                continue
            opening = [which for first, _, which in spans if first == mode]
            doubtful = (*doubtful, *opening)
            closing = [which for which in reversed(doubtful) if (mode, which) in ends]
            passages.append(
                _Passage(found, (top_a, top_b), (windows[0], windows[1]), log_growth, doubtful, opening, closing)
            )
            if closing:
                doubtful = tuple(which for which in doubtful if which not in closing)
        return passages


def _cumulate(rows: Floats) -> None:
    """Add to each row all those before it: rows of draws are added in compiled code, one after another."""
    for before, here in pairwise(rows):
        here += before


def _scale_down(sums: Floats) -> Floats:
    """Divide sums by their largest at each draw, in place; ln of that: (n_draws,) array."""
    largest = sums.max(axis=tuple(range(sums.ndim - 1)))
    sums /= largest
    return np.log(largest)
