"""Peaks of a setup that have no label, or a doubtful one: what they say of the frequencies of all its modes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.assignment import Assignments
from bayesplate.frequencies.model import SetupModel
from bayesplate.frequencies.residues import NODAL_LINE
from bayesplate.labels import Label
from bayesplate.plate.readings import ReadingErrors
from bayesplate.plate.setup import Setup

Floats = NDArray[np.float64]
Rows = NDArray[np.intp]

_SIGNS = {"+": 1, "-": -1, "": 0}


@dataclass(frozen=True, eq=False)
class PeakLikelihood:
    """The probability of a setup's peaks, summed over all assignments to its modes (`Assignments`).

    A peak is no mode with a prior probability, and then lies anywhere up to the highest one; otherwise it is one of the
    modes that no certain label has taken, about which it scatters as a reading does. A mode leaves no peak with a prior
    probability, which is higher the nearer hammer or sensor stand to its nodal lines, or if it lies above the highest
    peak. Where the signs of residues are known, on the card and from the shapes, a peak of the other sign is not that
    mode, and peaks and modes keep their order within a sign only. A label that may be wrong is right with the
    probability that the card gives, and otherwise any other mode's.

    Attributes
    ----------
    errors : ReadingErrors
        Of the peaks, in the order of frequency.
    readings : (n_peaks,) array of int
        Which labelled reading each peak is; -1 for a peak without a label.
    columns : (n_modes,) array of int
        The modes that peaks may be, among all of the setup's model: the labelled ones first.
    labels : tuple of Label or None
        Of these modes.
    log_prior : (n_peaks, n_modes) array
        ln of what is known of each pair beforehand: seen, no spurious peak, its sign, its label.
    log_alone : (n_peaks,) array
        ln of the probability of each peak if it is no mode.
    missed : (n_modes,) array
        Probability that a mode below the highest peak left none.
    groups : tuple of (array of int, array of int)
        Peaks and modes that keep their order: all, or those of one sign.
    log_highest : float
        ln of the highest frequency that was read, Hz.
    """

    errors: ReadingErrors
    readings: Rows
    columns: Rows
    labels: tuple[Label | None, ...]
    log_prior: Floats
    log_alone: Floats
    missed: Floats
    groups: tuple[tuple[Rows, Rows], ...]
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
        doubtful = np.flatnonzero([reading.confidence < 1.0 for reading in setup.readings])
        readings = np.concatenate([np.full(len(setup.peaks), -1), doubtful]).astype(np.intp)
        errors = ReadingErrors.of_peaks(setup, doubtful, robust)
        order = np.argsort(errors.frequency, kind="stable")
        errors, readings = errors.at(order), readings[order]
        signs = np.array([_SIGNS[sign] for sign in _signs(setup, doubtful)])[order]
        others = np.arange(len(setup.readings), len(model.every_place))
        columns = np.concatenate([doubtful, others]).astype(np.intp)
        residues = None if model.residues is None else model.residues[columns]
        seen = np.full(columns.size, 1.0 - setup.missed)
        known = np.zeros(columns.size)
        if residues is not None:
            size = np.nan_to_num(residues, nan=1.0) ** 2
            seen = seen * size / (size + NODAL_LINE**2)
            known = np.nan_to_num(np.sign(residues))
        opposed = signs[:, None] * known < 0
        log_pair = np.where(opposed, -np.inf, np.log(seen) + np.log1p(-setup.spurious))
        log_label = _log_labels(setup, readings, columns)
        highest = max([*setup.measured, *setup.unlabelled])
        wide = np.where(errors.rounded, errors.resolution, errors.frequency) / highest
        log_alone = (
            np.log(setup.spurious * wide) + log_label[:, -1] + np.where((signs != 0) & known.any(), -np.log(2), 0)
        )
        return cls(
            errors=errors,
            readings=readings,
            columns=columns,
            labels=tuple(_labels(model)[column] for column in columns),
            log_prior=log_pair + log_label[:, :-1],
            log_alone=log_alone,
            missed=1.0 - seen,
            groups=tuple(_groups(signs, known)),
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
        has_all = np.isfinite(there).all(axis=1)
        result = np.full(len(there), -np.inf)
        if has_all.any():
            by_group = (one.log_sum() for _, _, one in self._assignments(there[has_all], noise[has_all]))
            result[has_all] = sum(by_group)
        return result

    def probabilities(self, every_log_frequency: Floats, noise: Floats) -> Floats:
        """Probability that each peak is each mode, averaged over draws: (n_peaks, n_modes) array; the rest: it is none.

        Parameters
        ----------
        every_log_frequency : (n_draws, n_every) array
            ln f (Hz), all of them finite.
        noise : (n_draws,) array
        """
        result = np.zeros(self.log_prior.shape)
        for peaks, modes, one in self._assignments(every_log_frequency[:, self.columns], noise):
            by_mode = np.zeros((len(noise), peaks.size, self.columns.size))
            np.put_along_axis(by_mode, modes[:, None, :], one.pairs(), axis=2)
            result[peaks] += by_mode.mean(axis=0)
        return result

    def _assignments(self, there: Floats, noise: Floats) -> Iterator[tuple[Rows, Rows, Assignments]]:
        """Peaks of each group, its modes in the order of each draw, (n_draws, n) array, and what the ones say of the others."""
        sd = self.errors.sd(noise).mean(axis=1, keepdims=True)
        above = _upper((there - self.log_highest) / sd)
        missed = self.missed + (1.0 - self.missed) * above
        log_errors = self.errors.log_likelihood_of_each(there, noise)
        for peaks, modes in self.groups:
            order = modes[np.argsort(there[:, modes], axis=1)]
            pair = (log_errors + self.log_prior)[:, peaks]
            one = Assignments(
                np.take_along_axis(pair, order[:, None, :], axis=2),
                self.log_alone[peaks],
                np.take_along_axis(missed, order, axis=1),
            )
            yield peaks, order, one


def takes_part(setup: Setup) -> bool:
    """Whether a setup has peaks without a label, or with a doubtful one."""
    return bool(setup.peaks) or any(reading.confidence < 1.0 for reading in setup.readings)


def _signs(setup: Setup, doubtful: Rows) -> list[str]:
    return [*(peak.sign for peak in setup.peaks), *(setup.readings[i].sign for i in doubtful)]


def _groups(signs: Rows, known: Floats) -> Iterator[tuple[Rows, Rows]]:
    """Those of one sign where all signs are known, otherwise all together."""
    if not (signs.all() and known.all()):
        yield np.arange(signs.size), np.arange(known.size)
        return
    for sign in (1, -1):
        peaks, modes = np.flatnonzero(signs == sign), np.flatnonzero(known == sign)
        if peaks.size or modes.size:
            yield peaks, modes


def _labels(model: SetupModel) -> list[Label | None]:
    """Of all modes of a model."""
    first = model.setup.first_label
    others = (
        None if one.beams is None else Label(one.beams[0] + first.m, one.beams[1] + first.n) for one in model.others
    )
    return [*model.setup.labels, *others]


def _log_labels(setup: Setup, readings: Rows, columns: Rows) -> Floats:
    """ln of the probability of what each peak was labelled, for each mode and, last, if it is no mode.

    A label that is right with probability c is each other mode's with an equal share of 1 - c.
    """
    result = np.zeros((readings.size, columns.size + 1))
    for i, reading in enumerate(readings):
        if reading >= 0:
            confidence = setup.readings[reading].confidence
            result[i] = np.log((1.0 - confidence) / columns.size)
            result[i, :-1][columns == reading] = np.log(confidence)
    return result


def _upper(z: Floats) -> Floats:
    """Probability that a standard normal number is above -z."""
    from scipy.special import ndtr

    return np.asarray(ndtr(z))
