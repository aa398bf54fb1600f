"""Peaks of a setup that have no label, or a doubtful one: what they say of the frequencies of all its modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.frequencies.assignment import LOG_NOTHING, Assignments, Near
from bayesplate.frequencies.model import SetupModel, every_label
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.frequencies.residues import share_seen, sign_probabilities
from bayesplate.labels import Label

Rows = Indices

_MOST_UNSIGNED = 6
"""Peaks of unknown sign up to which each is tried with both."""
_DRAWS_AT_ONCE = 512
"""Enough for the arithmetic to be done in compiled code; of more, what is at work leaves the fast memory."""
_LEAST_MISSED = 1e-3
"""Probability that a mode left no peak, at least: no ratio is beyond all numbers then."""
_FAR_BELOW = 9.0
"""Standard deviations below the highest peak from which on no mode can be above it: one in 1e19 of a normal error."""
_SIGNS = {"+": 1, "-": -1, "": 0}


@dataclass(frozen=True, eq=False)
class Order:
    """Peaks that keep their order among the modes: all, or those that may be of one sign."""

    peaks: Rows  # (n_own,)
    log_sign: Floats  # (n_own, n_modes): ln of the probability that a mode has the sign of a peak


@dataclass(frozen=True, eq=False)
class PeakLikelihood:
    """The probability of a setup's peaks, summed over all assignments to its modes (`Assignments`).

    A peak is no mode with a prior probability s, its own or that of its setup, and then lies anywhere up to the highest
    one; otherwise it is one of the modes that no certain label has taken, about which it scatters as a reading does. Of
    n peaks n s are expected to be none: each that is weighs n s, for it may stand anywhere among the others, while a
    mode has one place. A mode leaves no peak with a prior probability, which is higher the nearer hammer or sensor
    stand to its nodal lines, or if it lies above the highest peak. Where the signs of residues are known, on the card
    and from the shapes, a peak of the other sign is not that mode, and peaks and modes keep their order within a sign
    only; a mode with so small a residue that it may have either sign may be a peak of either. A label that may be wrong
    is right with the probability that the card gives, and otherwise any other mode's.
    """

    errors: ReadingErrors  # of the peaks, in the order of frequency
    readings: Rows  # (n_peaks,): which of the setup's readings each one is; -1: none
    bare: Rows  # (n_peaks,): which of its peaks without a label; -1: none
    columns: Rows  # (n_modes,): modes that peaks may be, among all of the model: the labelled ones first
    labels: tuple[Label | None, ...]
    log_prior: Floats  # (n_peaks, n_modes): ln of what is known of each pair: seen, no spurious peak, its label
    log_alone: Floats  # (n_peaks,): ln of the probability of each peak if it is no mode
    missed: Floats  # (n_modes,): probability that a mode below the highest peak left none
    orders: tuple[Order, ...]  # one of all, or one a sign, which share the peaks of unknown sign
    log_highest: float  # ln of the highest frequency that was read, Hz

    @classmethod
    def of(cls, model: SetupModel, robust: bool = False) -> PeakLikelihood | None:
        """The likelihood of the peaks of a model with all modes (`with_others`); None if all labels are sure."""
        setup = model.setup
        if not takes_part(setup):
            return None
        doubtful = np.flatnonzero([not reading.is_sure for reading in setup.readings])
        n_bare = len(setup.peaks)
        readings = np.concatenate([np.full(n_bare, -1), doubtful]).astype(np.intp)
        bare = np.concatenate([np.arange(n_bare), np.full(doubtful.size, -1)]).astype(np.intp)
        errors = ReadingErrors.of_peaks(setup, doubtful, robust)
        order = np.argsort(errors.frequency, kind="stable")
        errors, readings, bare = errors.at(order), readings[order], bare[order]
        read: list[Peak | Reading] = [*setup.peaks, *(setup.readings[i] for i in doubtful)]
        signs = np.array([_SIGNS[one.sign] for one in read])[order]
        others = np.arange(len(setup.readings), len(model.every_place))
        columns = np.concatenate([doubtful, others]).astype(np.intp)
        residues = None if model.residues is None else model.residues[columns]
        seen = np.full(columns.size, 1.0 - setup.missed)
        if residues is not None:
            seen = seen * np.where(np.isnan(residues), 1.0, share_seen(np.nan_to_num(residues)))
        spurious = np.array([setup.spurious if one.spurious is None else one.spurious for one in read])[order]
        log_pair = np.log(seen) + np.log1p(-spurious)[:, None]
        every = every_label(setup, model.others)
        labels = tuple(every[column] for column in columns)
        log_label = _log_labels(setup, readings, labels)
        highest = max([*setup.measured, *setup.unlabelled])
        wide = np.where(errors.rounded, errors.resolution, errors.frequency) / highest
        orders = tuple(_orders(signs, columns.size, residues))
        is_split = len(orders) > 1
        log_sign = np.where(((signs != 0) & (residues is not None)) | is_split, -np.log(2.0), 0.0)
        log_alone = np.log(spurious * spurious.size * wide) + log_label[:, -1] + log_sign
        return cls(
            errors=errors,
            readings=readings,
            bare=bare,
            columns=columns,
            labels=labels,
            log_prior=log_pair + log_label[:, :-1],
            log_alone=log_alone,
            missed=1.0 - seen,
            orders=orders,
            log_highest=float(np.log(highest)),
        )

    def log_likelihood(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """ln of the probability of all peaks together, (n_draws,), from ln f (Hz) of all modes: (n_draws, n_every).

        Minus infinity where a mode has no frequency.
        """
        there = every_log_frequency[:, self.columns]
        has_all = np.flatnonzero(np.isfinite(there).all(axis=1))
        result = np.full(len(there), -np.inf)
        if has_all.size > _DRAWS_AT_ONCE:  # those that are alike together, so that fewer pairs are near at any of them
            most_spread = there[has_all].std(axis=0).argmax()
            has_all = has_all[np.argsort(there[has_all, most_spread])]
        for start in range(0, has_all.size, _DRAWS_AT_ONCE):
            some = has_all[start : start + _DRAWS_AT_ONCE]
            result[some] = self._log_sum(there[some], noise[some])
        return result

    def _log_sum(self, there: Floats, noise: Floats) -> Floats:
        """`log_likelihood` of a few draws that have all modes."""
        _, log_missed, assignments = self._assignments(there, noise)
        return np.asarray(assignments.log_sum() + log_missed.sum(axis=0) + self.log_alone.sum())

    def probabilities(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode, averaged over draws: (n_peaks, n_modes); the rest: it is none."""
        total = np.zeros(self.log_prior.shape)
        for start in range(0, len(noise), _DRAWS_AT_ONCE):
            some = slice(start, start + _DRAWS_AT_ONCE)
            total += self.probabilities_of_each(every_log_frequency[some], noise[some]).sum(axis=2)
        return total / len(noise)

    def probabilities_of_each(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode at each draw: (n_peaks, n_modes, n_draws) array."""
        modes, _, assignments = self._assignments(every_log_frequency[:, self.columns], noise)
        result = np.zeros((*self.log_prior.shape, len(noise)))
        for row, (order, pairs) in enumerate(zip(self.orders, assignments.pairs(), strict=True)):
            peaks, at = assignments.near[row].pairs()
            result[order.peaks[peaks][:, None], modes[at], np.arange(len(noise))] += pairs
        return result

    def log_density_alone(self, reading: int) -> float:
        """ln of the density, in ln f, of one of the setup's readings if it is no mode."""
        at = int(np.flatnonzero(self.readings == reading)[0])
        errors = self.errors.at(np.array([at]))
        width = errors.resolution[0] / errors.frequency[0] if errors.rounded[0] else 1.0
        return float(self.log_alone[at] - np.log(width))

    def _assignments(self, there: Floats, noise: Floats) -> tuple[Rows, Floats, Assignments]:
        """The order of the modes, ln of the probability that each left no peak, and what the peaks say in that order.

        The order is (n_modes, n_draws), or (n_modes, 1) where all draws have one. Pairs that are near each other at no
        draw are left out.
        """
        log_missed = self._log_missed(there.T, noise)
        modes = np.argsort(there[0])[:, None]
        ordered, log_missed = there.T[modes[:, 0]], log_missed[modes[:, 0]]
        is_near = self._most(ordered, log_missed, noise) + self._known[:, modes[:, 0]] > LOG_NOTHING
        n_first = len(self.orders[0].peaks)
        rows = [is_near[:n_first], is_near[n_first:]][: len(self.orders)]
        by_row = [ordered[row.any(axis=0)] for row in rows]
        if any((each[1:] < each[:-1]).any() for each in by_row):
            # Where modes cross that have a row in common, each draw has its own order.
            again = np.ascontiguousarray(np.argsort(ordered, axis=0, kind="stable"))
            ordered, log_missed = (np.take_along_axis(each, again, axis=0) for each in (ordered, log_missed))
            stands = np.zeros((len(modes), len(modes)), dtype=np.bool_)
            stands[again, np.arange(len(modes))[:, None]] = True
            is_near = (is_near @ stands) & (self._most(ordered, log_missed, noise) + self._known_at_most > LOG_NOTHING)
            modes = modes[:, 0][again]
        near = [Near.of(row) for row in (is_near[:n_first], is_near[n_first:])[: len(self.orders)]]
        own, at = [], []
        for row, each in enumerate(near):
            peaks, places = each.pairs()
            own += [row * n_first + peak for peak in peaks]
            at += places
        log_ratios = self.errors.log_likelihood_of_pairs(self._peaks[own], ordered[at], noise)
        log_ratios += self._known[np.array(own, dtype=np.intp)[:, None], modes[at]]
        log_ratios -= log_missed[at]
        ratios = np.exp(np.maximum(log_ratios, LOG_NOTHING))
        n_pairs = near[0].starts[-1]
        return modes, log_missed, Assignments(near, [ratios[:n_pairs], ratios[n_pairs:]][: len(near)], self._unsigned)

    def _most(self, ordered: Floats, log_missed: Floats, noise: Floats) -> Floats:
        """The most that peaks say of modes at any draw, but for what is known beforehand: an (n_own, n_modes) array."""
        most = self.errors.log_most(ordered.min(axis=1), ordered.max(axis=1), noise.min(), noise.max())
        return np.asarray((most - log_missed.min(axis=1))[self._peaks])

    def _log_missed(self, log_frequency: Floats, noise: Floats) -> Floats:
        """Finite ln of the probability that each mode left no peak, from ln f: (n_modes, n_draws) arrays."""
        from scipy.special import ndtr

        missed = np.repeat(self.missed[:, None], noise.size, axis=1)
        sd = self.errors.sd(noise).mean(axis=1)
        some = log_frequency.max(axis=1) > self.log_highest - _FAR_BELOW * sd.max()
        missed[some] += (1.0 - missed[some]) * ndtr((log_frequency[some] - self.log_highest) / sd)
        return np.asarray(np.log(np.maximum(missed, _LEAST_MISSED)))

    @cached_property
    def _peaks(self) -> Rows:
        return np.concatenate([order.peaks for order in self.orders])

    @cached_property
    def _unsigned(self) -> list[tuple[int, int]]:
        """Places of each peak of unknown sign in both orders."""
        if len(self.orders) == 1:
            return []
        plus, minus = (order.peaks.tolist() for order in self.orders)
        return [(plus.index(peak), minus.index(peak)) for peak in plus if peak in minus]

    @cached_property
    def _known(self) -> Floats:
        """What is known of each pair beforehand, over the peak as no mode, one order after the other: ln of it."""
        parts = [(self.log_prior - self.log_alone[:, None])[order.peaks] + order.log_sign for order in self.orders]
        return np.concatenate(parts)

    @cached_property
    def _known_at_most(self) -> Floats:
        """The most of it for any mode: an (n_own, 1) array."""
        return np.asarray(self._known.max(axis=1, keepdims=True))


def takes_part(setup: Setup) -> bool:
    return bool(setup.peaks) or not all(reading.is_sure for reading in setup.readings)


def _orders(signs: Rows, n_modes: int, residues: Floats | None) -> Iterator[Order]:
    """One order for each sign, peaks of unknown sign in both; or one of all peaks."""
    unsigned = np.flatnonzero(signs == 0)
    log_sign = np.zeros((3, n_modes))
    is_known = residues is not None and not np.isnan(residues).any()
    if residues is not None:
        with np.errstate(divide="ignore"):
            log_sign[[1, -1]] = np.log(sign_probabilities(residues))
    if unsigned.size > _MOST_UNSIGNED or unsigned.size == signs.size or not is_known:
        yield Order(np.arange(signs.size), log_sign[signs])
        return
    for sign in (1, -1):
        own = np.flatnonzero((signs == sign) | (signs == 0))
        yield Order(own, np.repeat(log_sign[sign][None], own.size, axis=0))


def _log_labels(setup: Setup, readings: Rows, labels: Sequence[Label | None]) -> Floats:
    """ln of the probability of what each peak was labelled, for each mode and, last, if it is no mode.

    A label that is right with probability c is each other mode's with an equal share of 1 - c. One that the program
    proposed says nothing.
    """
    result = np.zeros((readings.size, len(labels) + 1))
    for i, at in enumerate(readings):
        if at >= 0 and (reading := setup.readings[at]).confidence > 0:
            stated = reading.label if reading.stated is None else reading.stated
            result[i] = np.log((1.0 - reading.confidence) / len(labels))
            result[i, [j for j, label in enumerate(labels) if label == stated]] = np.log(reading.confidence)
    return result
