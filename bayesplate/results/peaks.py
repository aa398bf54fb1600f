"""The peaks of a summary: which mode each peak without a sure label is, with what probability."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.setup import Setup
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.labels import Label
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.likely_labels import MOST_DRAWS_OF_LABELS
from bayesplate.posterior.posing import PosedProblem
from bayesplate.results.modes import Prediction, over

UNNAMED = "cannot tell"
"""A mode whose shape is no clear product of beam functions."""
LEAST = 0.005
"""Probability below which a mode is not listed."""


@dataclass(frozen=True)
class Assignment:
    """A mode that a peak may be, and the probability that it is."""

    label: str
    probability: float


@dataclass(frozen=True)
class AssignedPeak:
    """A peak without a label, or with one that may be wrong.

    Attributes
    ----------
    setup : str
    hz : float
        As read.
    stated : str or None
        Its label on the card.
    assignments : tuple of Assignment
        The most probable mode first; those below half a per cent are left out.
    spurious_probability : float
        That it is no mode of the plate.
    predicted_hz : Prediction
        Of its most probable mode.
    residual_cents : float
        The peak over that mode's mean.
    """

    setup: str
    hz: float
    stated: str | None
    assignments: tuple[Assignment, ...]
    spurious_probability: float
    predicted_hz: Prediction
    residual_cents: float


@dataclass(frozen=True)
class PredictedMode:
    """A mode that peaks may be.

    Attributes
    ----------
    setup, label : str
    predicted_hz : Prediction
    seen_probability : float
        That one of the peaks is this mode.
    """

    setup: str
    label: str
    predicted_hz: Prediction
    seen_probability: float


@dataclass(frozen=True)
class Spectrum:
    """How the peaks of a setup were taken for modes.

    Attributes
    ----------
    setup : str
    missed_probability, spurious_probability : float
        Beforehand: that a mode left no peak, and that a peak is no mode.
    modes : tuple of PredictedMode
        In the order of frequency, up to a little above the highest peak.
    """

    setup: str
    missed_probability: float
    spurious_probability: float
    modes: tuple[PredictedMode, ...]


def assigned_peaks(problem: PosedProblem, draws: Draws) -> tuple[tuple[AssignedPeak, ...], tuple[Spectrum, ...]]:
    """Every peak whose label is not sure, and the modes of its setup, averaged over the posterior.

    Parameters
    ----------
    problem : PosedProblem
    draws : Draws

    Returns
    -------
    peaks : tuple of AssignedPeak
        Setup after setup, in the order of frequency.
    spectra : tuple of Spectrum
        Of the setups that have such peaks.
    """
    peaks: list[AssignedPeak] = []
    spectra = []
    for i, (setup, likelihood) in enumerate(zip(problem.board.setups, problem.posterior.peaks, strict=True)):
        if likelihood is None:
            continue
        every = draws.every_log_frequency[i]
        flat, noise = every.reshape(-1, every.shape[-1]), draws.noise[..., i].ravel()
        predicted = [_predicted(np.exp(column)) for column in flat[:, likelihood.columns].T]
        step = max(1, len(flat) // MOST_DRAWS_OF_LABELS)
        probabilities = likelihood.probabilities(flat[::step], noise[::step])
        peaks += _of_setup(setup, likelihood, probabilities, predicted)
        seen = probabilities.sum(axis=0)
        modes = (
            PredictedMode(setup.name, _name(label), one, float(share))
            for label, one, share in zip(likelihood.labels, predicted, seen, strict=True)
        )
        in_order = tuple(sorted(modes, key=lambda mode: mode.predicted_hz.mean))
        spectra.append(Spectrum(setup.name, setup.missed, setup.spurious, in_order))
    return tuple(peaks), tuple(spectra)


def _of_setup(
    setup: Setup, likelihood: PeakLikelihood, probabilities: NDArray[np.float64], predicted: list[Prediction]
) -> Iterator[AssignedPeak]:
    for i, (row, at) in enumerate(zip(probabilities, likelihood.readings, strict=True)):
        order = np.argsort(-row, kind="stable")
        reading = setup.readings[at] if at >= 0 else None
        stated = None if reading is None or not reading.confidence else reading.stated or reading.label
        hertz = float(likelihood.errors.frequency[i])
        best = predicted[order[0]]
        yield AssignedPeak(
            setup=setup.name,
            hz=hertz,
            stated=None if stated is None else str(stated),
            assignments=tuple(Assignment(_name(likelihood.labels[j]), float(row[j])) for j in order if row[j] >= LEAST),
            spurious_probability=float(max(1.0 - row.sum(), 0.0)),
            predicted_hz=best,
            residual_cents=over(hertz, best.mean),
        )


def _predicted(hertz: NDArray[np.float64]) -> Prediction:
    low, high = np.quantile(hertz, [0.05, 0.95])
    return Prediction(float(hertz.mean()), float(low), float(high))


def _name(label: Label | None) -> str:
    return UNNAMED if label is None else str(label)
