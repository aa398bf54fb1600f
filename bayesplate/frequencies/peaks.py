"""Peaks of a setup that have no label, or a doubtful one: what they say of the frequencies of all its modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.assignment import Assignments
from bayesplate.frequencies.model import SetupModel, every_label
from bayesplate.frequencies.residues import share_seen, sign_probabilities
from bayesplate.labels import Label
from bayesplate.plate.readings import ReadingErrors
from bayesplate.plate.setup import Setup

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_MOST_UNSIGNED = 6
"""Peaks of unknown sign up to which each is tried with both."""
_DRAWS_AT_ONCE = 1024
"""Enough for the arithmetic to be done in compiled code; thousands at once would hold gigabytes."""
_SIGNS = {"+": 1, "-": -1, "": 0}


@dataclass(frozen=True, eq=False)
class Order:
    """Peaks that keep their order among the modes: all, or those that may be of one sign.

    Attributes
    ----------
    peaks : (n_own,) array of int
    log_sign : (n_own, n_modes) array
        ln of the probability that a mode has the sign of a peak.
    taking : (n_tried, n_own) array of bool
        Which of the peaks are of this sign, for every sign that those of unknown sign may have.
    """

    peaks: Rows
    log_sign: Floats
    taking: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PeakLikelihood:
    """The probability of a setup's peaks, summed over all assignments to its modes (`Assignments`).

    A peak is no mode with a prior probability s, and then lies anywhere up to the highest one; otherwise it is one of
    the modes that no certain label has taken, about which it scatters as a reading does. Of n peaks n s are expected to
    be none: each that is weighs n s, for it may stand anywhere among the others, while a mode has one place. A mode
    leaves no peak with a prior probability, which is higher the nearer hammer or sensor stand to its nodal lines, or if
    it lies above the highest peak. Where the signs of residues are known, on the card and from the shapes, a peak of
    the other sign is not that mode, and peaks and modes keep their order within a sign only; a mode with so small a
    residue that it may have either sign may be a peak of either. A label that may be wrong is right with the
    probability that the card gives, and otherwise any other mode's.

    Attributes
    ----------
    errors : ReadingErrors
        Of the peaks, in the order of frequency.
    readings, bare : (n_peaks,) array of int
        Which of the setup's readings, and which of its peaks without a label, each one is; -1 for none.
    columns : (n_modes,) array of int
        The modes that peaks may be, among all of the setup's model: the labelled ones first.
    labels : tuple of Label or None
        Of these modes.
    log_prior : (n_peaks, n_modes) array
        ln of what is known of each pair beforehand: seen, no spurious peak, its label.
    log_alone : (n_peaks,) array
        ln of the probability of each peak if it is no mode.
    missed : (n_modes,) array
        Probability that a mode below the highest peak left none.
    orders : tuple of Order
        One of all, or one per sign.
    log_highest : float
        ln of the highest frequency that was read, Hz.
    """

    errors: ReadingErrors
    readings: Rows
    bare: Rows
    columns: Rows
    labels: tuple[Label | None, ...]
    log_prior: Floats
    log_alone: Floats
    missed: Floats
    orders: tuple[Order, ...]
    log_highest: float

    @classmethod
    def of(cls, model: SetupModel, robust: bool = False) -> PeakLikelihood | None:
        """Of a setup's model that has all its modes (`with_others`); None where every reading is sure and no other is.

        Parameters
        ----------
        model : SetupModel
        robust : bool
            Student's distribution for the noise.
        """
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
        signs = np.array([_SIGNS[sign] for sign in _signs(setup, doubtful)])[order]
        others = np.arange(len(setup.readings), len(model.every_place))
        columns = np.concatenate([doubtful, others]).astype(np.intp)
        residues = None if model.residues is None else model.residues[columns]
        seen = np.full(columns.size, 1.0 - setup.missed)
        if residues is not None:
            seen = seen * np.where(np.isnan(residues), 1.0, share_seen(np.nan_to_num(residues)))
        log_pair = np.log(seen) + np.log1p(-setup.spurious)
        every = every_label(setup, model.others)
        labels = tuple(every[column] for column in columns)
        log_label = _log_labels(setup, readings, labels)
        highest = max([*setup.measured, *setup.unlabelled])
        wide = np.where(errors.rounded, errors.resolution, errors.frequency) / highest
        orders = tuple(_orders(signs, columns.size, residues))
        is_split = len(orders) > 1
        log_sign = np.where(((signs != 0) & (residues is not None)) | is_split, -np.log(2.0), 0.0)
        log_alone = np.log(setup.spurious * len(errors.frequency) * wide) + log_label[:, -1] + log_sign
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
        """ln of the probability of all peaks together.

        Parameters
        ----------
        every_log_frequency : (n_draws, n_every) array
            ln f (Hz) of all modes of the setup's model.
        noise : (n_draws,) array
            Relative.

        Returns
        -------
        (n_draws,) array
            -inf where a mode has no frequency.
        """
        there = every_log_frequency[:, self.columns]
        has_all = np.flatnonzero(np.isfinite(there).all(axis=1))
        result = np.full(len(there), -np.inf)
        step = max(1, _DRAWS_AT_ONCE // len(self.orders[0].taking))
        for start in range(0, has_all.size, step):
            some = has_all[start : start + step]
            result[some] = self._log_sum(there[some], noise[some])
        return result

    def _log_sum(self, there: Floats, noise: Floats) -> Floats:
        """`log_likelihood` of a few draws that have all modes: each takes peaks times modes times orders of memory."""
        from scipy.special import logsumexp

        _, assignments = self._assignments(there, noise)
        return np.asarray(logsumexp(assignments.log_sums([order.taking for order in self.orders]), axis=0))

    def probabilities(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode, averaged over draws: (n_peaks, n_modes) array; the rest: it is none.

        Parameters
        ----------
        every_log_frequency : (n_draws, n_every) array
            ln f (Hz), all of them finite.
        noise : (n_draws,) array
        """
        total = np.zeros(self.log_prior.shape)
        for start in range(0, len(noise), _DRAWS_AT_ONCE):
            some = slice(start, start + _DRAWS_AT_ONCE)
            total += self.probabilities_of_each(every_log_frequency[some], noise[some]).sum(axis=2)
        return total / len(noise)

    def probabilities_of_each(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """The same at each draw: (n_peaks, n_modes, n_draws) array."""
        from scipy.special import softmax

        there = every_log_frequency[:, self.columns]
        modes, assignments = self._assignments(there, noise)
        taking = [order.taking for order in self.orders]
        weights = softmax(assignments.log_sums(taking), axis=0)
        result = np.zeros((*self.log_prior.shape, len(noise)))
        for *taken, weight in zip(*taking, weights, strict=True):
            for order, own, pairs in zip(self.orders, taken, assignments.of(taken).pairs(), strict=True):
                by_mode = np.empty(pairs.shape)
                np.put_along_axis(by_mode, modes[None], pairs, axis=1)
                result[order.peaks[own]] += by_mode * weight
        return result

    def log_density_alone(self, reading: int) -> float:
        """ln of the density, in ln f, of one of the setup's readings if it is no mode."""
        at = int(np.flatnonzero(self.readings == reading)[0])
        errors = self.errors.at(np.array([at]))
        width = errors.resolution[0] / errors.frequency[0] if errors.rounded[0] else 1.0
        return float(self.log_alone[at] - np.log(width))

    def _assignments(self, there: Floats, noise: Floats) -> tuple[Rows, Assignments]:
        """The modes in the order of each draw, an (n_modes, n_draws) array, and what the peaks say of them."""
        modes = np.ascontiguousarray(np.argsort(there, axis=1).T)
        missed = self._missed(there, noise)
        ordered, lonely = (np.take_along_axis(np.ascontiguousarray(each.T), modes, axis=0) for each in (there, missed))
        log_pair, log_alone = [], []
        for order in self.orders:
            own = self.errors.at(order.peaks).log_likelihood_of_each(ordered, noise)
            own += np.take(self.log_prior[order.peaks] + order.log_sign, modes, axis=1)
            log_pair.append(own)
            log_alone.append(self.log_alone[order.peaks])
        return modes, Assignments(tuple(log_pair), tuple(log_alone), lonely)

    def _missed(self, there: Floats, noise: Floats) -> Floats:
        """Probability that each mode left no peak: (n_draws, n_modes) array."""
        from scipy.special import ndtr

        sd = self.errors.sd(noise).mean(axis=1, keepdims=True)
        return np.asarray(self.missed + (1.0 - self.missed) * ndtr((there - self.log_highest) / sd))


def takes_part(setup: Setup) -> bool:
    """Whether a setup has peaks without a label, or with a doubtful one."""
    return bool(setup.peaks) or not all(reading.is_sure for reading in setup.readings)


def _signs(setup: Setup, doubtful: Rows) -> list[str]:
    return [*(peak.sign for peak in setup.peaks), *(setup.readings[i].sign for i in doubtful)]


def _orders(signs: Rows, n_modes: int, residues: Floats | None) -> Iterator[Order]:
    """Those that may be of one sign, for every sign of the peaks of which it is not known; or all together."""
    unsigned = np.flatnonzero(signs == 0)
    log_sign = np.zeros((3, n_modes))
    is_known = residues is not None and not np.isnan(residues).any()
    if residues is not None:
        with np.errstate(divide="ignore"):
            log_sign[[1, -1]] = np.log(sign_probabilities(residues))
    if unsigned.size > _MOST_UNSIGNED or unsigned.size == signs.size or not is_known:
        yield Order(np.arange(signs.size), log_sign[signs], np.ones((1, signs.size), dtype=np.bool_))
        return
    tried = np.repeat(signs[None], 2**unsigned.size, axis=0)
    tried[:, unsigned] = list(product((1, -1), repeat=unsigned.size))
    for sign in (1, -1):
        own = np.flatnonzero((signs == sign) | (signs == 0))
        yield Order(own, np.repeat(log_sign[sign][None], own.size, axis=0), tried[:, own] == sign)


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
