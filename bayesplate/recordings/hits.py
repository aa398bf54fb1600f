"""Hits in a recording: found in the force where it was recorded, otherwise in the onsets of the sound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.onsets import decimated_sounds, find_onsets, soft_onsets
from bayesplate.recordings.signals import Recording, split_blocks

LEAST_DURATION = 0.25
"""s; a shorter decay does not resolve neighbouring modes of a board."""
LONGEST_DURATION = 4.0
"""s of a decay that are used: by then boards are silent."""
LEAST_FALL = 10.0
"""dB by which a decay must have fallen before the next hit."""
_HISS_LINES = 11
"""Neighbouring spectral lines whose median tells the hiss: a single line of hiss may be faint by chance."""
BOUNCE_TIME = 0.1
"""s after a hit within which another one is a bounce of the hammer."""
_AFTER_SOUND = 0.004
"""s after the onset of a tap until finger or knuckle have left the board."""
_GATE_BLOCK, _GATE_BLOCKS, _GATE_FALL, _GATE_SLOW = 0.01, 10, 3.0, 1.0
"""s of a block; blocks within which a noise gate shuts; powers of ten by which the sound then falls for good, and by
which it fell at most in as many blocks before."""
_ONSET_MARGIN = 0.03
"""s after a hit and before the next one in which a rise of the sound belongs to these hits."""
_PULSE_SHARE, _BOUNCE_SHARE = 0.05, 0.1
"""Share of the greatest force above which a sample belongs to a pulse, and above which a pulse is a hit."""
_AFTER_FORCE = 0.0005  # s after a pulse of force until the board rings freely


@dataclass(frozen=True)
class Hit:
    """One hit in a recording: samples of its onset, of the start of the free decay, and of its end."""

    onset: int
    start: int
    stop: int
    fault: str = ""
    """Why it cannot be used."""
    is_gated: bool = False
    """Whether a noise gate cuts the decay off before the next hit."""
    number: int = 1
    """Among all hits of its recording, from 1."""


def find_hits(recording: Recording) -> list[Hit]:
    """Every hit of a recording, in order; empty where there is none."""
    response, rate = recording.response, recording.rate
    if recording.force is not None:
        pulses, lag = _force_pulses(recording.force, rate), round(_AFTER_FORCE * rate)
    else:
        pulses, lag = [(onset, onset) for onset in find_onsets(response, rate)], round(_AFTER_SOUND * rate)
    ends = [*(begin for begin, _ in pulses[1:]), response.size][: len(pulses)]
    hits = []
    after_bounce = False
    for i, ((begin, end), stop) in enumerate(zip(pulses, ends, strict=True)):
        start = end + lag
        gated = _gate_sample(response[start:stop], rate)
        stop = stop if gated is None else start + gated
        is_last = i == len(pulses) - 1
        is_bounced = not is_last and stop - begin < BOUNCE_TIME * rate
        if is_bounced or after_bounce:
            fault = "a double hit: the hammer bounced"
        else:
            fault = _decay_fault(
                recording, begin, start, stop, "the end" * is_last if gated is None else "a noise gate"
            )
        hits.append(Hit(begin, start, stop, fault, gated is not None, i + 1))
        after_bounce = is_bounced
    return hits


def usable_hits(hits: Sequence[Hit]) -> list[Hit]:
    return [hit for hit in hits if not hit.fault]


def renewed_onsets(recording: Recording, hits: Sequence[Hit], duration: float) -> list[float]:
    """Times in s at which the sound rises again within `duration` after a hit, from the beginning of the recording."""
    rises = np.array(soft_onsets(recording.response, recording.rate)) / recording.rate
    times = []
    for hit in hits:
        first = hit.start / recording.rate + _ONSET_MARGIN
        last = min(hit.start / recording.rate + duration, hit.stop / recording.rate - _ONSET_MARGIN)
        times += [float(time) for time in rises[(rises > first) & (rises < last)]]
    return times


def _decay_fault(recording: Recording, onset: int, start: int, stop: int, end: str) -> str:
    """Why the decay after a hit cannot be used; `end` is what cuts it off, empty where that is the next hit."""
    length = (stop - start) / recording.rate
    if length < LEAST_DURATION:
        return f"only {max(length, 0.0):.2g} s until {end or 'the next hit'}"
    if not end and _decay_fall(recording.response, recording.rate, onset, start, stop) < LEAST_FALL:
        return f"the next hit came before it had fallen by {LEAST_FALL:g} dB"
    return ""


def _decay_fall(response: Floats, rate: float, onset: int, start: int, stop: int) -> float:
    """Fall of a decay in dB from its first tenth to its last, at the frequencies that the hit has raised.

    Hiss, hum, a steady tone and rumble were there before the hit, and do not fall: they are no part of the decay.
    """
    from scipy.ndimage import median_filter

    slow, slow_rate = decimated_sounds(response, rate)[-1]
    onset, start, stop = (round(sample * slow_rate / rate) for sample in (onset, start, stop))
    tenth = max((stop - start) // 10, 1)
    slices = (slice(max(onset - tenth, 0), onset), slice(start, start + tenth), slice(stop - tenth, stop))
    before, first, last = (_line_powers(slow[part], tenth) for part in slices)
    steady = np.maximum(before, median_filter(before, _HISS_LINES) / np.log(2.0))  # the mean of hiss by its median
    raised = first > 10.0 ** (LEAST_FALL / 10.0) * steady
    at_first, at_last = (max(float((part - steady)[raised].sum()), 1e-300) for part in (first, last))
    return 10.0 * float(np.log10(at_first / at_last))


def _line_powers(part: Floats, n: int) -> Floats:
    """Power of each spectral line of a part of a signal, of hiss as if it had n samples: (n // 2 + 1,) array."""
    if not part.size:
        return np.zeros(n // 2 + 1)
    change = np.diff(part, prepend=part[0])  # rumble hardly changes
    return np.asarray(np.abs(np.fft.rfft(np.hanning(part.size) * change, n)) ** 2 * (n / part.size))


def _gate_sample(decay: Floats, rate: float) -> int | None:
    """Sample at which a noise gate cuts a decay off: the sound falls suddenly, far and for good; None without one."""
    block = max(round(_GATE_BLOCK * rate), 1)
    blocks, steps = split_blocks(decay, block), np.abs(np.diff(decay))
    n = len(blocks)
    if n < 3 * _GATE_BLOCKS or not steps.any():
        return None
    least = max(float(steps[steps > 0.0].min()) ** 2, 1e-300)  # a decay that rounding takes to zero is not cut off
    level = np.log10(np.mean((blocks - np.median(decay)) ** 2, axis=1) + least)
    later_peak = np.maximum.accumulate(level[::-1])[::-1]  # the loudest from there on
    candidates = np.arange(_GATE_BLOCKS, n - 2 * _GATE_BLOCKS)
    falls = level[candidates] - later_peak[candidates + _GATE_BLOCKS] > _GATE_FALL
    is_sudden = (
        np.max([level[candidates - k] for k in range(1, _GATE_BLOCKS + 1)], axis=0) - level[candidates] < _GATE_SLOW
    )
    gates = candidates[falls & is_sudden]
    return int(gates[0] * block) if gates.size else None


def _force_pulses(force: Floats, rate: float) -> list[tuple[int, int]]:
    """First and last sample of every pulse of force."""
    level = np.abs(force - np.median(force))
    top = float(level.max())
    if top <= 0.0 or top < 8.0 * float(np.median(level)) + 1e-300:
        return []
    samples = np.flatnonzero(level > _PULSE_SHARE * top)
    pulses = np.split(samples, np.flatnonzero(np.diff(samples) > 0.002 * rate) + 1)
    return [(int(pulse[0]), int(pulse[-1])) for pulse in pulses if level[pulse].max() > _BOUNCE_SHARE * top]
