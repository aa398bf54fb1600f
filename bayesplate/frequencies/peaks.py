"""Likelihood of the peaks of a setup that have no label, or a doubtful one, given the frequencies of all its modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.frequencies.assignment import LOG_NEGLIGIBLE, Assignments, NearPeaks
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.frequencies.residues import detection_share, sign_probabilities
from bayesplate.labels import Label

_MOST_UNSIGNED = 6
"""Up to so many peaks of unknown sign, the likelihood is summed over both signs of each."""
_DRAWS_AT_ONCE = 512
"""Draws computed together: enough to keep the time in compiled code, few enough for the arrays to stay in cache."""
_LEAST_MISSED = 1e-3
"""Lower limit of the probability that a mode left no peak, which keeps all ratios finite."""
_FAR_BELOW = 9.0
"""A mode so many standard deviations below the highest peak is taken not to lie above it: a chance of 1e-19."""
_SIGNS = {"+": 1, "-": -1, "": 0}


@dataclass(frozen=True, eq=False)
class OrderedPeaks:
    """Peaks whose order of frequency is that of their modes: all peaks, or those that may have one sign."""

    peaks: Indices  # (n_own,)
    log_sign: Floats  # (n_own, n_modes): ln of the probability that a mode has the sign of a peak


@dataclass(frozen=True, eq=False)
class PeakLikelihood:
    """The probability of a setup's peaks, summed over all assignments to its modes (`Assignments`).

    A peak is spurious, that is no mode, with a prior probability s, stated for the peak or for its setup; it may then
    have any frequency up to the highest peak. Otherwise it is one of the modes without a certain label, about which it
    scatters as a reading does. Of n peaks n s are expected to be spurious, and each spurious one has the weight n s, as
    it may stand anywhere among the other peaks, while a mode has one place. A mode leaves no peak with a prior
    probability, which is higher the nearer hammer or sensor are to its nodal lines, or if it lies above the highest
    peak. Where the signs of residues are known, on the card and from the shapes, a peak cannot be a mode of the other
    sign, and peaks and modes keep their order within each sign only; a mode with so small a residue that its sign is
    uncertain may be a peak of either sign. A label that may be wrong is right with the probability that the card
    gives, and otherwise belongs to any other mode.
    """

    errors: ReadingErrors  # of the peaks, in the order of frequency
    readings: Indices  # (n_peaks,): index of each peak among the setup's readings; -1: it is none of them
    unlabelled: Indices  # (n_peaks,): index among the setup's peaks without a label; -1: it has a label
    columns: Indices  # (n_modes,): indices in the model of the modes that peaks may be, the labelled ones first
    labels: tuple[Label | None, ...]
    log_prior: Floats  # (n_peaks, n_modes): ln prior of a pair: mode detected, peak not spurious, its label
    log_spurious: Floats  # (n_peaks,): ln of the probability of each peak if it is spurious
    missed: Floats  # (n_modes,): probability that a mode below the highest peak left no peak
    orders: tuple[OrderedPeaks, ...]  # one for all peaks, or one for each sign; peaks of unknown sign are in both
    log_highest: float  # ln of the highest measured frequency, Hz

    @classmethod
    def of(cls, model: SetupModel, robust: bool = False) -> PeakLikelihood | None:
        """The likelihood of the peaks of a model with all modes (`with_other_modes`); None if all labels are sure."""
        setup = model.setup
        if not needs_assignment(setup):
            return None
        doubtful = np.flatnonzero([not reading.is_sure for reading in setup.readings])
        n_unlabelled = len(setup.peaks)
        readings = np.concatenate([np.full(n_unlabelled, -1), doubtful]).astype(np.intp)
        unlabelled = np.concatenate([np.arange(n_unlabelled), np.full(doubtful.size, -1)]).astype(np.intp)
        errors = ReadingErrors.of_peaks(setup, doubtful, robust)
        order = np.argsort(errors.frequency, kind="stable")
        errors, readings, unlabelled = errors.select(order), readings[order], unlabelled[order]
        peaks: list[Peak | Reading] = [*setup.peaks, *(setup.readings[i] for i in doubtful)]
        signs = np.array([_SIGNS[peak.sign] for peak in peaks])[order]
        other_modes = np.arange(len(setup.readings), len(model.mode_places))
        columns = np.concatenate([doubtful, other_modes]).astype(np.intp)
        residues = None if model.residues is None else model.residues[columns]
        detection = np.full(columns.size, 1.0 - setup.missed)
        if residues is not None:
            detection = detection * np.where(np.isnan(residues), 1.0, detection_share(np.nan_to_num(residues)))
        spurious = np.array([setup.spurious if peak.spurious is None else peak.spurious for peak in peaks])[order]
        log_pair = np.log(detection) + np.log1p(-spurious)[:, None]
        labels = tuple(model.mode_labels[column] for column in columns)
        log_label = _log_labels(setup, readings, labels)
        highest = max([*setup.measured, *setup.unlabelled])
        relative_width = np.where(errors.rounded, errors.resolution, errors.frequency) / highest
        orders = tuple(_orders(signs, columns.size, residues))
        is_split = len(orders) > 1
        log_sign = np.where(((signs != 0) & (residues is not None)) | is_split, -np.log(2.0), 0.0)
        log_spurious = np.log(spurious * spurious.size * relative_width) + log_label[:, -1] + log_sign
        return cls(
            errors=errors,
            readings=readings,
            unlabelled=unlabelled,
            columns=columns,
            labels=labels,
            log_prior=log_pair + log_label[:, :-1],
            log_spurious=log_spurious,
            missed=1.0 - detection,
            orders=orders,
            log_highest=float(np.log(highest)),
        )

    def log_likelihood(self, mode_log_frequencies: Floats, noise: Floats) -> Floats:
        """ln of the probability of all peaks together, (n_draws,), from ln f (Hz) of all modes: (n_draws, n_modes).

        Minus infinity where a mode has no frequency.
        """
        log_frequency = mode_log_frequencies[:, self.columns]
        complete = np.flatnonzero(np.isfinite(log_frequency).all(axis=1))
        result = np.full(len(log_frequency), -np.inf)
        if complete.size > _DRAWS_AT_ONCE:  # similar draws go together, so that fewer pairs are near at any of them
            most_spread = log_frequency[complete].std(axis=0).argmax()
            complete = complete[np.argsort(log_frequency[complete, most_spread])]
        for start in range(0, complete.size, _DRAWS_AT_ONCE):
            batch = complete[start : start + _DRAWS_AT_ONCE]
            result[batch] = self._log_sum(log_frequency[batch], noise[batch])
        return result

    def _log_sum(self, log_frequency: Floats, noise: Floats) -> Floats:
        """`log_likelihood` of a batch of draws at which every mode has a frequency."""
        _, log_missed, assignments = self._assignments(log_frequency, noise)
        return np.asarray(assignments.log_sum() + log_missed.sum(axis=0) + self.log_spurious.sum())

    def probabilities(self, mode_log_frequencies: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode, averaged over draws: (n_peaks, n_modes); the rest: spurious."""
        total = np.zeros(self.log_prior.shape)
        for start in range(0, len(noise), _DRAWS_AT_ONCE):
            batch = slice(start, start + _DRAWS_AT_ONCE)
            total += self.probabilities_of_each(mode_log_frequencies[batch], noise[batch]).sum(axis=2)
        return total / len(noise)

    def probabilities_of_each(self, mode_log_frequencies: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode at each draw: (n_peaks, n_modes, n_draws) array."""
        modes, _, assignments = self._assignments(mode_log_frequencies[:, self.columns], noise)
        result = np.zeros((*self.log_prior.shape, len(noise)))
        for row, (order, pairs) in enumerate(zip(self.orders, assignments.pairs(), strict=True)):
            peaks, ranks = assignments.near_peaks[row].pairs()
            result[order.peaks[peaks][:, None], modes[ranks], np.arange(len(noise))] += pairs
        return result

    def log_density_spurious(self, reading: int) -> float:
        """ln of the density, in ln f, of one of the setup's readings if it is spurious."""
        peak = int(np.flatnonzero(self.readings == reading)[0])
        errors = self.errors.select(np.array([peak]))
        width = errors.resolution[0] / errors.frequency[0] if errors.rounded[0] else 1.0
        return float(self.log_spurious[peak] - np.log(width))

    def _assignments(self, log_frequency: Floats, noise: Floats) -> tuple[Indices, Floats, Assignments]:
        """Modes in order of frequency, ln of the probability that each left no peak, and the ratios r_ij of pairs.

        The order is (n_modes, n_draws), or (n_modes, 1) where it is the same at all draws. Pairs that are not near each
        other at any draw are left out.
        """
        log_missed = self._log_missed(log_frequency.T, noise)
        modes = np.argsort(log_frequency[0])[:, None]
        ordered, log_missed = log_frequency.T[modes[:, 0]], log_missed[modes[:, 0]]
        is_near = (
            self._log_ratio_bound(ordered, log_missed, noise) + self._log_prior_ratio[:, modes[:, 0]] > LOG_NEGLIGIBLE
        )
        n_first = len(self.orders[0].peaks)
        rows = [is_near[:n_first], is_near[n_first:]][: len(self.orders)]
        by_row = [ordered[row.any(axis=0)] for row in rows]
        if any((row_modes[1:] < row_modes[:-1]).any() for row_modes in by_row):
            # Modes of a common row cross: each draw has its own order.
            ranking = np.ascontiguousarray(np.argsort(ordered, axis=0, kind="stable"))
            ordered, log_missed = (np.take_along_axis(table, ranking, axis=0) for table in (ordered, log_missed))
            takes_rank = np.zeros((len(modes), len(modes)), dtype=np.bool_)
            takes_rank[ranking, np.arange(len(modes))[:, None]] = True
            is_near = (is_near @ takes_rank) & (
                self._log_ratio_bound(ordered, log_missed, noise) + self._log_prior_bound > LOG_NEGLIGIBLE
            )
            modes = modes[:, 0][ranking]
        near = [NearPeaks.of(row) for row in (is_near[:n_first], is_near[n_first:])[: len(self.orders)]]
        pair_peaks, pair_ranks = [], []
        for row, near_peaks in enumerate(near):
            peaks, ranks = near_peaks.pairs()
            pair_peaks += [row * n_first + peak for peak in peaks]
            pair_ranks += ranks
        log_ratios = self.errors.log_likelihood_of_pairs(self._peaks[pair_peaks], ordered[pair_ranks], noise)
        log_ratios += self._log_prior_ratio[np.array(pair_peaks, dtype=np.intp)[:, None], modes[pair_ranks]]
        log_ratios -= log_missed[pair_ranks]
        ratios = np.exp(np.maximum(log_ratios, LOG_NEGLIGIBLE))
        n_pairs = near[0].starts[-1]
        return modes, log_missed, Assignments(near, [ratios[:n_pairs], ratios[n_pairs:]][: len(near)], self._unsigned)

    def _log_ratio_bound(self, ordered: Floats, log_missed: Floats, noise: Floats) -> Floats:
        """Upper bound over draws of ln of the likelihood ratio of each pair, without its prior: (n_own, n_modes)."""
        bound = self.errors.log_upper_bound(ordered.min(axis=1), ordered.max(axis=1), noise.min(), noise.max())
        return np.asarray((bound - log_missed.min(axis=1))[self._peaks])

    def _log_missed(self, log_frequency: Floats, noise: Floats) -> Floats:
        """Finite ln of the probability that each mode left no peak, from ln f: (n_modes, n_draws) arrays."""
        from scipy.special import ndtr

        missed = np.repeat(self.missed[:, None], noise.size, axis=1)
        sd = self.errors.sd(noise).mean(axis=1)
        is_high = log_frequency.max(axis=1) > self.log_highest - _FAR_BELOW * sd.max()
        missed[is_high] += (1.0 - missed[is_high]) * ndtr((log_frequency[is_high] - self.log_highest) / sd)
        return np.asarray(np.log(np.maximum(missed, _LEAST_MISSED)))

    @cached_property
    def _peaks(self) -> Indices:
        return np.concatenate([order.peaks for order in self.orders])

    @cached_property
    def _unsigned(self) -> list[tuple[int, int]]:
        """Indices of each peak of unknown sign in both rows of peaks."""
        if len(self.orders) == 1:
            return []
        plus, minus = (order.peaks.tolist() for order in self.orders)
        return [(plus.index(peak), minus.index(peak)) for peak in plus if peak in minus]

    @cached_property
    def _log_prior_ratio(self) -> Floats:
        """ln of the prior of each pair over that of a spurious peak, the rows of peaks one after the other."""
        log_ratios = [
            (self.log_prior - self.log_spurious[:, None])[order.peaks] + order.log_sign for order in self.orders
        ]
        return np.concatenate(log_ratios)

    @cached_property
    def _log_prior_bound(self) -> Floats:
        """The largest prior ratio of each peak with any mode: (n_own, 1) array."""
        return np.asarray(self._log_prior_ratio.max(axis=1, keepdims=True))


def needs_assignment(setup: Setup) -> bool:
    return bool(setup.peaks) or not all(reading.is_sure for reading in setup.readings)


def _orders(signs: Indices, n_modes: int, residues: Floats | None) -> Iterator[OrderedPeaks]:
    """The peaks of each sign, those of unknown sign in both; or all peaks together."""
    unsigned = np.flatnonzero(signs == 0)
    log_sign = np.zeros((3, n_modes))
    is_known = residues is not None and not np.isnan(residues).any()
    if residues is not None:
        with np.errstate(divide="ignore"):
            log_sign[[1, -1]] = np.log(sign_probabilities(residues))
    if unsigned.size > _MOST_UNSIGNED or unsigned.size == signs.size or not is_known:
        yield OrderedPeaks(np.arange(signs.size), log_sign[signs])
        return
    for sign in (1, -1):
        peaks = np.flatnonzero((signs == sign) | (signs == 0))
        yield OrderedPeaks(peaks, np.repeat(log_sign[sign][None], peaks.size, axis=0))


def _log_labels(setup: Setup, readings: Indices, labels: Sequence[Label | None]) -> Floats:
    """ln of the probability of each peak's label if the peak is each mode and, last, if it is spurious.

    A label is right with probability c; the other modes, and that the peak is spurious, have equal shares of 1 - c. A
    label that the program proposed has no weight.
    """
    result = np.zeros((readings.size, len(labels) + 1))
    for i, index in enumerate(readings):
        if index >= 0 and (reading := setup.readings[index]).confidence > 0:
            stated = reading.label if reading.stated is None else reading.stated
            result[i] = np.log((1.0 - reading.confidence) / len(labels))
            result[i, [j for j, label in enumerate(labels) if label == stated]] = np.log(reading.confidence)
    return result
