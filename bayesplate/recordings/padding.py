"""Frequency responses whose records were padded with zeros before they were transformed.

Padding interpolates: it adds lines, and no information. Between the lines of the record itself, noise is not
independent, and a decay that was cut off is no simple rational term: its end adds a ripple, which looks like small
modes on either side of a strong one. So the lines of the record are kept and the others left out.

Padding shows over time. The noise of a record goes on to its end, however far the modes have decayed, and breaks off
there, while a mere decay falls ever more slowly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.arrays import Complex
from bayesplate.recordings.signals import FrequencyResponse

_FACTORS = (8, 4, 3, 2)
"""Lengths of padded records over their own."""
_SILENT_RATIO = 0.1
"""Largest power behind the end of a padded record over the power before it, times the square of its last fall."""
_EARLIER, _BEFORE, _BEHIND = (0.7, 0.8), (0.9, 1.0), (1.05, 1.15)
"""Parts of a record whose powers are compared."""
_FEWEST_LINES = 640


def padding_factor(values: Complex) -> int:
    """Number of lines of a response over those of its record; 1 where it does not look padded."""
    if values.size < _FEWEST_LINES:
        return 1
    over_time = np.abs(np.fft.ifft(values * np.hanning(values.size))) ** 2
    for factor in _FACTORS:
        ends = np.rint(np.array([_EARLIER, _BEFORE, _BEHIND]) * values.size / factor).astype(np.intp)
        earlier, before, behind = (over_time[first:last].mean() for first, last in ends)
        if behind * earlier**2 < _SILENT_RATIO * before * min(before, earlier) ** 2:
            return factor
    return 1


def common_padding(responses: Sequence[FrequencyResponse]) -> int:
    """The least padding of responses on one grid, so that no measured line is left out."""
    return min(padding_factor(response.values) for response in responses)
