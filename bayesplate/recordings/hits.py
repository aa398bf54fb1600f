"""Where a board was hit in a recording: by the force where it was recorded, otherwise by how the sound sets in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.onsets import heard_as, onsets, soft_onsets
from bayesplate.recordings.signals import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence

Floats = NDArray[np.float64]

LEAST_DURATION = 0.25
"""s; a shorter decay does not tell neighbouring modes of a board apart."""
LONGEST_DURATION = 4.0
"""s of a decay that are looked at: by then boards are silent."""
LEAST_FALL = 10.0
"""dB by which a sound must have fallen before the next hit."""
BOUNCE = 0.1
"""s after a hit within which another one is a bounce of the hammer."""
_AFTER_SOUND = 0.004
"""s after a tap sets in, when finger or knuckle have left the board."""
_GATE_BLOCK, _GATE_BLOCKS, _GATE_FALL, _GATE_SLOW = 0.01, 10, 3.0, 1.0
"""s of a block; blocks within which a noise gate shuts; powers of ten by which it falls then for good, and by which it
fell at most in as many blocks before."""
_SETTLED = 0.03
"""s after a hit and before the next one in which a rise of the sound is that hit."""
_OF_PULSE, _OF_BOUNCE = 0.05, 0.1
"""Share of the greatest force that belongs to a pulse, and from which on another pulse is a hit."""
_AFTER_FORCE = 0.0005


@dataclass(frozen=True)
class Hit:
    """One hit in a recording, in samples.

    Attributes
    ----------
    onset : int
        Where it begins.
    start : int
        From where on the board rings by itself.
    stop : int
        Where the next hit, or the end, cuts it off.
    fault : str
        Why it cannot be used; empty if it can.
    is_gated : bool
        Whether a noise gate cuts it off, before the next hit.
    """

    onset: int
    start: int
    stop: int
    fault: str = ""
    is_gated: bool = False


def find_hits(recording: Recording) -> list[Hit]:
    """Every hit of a recording, in order; empty where there is none."""
    if recording.force is not None:
        pulses = _pulses(recording.force, recording.rate)
        lag = round(_AFTER_FORCE * recording.rate)
    else:
        lag = round(_AFTER_SOUND * recording.rate)
        pulses = [(onset, onset) for onset in onsets(recording.response, recording.rate)]
    ends = [*(begin for begin, _ in pulses[1:]), recording.response.size][: len(pulses)]
    hits = []
    after_bounce = False
    for i, ((begin, end), stop) in enumerate(zip(pulses, ends, strict=True)):
        start = end + lag
        gated = _gated(recording.response[start:stop], recording.rate)
        is_gated, stop = gated is not None, stop if gated is None else start + gated
        is_last = i == len(pulses) - 1
        is_bounced = not is_last and stop - begin < BOUNCE * recording.rate
        fault = "" if not (is_bounced or after_bounce) else "a double hit: the hammer bounced"
        if not fault:
            fault = _fault(recording, begin, start, stop, "a noise gate" if is_gated else "the end" * is_last)
        hits.append(Hit(begin, start, stop, fault, is_gated))
        after_bounce = is_bounced
    return hits


def _fault(recording: Recording, onset: int, start: int, stop: int, end: str) -> str:
    """Why what follows a hit cannot be used; `end` is what cuts it off, empty where that is the next hit."""
    length = (stop - start) / recording.rate
    if length < LEAST_DURATION:
        return f"only {max(length, 0.0):.2g} s until {end or 'the next hit'}"
    if not end and _fall(recording.response, recording.rate, onset, start, stop) < LEAST_FALL:
        return f"the next hit came before it had fallen by {LEAST_FALL:g} dB"
    return ""


def _fall(response: Floats, rate: float, onset: int, start: int, stop: int) -> float:
    """By how many dB a sound falls from its first tenth to its last, at the frequencies that the hit has raised.

    Hum, a steady tone and rumble were there before the hit, and do not fall.
    """
    slow, slow_rate = heard_as(response, rate)[-1]
    onset, start, stop = (round(at * slow_rate / rate) for at in (onset, start, stop))
    tenth = max((stop - start) // 10, 1)
    parts = (slice(max(onset - tenth, 0), onset), slice(start, start + tenth), slice(stop - tenth, stop))
    before, first, last = (_powers(slow[part], tenth) for part in parts)
    raised = first > 10.0 ** (LEAST_FALL / 10.0) * before
    return 10.0 * float(np.log10(max(first[raised].sum(), 1e-300) / max(last[raised].sum(), 1e-300)))


def _powers(part: Floats, n: int) -> Floats:
    """Power of each line of a part, as if it had n samples: (n // 2 + 1,) array."""
    if not part.size:
        return np.zeros(n // 2 + 1)
    change = np.diff(part, prepend=part[0])  # rumble hardly changes
    return np.asarray(np.abs(np.fft.rfft(np.hanning(part.size) * change, n)) ** 2)


def _gated(heard: Floats, rate: float) -> int | None:
    """Where a noise gate cuts a decay off: it falls suddenly, far and for good; None where none does."""
    block = max(round(_GATE_BLOCK * rate), 1)
    n = heard.size // block
    steps = np.abs(np.diff(heard))
    if n < 3 * _GATE_BLOCKS or not steps.any():
        return None
    least = max(float(steps[steps > 0.0].min()) ** 2, 1e-300)  # what is rounded to nothing is not cut off
    level = np.log10(np.mean((heard[: n * block] - np.median(heard)).reshape(n, block) ** 2, axis=1) + least)
    later = np.maximum.accumulate(level[::-1])[::-1]  # the loudest from there on
    at = np.arange(_GATE_BLOCKS, n - 2 * _GATE_BLOCKS)
    falls = level[at] - later[at + _GATE_BLOCKS] > _GATE_FALL
    is_sudden = np.max([level[at - k] for k in range(1, _GATE_BLOCKS + 1)], axis=0) - level[at] < _GATE_SLOW
    found = at[falls & is_sudden]
    return int(found[0] * block) if found.size else None


def _pulses(force: Floats, rate: float) -> list[tuple[int, int]]:
    """First and last sample of every pulse of force."""
    level = np.abs(force - np.median(force))
    top = float(level.max())
    if top <= 0.0 or top < 8.0 * float(np.median(level)) + 1e-300:
        return []
    on = np.flatnonzero(level > _OF_PULSE * top)
    gaps = np.flatnonzero(np.diff(on) > 0.002 * rate)
    begins, ends = on[np.r_[0, gaps + 1]], on[np.r_[gaps, on.size - 1]]
    strong = [level[b : e + 1].max() > _OF_BOUNCE * top for b, e in zip(begins, ends, strict=True)]
    return [(int(b), int(e)) for b, e, is_hit in zip(begins, ends, strong, strict=True) if is_hit]


def usable(hits: Sequence[Hit]) -> list[Hit]:
    """Those without a fault."""
    return [hit for hit in hits if not hit.fault]


def rising_again(recording: Recording, hits: Sequence[Hit], duration: float) -> list[float]:
    """Times at which a board is heard anew within some seconds after a hit, s from the beginning of the recording."""
    again = np.array(soft_onsets(recording.response, recording.rate)) / recording.rate
    found = []
    for hit in hits:
        first = hit.start / recording.rate + _SETTLED
        last = min(hit.start / recording.rate + duration, hit.stop / recording.rate - _SETTLED)
        found += [float(time) for time in again[(again > first) & (again < last)]]
    return found
