"""Whether a channel is the force of a hammer: pulses and quiet between them, nothing that rings like the board."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault
from bayesplate.recordings.signals import Recording

Floats = NDArray[np.float64]

_ALIKE = 0.95
"""Correlation with the response from which on both are one sound: a pulse and what rings after it have hardly any."""
_BLOCK = 0.005
_AFTER = 4, 24
"""Blocks after the loudest one, 20 to 120 ms, in which a hammer has left the board and the board still rings."""
_RINGS, _ABOVE_QUIET = 0.003, 10.0
"""Power there over that of the loudest block, and over the quiet of the channel, from which on it rings."""


def force_fault(one: Recording) -> Fault | None:
    """What a recording has in the place of a force; None where it is one, or where none was recorded."""
    if one.force is None:
        return None
    if _correlation(one.force, one.response) > _ALIKE:
        got = "nearly the same as the response"
    elif _rings(one.force, one.rate):
        got = "one that rings on after it"
    else:
        return None
    remedy = "--channels response,force where they are exchanged, response,response for a stereo microphone"
    return Fault(f"{one.name} force", "a channel with a pulse for each hit", got, remedy)


def _correlation(one: Floats, other: Floats) -> float:
    """Share of their common power, 0 to 1; 0 where one does not move."""
    one, other = one - one.mean(), other - other.mean()
    power = float(one @ one) * float(other @ other)
    return abs(float(one @ other)) / np.sqrt(power) if power > 0.0 else 0.0


def _rings(force: Floats, rate: float) -> bool:
    """Whether there is still power after the loudest moment, in most blocks: the pulse of a bounce is in one or two."""
    block = max(round(_BLOCK * rate), 1)
    n = force.size // block
    power = np.mean((force[: n * block] - np.median(force)).reshape(n, block) ** 2, axis=1)
    loudest = int(np.argmax(power[: n - _AFTER[1]])) if n > _AFTER[1] else n
    after = power[loudest + _AFTER[0] : loudest + _AFTER[1]]
    if after.size == 0:
        return False
    return bool(np.median(after) > max(_RINGS * power[loudest], _ABOVE_QUIET * np.quantile(power, 0.1)))
