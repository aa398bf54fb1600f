"""Labels for peaks that have none, where one mode is likely: what tables and residuals call them.

The likelihood sums over all assignments of peaks to modes (`bayesplate.frequencies.peaks`), so that a label which is
proposed says nothing there. But a residual needs a mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.labels import Label
from bayesplate.plate.measured import Peak, Reading
from bayesplate.plate.setup import Setup

LIKELY = 0.5
"""Probability from which on a label is proposed: no two peaks can have the same one."""


def with_labels(setup: Setup, peaks: PeakLikelihood, probabilities: NDArray[np.float64], least: float) -> Setup:
    """A setup with labels for the peaks that are one mode with a probability above the least one.

    Parameters
    ----------
    setup : Setup
        Labels that were proposed for it before are forgotten.
    peaks : PeakLikelihood
        Of this setup.
    probabilities : (n_peaks, n_modes) array
        Of each peak to be each mode.
    least : float
        At least one half, so that no two peaks have the same label.

    Returns
    -------
    Setup
    """
    likely = [_likely(peaks.labels, row, least) for row in probabilities]
    of_reading = {int(at): label for at, label in zip(peaks.readings, likely, strict=True) if at >= 0}
    of_bare = {int(at): label for at, label in zip(peaks.bare, likely, strict=True) if at >= 0}
    stated = {at: reading for at, reading in enumerate(setup.readings) if reading.confidence > 0}
    taken = {one.stated or one.label for at, one in stated.items() if of_reading.get(at) is None}
    readings, bare, rest = [], [], []
    for at, reading in enumerate(setup.readings):
        peak = Peak(reading.frequency, reading.sign, reading.amplitude, reading.damping)
        bare += [] if at in stated else [(peak, of_reading[at])]
    bare += [(peak, of_bare[i]) for i, peak in enumerate(setup.peaks)]
    for at, reading in stated.items():
        given = reading.stated or reading.label
        found = of_reading.get(at)
        used = given if found is None or found in taken else found
        readings.append(replace(_at(setup, reading, used), stated=None if used == given else given))
    for peak, found in sorted(bare, key=lambda one: one[0].frequency.mean):
        if found is None or found in taken:
            rest.append(peak)
        else:
            reading = Reading(found, (0, 0), peak.frequency, peak.sign, 0.0, None, peak.amplitude, peak.damping)
            readings.append(_at(setup, reading, found))
    return replace(setup, readings=tuple(readings), peaks=tuple(rest))


def _at(setup: Setup, reading: Reading, label: Label) -> Reading:
    """A reading with another label."""
    return replace(reading, label=label, beams=(label.m - setup.first_label.m, label.n - setup.first_label.n))


def _likely(labels: Sequence[Label | None], probabilities: NDArray[np.float64], least: float) -> Label | None:
    best = int(np.argmax(probabilities))
    return labels[best] if probabilities[best] > least else None
