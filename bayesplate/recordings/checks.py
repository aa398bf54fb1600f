"""What a signal is and what is wrong with it before modes are looked for: empty, silent, clipped, a pulse, a copy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.errors import Fault
from bayesplate.recordings.hits import LEAST_DURATION
from bayesplate.recordings.signals import FrequencyResponse, Read, Recording, in_blocks

SILENT = 1e-5
"""Of full scale: less than the last bit of 16."""
_FLAT = 4
"""Samples in a row at the very top that may be a wave that was cut off."""
_CUT = 4.0
"""Steps of the numbers that a wave would have gone on rising, had it not been cut off: rounding flattens it by one."""
_N_STEPS = 100
"""Largest values among which the step is looked for, and steps below which a recording is too quiet."""
_TOO_QUIET = 10.0 ** (-50.0 / 20.0)
"""Of full scale; a converter of 16 bits has the steps above left there, one of 24 bits many more."""
_AROUND, _RISE, _NOISE = 3, 1.5, 0.1
"""Samples about the blow that are left out; power in the last quarter of a response over that in the third, and over
that in the first, from which on it does not follow its force."""
_FINEST, _COARSEST = 0.02, 2.0
"""Hz between lines that show it."""
_FASTEST, _SLOWEST = 1e6, 200.0
_LARGEST, _SMALLEST = 1e100, 1e-100
"""Of numbers without a unit: what lies between them can be squared and divided."""
_ALIKE, _COPY = 0.95, 0.9999
"""Correlation from which on two channels are one sound: a pulse and what rings after it have hardly any; and from which
on they differ by rounding alone."""
_BLOCK = 0.005
_AFTER = 4, 24
"""Blocks after the loudest one, 20 to 120 ms, in which a hammer has left the board and the board still rings."""
_RINGS, _ABOVE_QUIET = 0.003, 10.0
"""Power there over that of the loudest block, and over the quiet of the channel, from which on it rings."""
_PULSE, _NEAR_QUIET = 1e4, 3.0
"""Power of the loudest block over that after it, and of that over the quiet, of a channel that does not ring."""
_GATE_BLOCK, _GATED = 0.01, 0.1
"""s of a block, and share of blocks without any sound that a noise gate leaves."""


def signal_faults(one: Read, *, was_played: bool = False) -> Iterator[Fault]:
    """Every fault of a recording or a frequency response; the level of what a loudspeaker was given is nobody's."""
    if isinstance(one, FrequencyResponse):
        if fault := _number_fault(one.name, one.values, "line"):
            yield fault
        elif not (np.abs(one.values) > _SMALLEST).any():
            yield Fault(one.name, "a response", "nothing but zeros")
        return
    if not _SLOWEST <= one.rate <= _FASTEST:
        wanted = f"{_SLOWEST:g} to {_FASTEST:g} samples a second"
        yield Fault(f"{one.name} rate", wanted, f"{one.rate:g}", "is it in Hz?")
    if one.force is None:
        yield from _channel_faults(one, one.response, one.name, was_played=was_played)
    else:
        yield from _channel_faults(one, one.response, f"{one.name} response", was_played=was_played)
        yield from _channel_faults(one, one.force, f"{one.name} force", was_played=was_played)


def phase_fault(one: FrequencyResponse) -> Fault | None:
    """What is wrong with a response that does not follow its force: over time it rises towards the blow.

    Magnitudes, decibels or degrees in the place of a real or imaginary part lie as much before the blow as after it,
    and a conjugated response wholly before.
    """
    got, remedy = "one that answers before it is hit", "export re and im: no magnitudes, no decibels, no degrees"
    fault = Fault(one.name, "a response with its phase", got, remedy)
    if not one.values.imag.any():
        return fault
    if not _FINEST <= one.frequency[1] - one.frequency[0] <= _COARSEST:
        return None
    over_time = np.abs(np.fft.ifft(one.values * np.hanning(one.values.size))) ** 2
    first, _, third, last = (part.sum() for part in np.array_split(over_time[_AROUND:-_AROUND], 4))
    return fault if last > max(_RISE * third, _NOISE * first) else None


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
    blocks = in_blocks(signal, max(round(_GATE_BLOCK * rate), 2))
    return bool(len(blocks) and np.mean(np.ptp(blocks, axis=1) == 0.0) > _GATED)


