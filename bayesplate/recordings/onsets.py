"""Where a sound sets in: its power leaps above what was heard just before, and above the quiet of the recording."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.signals import in_blocks

_BLOCK = 0.002
"""s over which a sound's power is taken."""
_RISE = 10.0
"""dB by which a hit stands above what was heard just before."""
_ABOVE_FLOOR = 20.0
"""dB by which a hit stands above the quiet of the recording."""
_BELOW_LOUDEST = 26.0
"""dB below the loudest hit at which nothing is a hit any more."""
_LOOK_BACK = 5
_ORDER = 16
"""Samples from which the next one is predicted."""
_QUIET_BLOCK, _QUIET = 0.05, 0.25
"""s of a block, and share of the blocks that are quiet."""
_BOARD_RATE = 4000.0
"""Samples a second that hold what a board rings at: hiss above it is louder than a soft tap."""
_LONG_BLOCK, _SOFT_RISE = 0.01, 6.0
"""s and dB: what rises so over so long is no noise and no beat of two modes, though it may be too soft for a hit."""
_APART = 0.01
"""s within which what sets in is the same hit."""


def onsets(response: Floats, rate: float) -> list[int]:
    """First samples of every hit that is heard, by its click in all that was recorded or by how the board rings."""
    every = heard_as(response, rate)
    found = [_rises(_unforeseen(heard, own), own, _BLOCK, _RISE, _ABOVE_FLOOR) for heard, own in every]
    return _first_of_each(np.concatenate(found), rate)


def soft_onsets(response: Floats, rate: float) -> list[int]:
    """Samples at which the ringing of a board rises again, hits or not."""
    slow, slow_rate = heard_as(response, rate)[-1]
    return _first_of_each(_rises(_curved(slow), slow_rate, _LONG_BLOCK, _SOFT_RISE, _SOFT_RISE), rate)


def heard_as(response: Floats, rate: float) -> list[tuple[Floats, float]]:
    """The sound as it was recorded, and where there are more samples than a board needs the means of neighbours."""
    every = int(rate / _BOARD_RATE)
    if every < 2:
        return [(response, rate)]
    return [(response, rate), (in_blocks(response, every).mean(axis=1), rate / every)]


def _rises(change: Floats, rate: float, seconds: float, rise: float, above_floor: float) -> Floats:
    """Times of the blocks whose power leaps, s."""
    block = max(round(seconds * rate), 1)
    power = np.mean(in_blocks(change, block) ** 2, axis=1)
    if power.size < 2 * _LOOK_BACK:
        return np.empty(0)
    floor = max(float(np.quantile(power, 0.1)), float(power.max()) * 1e-12, 1e-300)
    level = 10.0 * (np.log10(np.maximum(power, 1e-300)) - np.log10(floor))
    padded = np.concatenate([np.full(_LOOK_BACK, -np.inf), level])
    before = np.lib.stride_tricks.sliding_window_view(padded, _LOOK_BACK)[:-1].max(axis=1)
    leaps = (level - before > rise) & (level > above_floor) & (level > level.max() - _BELOW_LOUDEST)
    return np.asarray(np.flatnonzero(leaps) * block / rate)


def _curved(response: Floats) -> Floats:
    """How the slope changes from sample to sample: in it hum and rumble are faint."""
    return np.diff(response, n=2, prepend=[response[0]] * 2) if response.size else response


def _unforeseen(response: Floats, rate: float) -> Floats:
    """What a linear prediction learnt where it is quiet does not foresee: hum and tones go on, a hit does not."""
    from scipy.linalg import solve_toeplitz
    from scipy.signal import lfilter

    change = _curved(response)
    block = max(round(_QUIET_BLOCK * rate), 2 * _ORDER)
    blocks = in_blocks(change, block)
    power = np.sum(blocks**2, axis=1)
    quiet = blocks[power <= np.quantile(power, _QUIET)] if len(blocks) else blocks
    lags = np.array([np.sum(quiet[:, k:] * quiet[:, : block - k]) for k in range(_ORDER + 1)])
    if lags[0] <= 0.0:
        return change
    lags[0] *= 1.0 + 1e-9
    weights = solve_toeplitz(lags[:-1], lags[1:])
    rest = np.asarray(lfilter([1.0, *-weights], 1.0, change))
    rest[: _ORDER + 2] = 0.0  # nothing came before
    return rest


def _first_of_each(times: Floats, rate: float) -> list[int]:
    """Onsets in samples, each once, of times in s in any order."""
    apart = max(round(_APART * rate), 1)
    found: list[int] = []
    for rise in np.sort(np.rint(times * rate).astype(np.intp)):
        if not found or rise - found[-1] > apart:
            found.append(int(rise))
    return found
