"""Onsets of a sound: its power leaps above the sound just before, and above the quiet of the recording."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.signals import split_blocks

_BLOCK = 0.002
"""s over which the power of a sound is averaged."""
_RISE = 10.0
"""dB by which a hit rises above the sound just before."""
_ABOVE_FLOOR = 20.0
"""dB by which a hit rises above the quiet of the recording."""
_BELOW_LOUDEST = 26.0
"""dB below the loudest hit at which no sound counts as a hit."""
_LOOK_BACK = 5
_ORDER = 16
"""Order of the linear prediction: samples from which the next one is predicted."""
_QUIET_BLOCK, _QUIET_SHARE = 0.05, 0.25
"""s of a block, and share of the blocks that are quiet."""
_BOARD_RATE = 4000.0
"""Sampling rate that covers the modes of a board: hiss above it is louder than a soft tap."""
_LONG_BLOCK, _SOFT_RISE = 0.01, 6.0
"""s of a block and dB of a rise that is neither noise nor a beat of two modes, though it may be too soft for a hit."""
_SAME_HIT = 0.01
"""s within which two onsets are the same hit."""


def find_onsets(response: Floats, rate: float) -> list[int]:
    """First samples of all hits, by their clicks in the full sound or by the ringing of the board."""
    sounds = decimated_sounds(response, rate)
    rises = [
        _rise_times(_prediction_error(sound, sound_rate), sound_rate, _BLOCK, _RISE, _ABOVE_FLOOR)
        for sound, sound_rate in sounds
    ]
    return _distinct_onsets(np.concatenate(rises), rate)


def soft_onsets(response: Floats, rate: float) -> list[int]:
    """Samples at which the ringing of a board rises again, hits or not."""
    slow, slow_rate = decimated_sounds(response, rate)[-1]
    return _distinct_onsets(_rise_times(_second_difference(slow), slow_rate, _LONG_BLOCK, _SOFT_RISE, _SOFT_RISE), rate)


def decimated_sounds(response: Floats, rate: float) -> list[tuple[Floats, float]]:
    """The sound and its rate as recorded, and, where a board needs a lower rate only, averaged over neighbours."""
    factor = int(rate / _BOARD_RATE)
    if factor < 2:
        return [(response, rate)]
    return [(response, rate), (split_blocks(response, factor).mean(axis=1), rate / factor)]


def _rise_times(change: Floats, rate: float, seconds: float, rise: float, above_floor: float) -> Floats:
    """Times in s of the blocks whose power leaps."""
    block = max(round(seconds * rate), 1)
    power = np.mean(split_blocks(change, block) ** 2, axis=1)
    if power.size < 2 * _LOOK_BACK:
        return np.empty(0)
    floor = max(float(np.quantile(power, 0.1)), float(power.max()) * 1e-12, 1e-300)
    level = 10.0 * (np.log10(np.maximum(power, 1e-300)) - np.log10(floor))
    padded = np.concatenate([np.full(_LOOK_BACK, -np.inf), level])
    before = np.lib.stride_tricks.sliding_window_view(padded, _LOOK_BACK)[:-1].max(axis=1)
    leaps = (level - before > rise) & (level > above_floor) & (level > level.max() - _BELOW_LOUDEST)
    return np.asarray(np.flatnonzero(leaps) * block / rate)


def _second_difference(response: Floats) -> Floats:
    """The change of the slope from sample to sample, in which hum and rumble are faint."""
    return np.diff(response, n=2, prepend=[response[0]] * 2) if response.size else response


def _prediction_error(response: Floats, rate: float) -> Floats:
    """Error of a linear prediction learnt where it is quiet: it predicts hum and tones, not a hit."""
    from scipy.linalg import solve_toeplitz
    from scipy.signal import lfilter

    change = _second_difference(response)
    block = max(round(_QUIET_BLOCK * rate), 2 * _ORDER)
    blocks = split_blocks(change, block)
    power = np.sum(blocks**2, axis=1)
    quiet = blocks[power <= np.quantile(power, _QUIET_SHARE)] if len(blocks) else blocks
    lags = np.array([np.sum(quiet[:, k:] * quiet[:, : block - k]) for k in range(_ORDER + 1)])
    if lags[0] <= 0.0:
        return change
    lags[0] *= 1.0 + 1e-9
    weights = solve_toeplitz(lags[:-1], lags[1:])
    rest = np.asarray(lfilter([1.0, *-weights], 1.0, change))
    rest[: _ORDER + 2] = 0.0  # no samples before these
    return rest


def _distinct_onsets(times: Floats, rate: float) -> list[int]:
    """Onsets in samples, each hit once, from times in s in any order."""
    least_gap = max(round(_SAME_HIT * rate), 1)
    distinct: list[int] = []
    for rise in np.sort(np.rint(times * rate).astype(np.intp)):
        if not distinct or rise - distinct[-1] > least_gap:
            distinct.append(int(rise))
    return distinct
