"""Frequency responses whose records were padded with zeros before they were transformed.

Padding interpolates: it adds lines, and no knowledge. Between those that the record itself has, neither is noise
independent nor is a decay that was cut off a simple rational term: its end adds a ripple, which looks like small modes
on either side of a strong one. So the lines of the record are kept and the others left out.

Over time such a response gives itself away. A record's noise goes on to its end, however far the modes have decayed;
there it breaks off, while what merely decays falls ever more slowly.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bayesplate.arrays import Complex
from bayesplate.recordings.signals import FrequencyResponse

_FACTORS = (8, 4, 3, 2)
"""Lengths that padded records have, in their own."""
_SILENT = 0.1
"""Power behind the end of a record over that before it, at most; times that of how it fell just before, squared."""
_EARLIER, _BEFORE, _BEHIND = (0.7, 0.8), (0.9, 1.0), (1.05, 1.15)
"""Parts of a record, of which the powers are compared."""
_FEWEST_LINES = 640


def padding_of(values: Complex) -> int:
    """How many times as many lines a response has as its record; 1 where nothing tells that it was padded."""
    if values.size < _FEWEST_LINES:
        return 1
    over_time = np.abs(np.fft.ifft(values * np.hanning(values.size))) ** 2
    for factor in _FACTORS:
        ends = np.rint(np.array([_EARLIER, _BEFORE, _BEHIND]) * values.size / factor).astype(np.intp)
        earlier, before, behind = (over_time[first:last].mean() for first, last in ends)
        if behind * earlier**2 < _SILENT * before * min(before, earlier) ** 2:
            return factor
    return 1


def common_padding(responses: Sequence[FrequencyResponse]) -> int:
    """The least padding of responses on one grid: nothing that one of them knows is left out."""
    return min(padding_of(one.values) for one in responses)
