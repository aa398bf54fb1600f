"""Where a board was hit in a recording: by the force where it was recorded, otherwise by how the sound sets in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.onsets import heard_as, onsets, soft_onsets
from bayesplate.recordings.signals import Recording, in_blocks

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
    """One hit in a recording: samples where it begins, from where on the board rings by itself, and where that ends."""

    onset: int
    start: int
    stop: int
    fault: str = ""
    """Why it cannot be used."""
    is_gated: bool = False
    """Whether a noise gate cuts it off, before the next hit."""


def find_hits(recording: Recording) -> list[Hit]:
    """Every hit of a recording, in order; empty where there is none."""
    response, rate = recording.response, recording.rate
    if recording.force is not None:
        pulses, lag = _pulses(recording.force, rate), round(_AFTER_FORCE * rate)
    else:
        pulses, lag = [(onset, onset) for onset in onsets(response, rate)], round(_AFTER_SOUND * rate)
    ends = [*(begin for begin, _ in pulses[1:]), response.size][: len(pulses)]
    hits = []
    after_bounce = False
    for i, ((begin, end), stop) in enumerate(zip(pulses, ends, strict=True)):
        start = end + lag
        gated = _gated(response[start:stop], rate)
        stop = stop if gated is None else start + gated
        is_last = i == len(pulses) - 1
        is_bounced = not is_last and stop - begin < BOUNCE * rate
        if is_bounced or after_bounce:
            fault = "a double hit: the hammer bounced"
        else:
            fault = _fault(recording, begin, start, stop, "the end" * is_last if gated is None else "a noise gate")
        hits.append(Hit(begin, start, stop, fault, gated is not None))
        after_bounce = is_bounced
    return hits


def usable(hits: Sequence[Hit]) -> list[Hit]:
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


def _fault(recording: Recording, onset: int, start: int, stop: int, end: str) -> str:
    """Why what follows a hit cannot be used; `end` is what cuts it off, empty where that is the next hit."""
    length = (stop - start) / recording.rate
    if length < LEAST_DURATION:
        return f"only {max(length, 0.0):.2g} s until {end or 'the next hit'}"
    if not end and _fall(recording.response, recording.rate, onset, start, stop) < LEAST_FALL:
        return f"the next hit came before it had fallen by {LEAST_FALL:g} dB"
    return ""


def _fall(response: Floats, rate: float, onset: int, start: int, stop: int) -> float:
    """Fall of a sound in dB from its first tenth to its last, at the frequencies that the hit has raised.

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
    """Sample at which a noise gate cuts a decay off: it falls suddenly, far and for good; None where none does."""
    block = max(round(_GATE_BLOCK * rate), 1)
    blocks, steps = in_blocks(heard, block), np.abs(np.diff(heard))
    n = len(blocks)
    if n < 3 * _GATE_BLOCKS or not steps.any():
        return None
    least = max(float(steps[steps > 0.0].min()) ** 2, 1e-300)  # what is rounded to nothing is not cut off
    level = np.log10(np.mean((blocks - np.median(heard)) ** 2, axis=1) + least)
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
    pulses = np.split(on, np.flatnonzero(np.diff(on) > 0.002 * rate) + 1)
    return [(int(one[0]), int(one[-1])) for one in pulses if level[one].max() > _OF_BOUNCE * top]
