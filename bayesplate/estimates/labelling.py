"""Labels for peaks that have none, where one mode is likely: what tables and residuals call them.

The likelihood sums over all assignments of peaks to modes (`bayesplate.frequencies.peaks`), so that a label which is
proposed says nothing there. But a residual needs a mode.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.reading import Peak, Reading
from bayesplate.board.setup import Setup
from bayesplate.frequencies.peaks import PeakLikelihood
from bayesplate.labels import Label

LIKELY = 0.5
"""Probability above which a label is proposed: no two peaks can each be the same mode with more."""


def with_labels(setup: Setup, peaks: PeakLikelihood, probabilities: Floats, least: float) -> Setup:
    """A setup with labels for the peaks that are one mode with a probability above the least one.

    Labels that were proposed before are forgotten; `probabilities` is (n_peaks, n_modes), and the least one at least
    one half, so that no two peaks have the same label.
    """
    likely = [_likely(peaks.labels, row, least) for row in probabilities]
    of_reading = {int(at): label for at, label in zip(peaks.readings, likely, strict=True) if at >= 0}
    of_bare = {int(at): label for at, label in zip(peaks.bare, likely, strict=True) if at >= 0}
    stated = {at: reading for at, reading in enumerate(setup.readings) if reading.confidence > 0}
    given = {at: one.stated or one.label for at, one in stated.items()}
    used = _without_doubles(given, {at: label for at in given if (label := of_reading.get(at)) is not None})
    readings, bare, rest = [], [], []
    for at, reading in enumerate(setup.readings):
        peak = Peak(reading.frequency, reading.sign, reading.amplitude, reading.damping, reading.spurious)
        bare += [] if at in stated else [(peak, of_reading[at])]
    bare += [(peak, of_bare[i]) for i, peak in enumerate(setup.peaks)]
    for at, reading in stated.items():
        is_given = used[at] == given[at]
        readings.append(replace(_at(setup, reading, used[at]), stated=None if is_given else given[at]))
    for peak, found in sorted(bare, key=lambda one: one[0].frequency.mean):
        if found is None or found in used.values():
            rest.append(peak)
        else:
            told = peak.amplitude, peak.damping, peak.spurious
            readings.append(_at(setup, Reading(found, (0, 0), peak.frequency, peak.sign, 0.0, None, *told), found))
    return replace(setup, readings=tuple(readings), peaks=tuple(rest))


def _without_doubles(given: Mapping[int, Label], found: Mapping[int, Label]) -> dict[int, Label]:
    """The label of each reading: what was found, unless a reading whose given label stays has it."""
    used = {**given, **found}
    while doubles := [at for at, label in found.items() if label in (used[i] for i in given if i not in found)]:
        found = {at: label for at, label in found.items() if at not in doubles}
        used = {**given, **found}
    return used


def _at(setup: Setup, reading: Reading, label: Label) -> Reading:
    return replace(reading, label=label, beams=(label.m - setup.first_label.m, label.n - setup.first_label.n))


def _likely(labels: Sequence[Label | None], probabilities: Floats, least: float) -> Label | None:
    best = int(np.argmax(probabilities))
    return labels[best] if probabilities[best] > least else None
