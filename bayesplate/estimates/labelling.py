"""Labels for peaks that have none, where one mode is likely: tables and residuals use them.

The likelihood sums over all assignments of peaks to modes (`bayesplate.frequencies.peaks`), so that a proposed label
changes nothing there. But a residual needs a mode.
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

LIKELY_LABEL = 0.5
"""Probability above which a label is proposed: no two peaks can each be the same mode with more."""


def label_likely_peaks(setup: Setup, peaks: PeakLikelihood, probabilities: Floats, threshold: float) -> Setup:
    """A setup with labels for the peaks that are one mode with a probability above `threshold`.

    Earlier proposed labels are dropped; `probabilities` is (n_peaks, n_modes), and `threshold` is one half or more, so
    that no two peaks have the same label.
    """
    proposals = [_likely_label(peaks.labels, row, threshold) for row in probabilities]
    reading_labels = {int(i): label for i, label in zip(peaks.readings, proposals, strict=True) if i >= 0}
    bare_labels = {int(i): label for i, label in zip(peaks.unlabelled, proposals, strict=True) if i >= 0}
    stated_readings = {i: reading for i, reading in enumerate(setup.readings) if reading.confidence > 0}
    stated_labels = {i: reading.stated or reading.label for i, reading in stated_readings.items()}
    labels = _unique_labels(
        stated_labels, {i: label for i in stated_labels if (label := reading_labels.get(i)) is not None}
    )
    readings, bare, rest = [], [], []
    for i, reading in enumerate(setup.readings):
        peak = Peak(reading.frequency, reading.sign, reading.amplitude, reading.damping, reading.spurious)
        bare += [] if i in stated_readings else [(peak, reading_labels[i])]
    bare += [(peak, bare_labels[i]) for i, peak in enumerate(setup.peaks)]
    for i, reading in stated_readings.items():
        is_stated = labels[i] == stated_labels[i]
        readings.append(replace(_relabel(setup, reading, labels[i]), stated=None if is_stated else stated_labels[i]))
    for peak, proposal in sorted(bare, key=lambda pair: pair[0].frequency.mean):
        if proposal is None or proposal in labels.values():
            rest.append(peak)
        else:
            details = peak.amplitude, peak.damping, peak.spurious
            readings.append(
                _relabel(setup, Reading(proposal, (0, 0), peak.frequency, peak.sign, 0.0, None, *details), proposal)
            )
    return replace(setup, readings=tuple(readings), peaks=tuple(rest))


def _unique_labels(stated: Mapping[int, Label], proposed: Mapping[int, Label]) -> dict[int, Label]:
    """The label of each reading: the proposed one, unless a reading that keeps its stated label has the same."""
    labels = {**stated, **proposed}
    while doubles := [i for i, label in proposed.items() if label in (labels[j] for j in stated if j not in proposed)]:
        proposed = {i: label for i, label in proposed.items() if i not in doubles}
        labels = {**stated, **proposed}
    return labels


def _relabel(setup: Setup, reading: Reading, label: Label) -> Reading:
    return replace(reading, label=label, beams=(label.m - setup.first_label.m, label.n - setup.first_label.n))


def _likely_label(labels: Sequence[Label | None], probabilities: Floats, threshold: float) -> Label | None:
    best = int(np.argmax(probabilities))
    return labels[best] if probabilities[best] > threshold else None
