"""Where a sound sets in: its power leaps above what was heard just before, and above the quiet of the recording."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_BLOCK = 0.002
"""s over which a sound's power is taken."""
_RISE = 10.0
"""dB by which a hit stands above what was heard just before."""
_ABOVE_FLOOR = 20.0
"""dB by which a hit stands above the quiet of the recording."""
_BELOW_LOUDEST = 26.0
"""dB below the loudest hit at which nothing is a hit any more."""
_LOOK_BACK = 5
_BOARD_RATE = 4000.0
"""Samples a second that hold what a board rings at: hiss above it is louder than a soft tap."""
_LONG_BLOCK, _SOFT_RISE = 0.01, 6.0
"""s and dB: what rises so over so long is no noise and no beat of two modes, though it may be too soft for a hit."""


def onsets(response: Floats, rate: float) -> list[int]:
    """First samples of every hit that is heard, by its click in all that was recorded or by how the board rings."""
    found = np.concatenate([_rises(*heard, _BLOCK, _RISE, _ABOVE_FLOOR) for heard in _heard_as(response, rate)])
    return _first_of_each(np.sort(np.rint(found * rate).astype(np.intp)), rate)


def soft_onsets(response: Floats, rate: float) -> list[int]:
    """Samples at which the ringing of a board rises again, hits or not."""
    slow, slow_rate = _heard_as(response, rate)[-1]
    found = _rises(slow, slow_rate, _LONG_BLOCK, _SOFT_RISE, _SOFT_RISE)
    return _first_of_each(np.rint(found * rate).astype(np.intp), rate)


def _heard_as(response: Floats, rate: float) -> list[tuple[Floats, float]]:
    """The sound as it was recorded, and where there are more samples than a board needs the means of neighbours."""
    every = int(rate / _BOARD_RATE)
    if every < 2:
        return [(response, rate)]
    n = response.size // every
    return [(response, rate), (response[: n * every].reshape(n, every).mean(axis=1), rate / every)]


def _rises(response: Floats, rate: float, seconds: float, rise: float, above_floor: float) -> Floats:
    """Times of the blocks whose power leaps, s."""
    block = max(round(seconds * rate), 1)
    n = response.size // block
    if n < 2 * _LOOK_BACK:
        return np.empty(0)
    # How the slope changes from sample to sample: a hit is a click, the ringing of a board and hum are not.
    change = np.concatenate([np.zeros(2), np.diff(response[: n * block], n=2)])
    power = np.mean(change.reshape(n, block) ** 2, axis=1)
    floor = max(float(np.quantile(power, 0.1)), float(power.max()) * 1e-12, 1e-300)
    level = 10.0 * (np.log10(np.maximum(power, 1e-300)) - np.log10(floor))
    before = np.full(n, 0.0)
    before[1:] = level[:-1]
    for back in range(2, _LOOK_BACK + 1):
        before[back:] = np.maximum(before[back:], level[:-back])
    leaps = (level - before > rise) & (level > above_floor) & (level > level.max() - _BELOW_LOUDEST)
    return np.asarray(np.flatnonzero(leaps) * block / rate)


def _first_of_each(rises: NDArray[np.intp], rate: float) -> list[int]:
    """Onsets in samples: what sets in within a few blocks of another is the same hit."""
    apart = max(round(0.01 * rate), 1)
    found: list[int] = []
    for rise in rises:
        if not found or rise - found[-1] > apart:
            found.append(int(rise))
    return found
