"""What a channel holds: the response of a board, which rings, the pulses of a hammer, silence, or a copy of another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault
from bayesplate.recordings.signals import Recording

Floats = NDArray[np.float64]

SILENT = 1e-5
"""Of full scale: less than the last bit of 16."""
_ALIKE, _COPY = 0.95, 0.9999
"""Correlation from which on two channels are one sound: a pulse and what rings after it have hardly any; and from which
on they differ by rounding alone."""
_BLOCK = 0.005
_AFTER = 4, 24
"""Blocks after the loudest one, 20 to 120 ms, in which a hammer has left the board and the board still rings."""
_RINGS, _ABOVE_QUIET = 0.003, 10.0
"""Power there over that of the loudest block, and over the quiet of the channel, from which on it rings."""
_GATE_BLOCK, _GATED = 0.01, 0.1
"""s of a block, and share of blocks without any sound that a noise gate leaves."""
_PULSE, _NEAR_QUIET = 1e4, 3.0
"""Power of the loudest block over that after it, and of that over the quiet, of a channel that does not ring."""


def force_fault(one: Recording) -> Fault | None:
    """What a recording has in the place of a force; None where it is one, or where none was recorded."""
    if one.force is None:
        return None
    if _correlation(one.force, one.response) > _ALIKE:
        got = "nearly the same as the response"
    elif rings(one.force, one.rate):
        got = "one that rings on after it"
    else:
        return None
    remedy = "--channels response,force where they are exchanged, response,response for a stereo microphone"
    return Fault(f"{one.name} force", "a channel with a pulse for each hit", got, remedy)


def is_copy(one: Floats, other: Floats) -> bool:
    """Whether two channels are the same but for a factor and rounding."""
    return _correlation(one, other) > _COPY


def rings(signal: Floats, rate: float) -> bool:
    """Whether there is still power after the loudest moment, in most blocks: the pulse of a bounce is in one or two."""
    loudest, after, quiet = _powers(signal, rate)
    return after > max(_RINGS * loudest, _ABOVE_QUIET * quiet)


def is_pulse(signal: Floats, rate: float) -> bool:
    """Whether a channel is silent as soon as its loudest moment is over: a hammer's force, not a board."""
    loudest, after, quiet = _powers(signal, rate)
    return loudest > _PULSE * after and after <= _NEAR_QUIET * quiet


def is_cut_to_silence(signal: Floats, rate: float) -> bool:
    """Whether a noise gate shows: much of a recording holds one and the same number."""
    block = max(round(_GATE_BLOCK * rate), 2)
    n = signal.size // block
    return bool(n and np.mean(np.ptp(signal[: n * block].reshape(n, block), axis=1) == 0.0) > _GATED)


def _correlation(one: Floats, other: Floats) -> float:
    """Share of their common power, 0 to 1; 0 where one does not move."""
    one, other = one - one.mean(), other - other.mean()
    power = float(one @ one) * float(other @ other)
    return abs(float(one @ other)) / np.sqrt(power) if power > 0.0 else 0.0


def _powers(signal: Floats, rate: float) -> tuple[float, float, float]:
    """Power of the loudest block, the median after it, and that of the quiet; all 0 where nothing comes after."""
    block = max(round(_BLOCK * rate), 1)
    n = signal.size // block
    if n <= _AFTER[1]:
        return 0.0, 0.0, 0.0
    power = np.mean((signal[: n * block] - np.median(signal)).reshape(n, block) ** 2, axis=1)
    loudest = int(np.argmax(power[: n - _AFTER[1]]))
    after = power[loudest + _AFTER[0] : loudest + _AFTER[1]]
    return float(power[loudest]), float(np.median(after)), float(np.quantile(power, 0.1))