def clipped_samples(signal: Floats, full_scale: float) -> int:
    """How many samples stand in runs at the largest or the smallest value beyond which the wave would have gone.

    A parabola that stays above a height for a while falls, within the same while before and after, by eight times what
    it rises above that height. Where it rises by no more than the rounding, nothing was cut off. Beyond nine tenths of
    full scale two samples in a row are enough.
    """
    total = 0
    for side in (signal, -signal):
        top = float(side.max())
        if top <= 0.0:
            continue
        at_top = side >= top * (1.0 - 1e-9)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at_top.view(np.int8), [0]])))
        least = 2 if top > 0.9 * full_scale else _FLAT
        runs = [(first, stop) for first, stop in edges.reshape(-1, 2) if stop - first >= least]
        rises = 8.0 * _CUT * _step(side) if runs else 0.0
        total += sum(int(stop - first) for first, stop in runs if _fall_beside(side, first, stop) > rises)
    return total


def _channel_faults(one: Recording, signal: Floats, name: str, *, was_played: bool) -> Iterator[Fault]:
    if fault := _number_fault(name, signal, "sample"):
        yield fault
        return
    if signal.size < LEAST_DURATION * one.rate:
        yield Fault(name, f"{LEAST_DURATION:g} s or more", f"{signal.size / one.rate:.2g} s", "let the board ring out")
    if np.ptp(signal) <= (SILENT * one.full_scale if np.isfinite(one.full_scale) else _SMALLEST):
        yield Fault(name, "a sound", "silence", "is the right channel connected?")
    elif not was_played and (fault := _level_fault(one, signal, name)):
        yield fault


def _number_fault(name: str, values: NDArray[np.generic], each: str) -> Fault | None:
    """What is wrong with numbers as such: none, not finite, too large to be squared."""
    if not values.size:
        return Fault(name, f"{each}s", "none", "record it again")
    if not np.isfinite(values).all():
        return Fault(name, "finite numbers", f"{each} {int(np.argmin(np.isfinite(values))) + 1} is none")
    if max(np.abs(np.real(values)).max(), np.abs(np.imag(values)).max()) > _LARGEST:
        return Fault(name, f"numbers up to {_LARGEST:g}", "larger ones")
    return None


def _level_fault(one: Recording, signal: Floats, name: str) -> Fault | None:
    """Too loud for what records it, or so quiet that its numbers are mostly rounding."""
    height = float(np.ptp(signal)) / 2.0
    is_quiet = np.isfinite(one.full_scale) and height < _TOO_QUIET * one.full_scale
    if is_quiet and height < _N_STEPS * _step(signal):
        got = f"{20.0 * np.log10(height / one.full_scale):.0f} dB of what the file can hold"
        remedy = "too quiet: turn the gain up, or go closer"
        return Fault(name, "a signal that is more than rounding", got, remedy)
    if (count := clipped_samples(signal, one.full_scale)) > 0:
        got = f"{count} samples cut off at the largest value"
        return Fault(name, "a signal that is not clipped", got, "turn the gain down, or hit more softly")
    return None


def _fall_beside(side: Floats, first: int, stop: int) -> float:
    """The smaller fall of a wave before and after a run at its top, within as many samples."""
    length = stop - first
    beside = [part for part in (side[max(first - length, 0) : first], side[stop : stop + length]) if part.size]
    return min((float(side[first] - part.min()) for part in beside), default=0.0)


def _step(signal: Floats) -> float:
    """The smallest difference among the largest values: what one bit, or one digit, is worth there."""
    values = np.unique(signal)[-_N_STEPS:]
    return float(np.diff(values).min()) if values.size > 1 else 0.0


def _correlation(one: Floats, other: Floats) -> float:
    """Share of their common power, 0 to 1; 0 where one does not move."""
    one, other = one - one.mean(), other - other.mean()
    power = float(one @ one) * float(other @ other)
    return abs(float(one @ other)) / np.sqrt(power) if power > 0.0 else 0.0


def _powers(signal: Floats, rate: float) -> tuple[float, float, float]:
    """Power of the loudest block, the median after it, and that of the quiet; all 0 where nothing comes after."""
    blocks = in_blocks(signal, max(round(_BLOCK * rate), 1))
    if len(blocks) <= _AFTER[1]:
        return 0.0, 0.0, 0.0
    power = np.mean((blocks - np.median(signal)) ** 2, axis=1)
    loudest = int(np.argmax(power[: -_AFTER[1]]))
    after = power[loudest + _AFTER[0] : loudest + _AFTER[1]]
    return float(power[loudest]), float(np.median(after)), float(np.quantile(power, 0.1))
