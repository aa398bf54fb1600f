"""Checks of a signal before modes are searched: empty, silent, clipped, a pulse, a copy."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.errors import Fault
from bayesplate.recordings.hits import LEAST_DURATION
from bayesplate.recordings.signals import FrequencyResponse, Recording, Signal, split_blocks

SILENT_LEVEL = 1e-5
"""Share of full scale below which a signal is silent: less than the last bit of 16."""
_FLAT_RUN = 4
"""Samples in a row at the largest value from which on a wave may be clipped."""
_CUT_STEPS = 4.0
"""Quantisation steps by which a wave would have risen further, had it not been clipped: rounding flattens it by one."""
_N_STEPS = 100
"""Number of the largest values from which the quantisation step is taken, and steps below which a recording is too
quiet."""
_QUIET_LEVEL = 10.0 ** (-50.0 / 20.0)
"""Share of full scale, at which a converter of 16 bits has about so many steps left, one of 24 bits many more."""
_BLOW_SAMPLES, _RISE, _NOISE = 3, 1.5, 0.1
"""Samples about the hit that are left out; power in the last quarter of a response over that in the third, and over
that in the first, from which on it does not follow its force."""
_FINEST, _COARSEST = 0.02, 2.0
"""Spacings of lines in Hz between which this is checked."""
_HIGHEST_RATE, _LOWEST_RATE = 1e6, 200.0
_LARGEST, _SMALLEST = 1e100, 1e-100
"""Range of numbers that can be squared and divided."""
_ALIKE_CORRELATION, _COPY_CORRELATION = 0.95, 0.9999
"""Correlation from which on two channels are one sound (a pulse and its response have hardly any), and from which on
they differ by rounding alone."""
_BLOCK = 0.005
_AFTER_BLOCKS = 4, 24
"""Blocks after the loudest one, 20 to 120 ms: the hammer has left the board, which still rings."""
_RINGING_SHARE, _ABOVE_QUIET = 0.003, 10.0
"""Power in these blocks over that of the loudest one, and over the quiet of the channel, from which on it rings."""
_PULSE_RATIO, _NEAR_QUIET = 1e4, 3.0
"""Power of the loudest block over these blocks, and of these over the quiet, in a channel that does not ring."""
_GATE_BLOCK, _GATED_SHARE = 0.01, 0.1
"""s of a block, and share of blocks without any sound that a noise gate leaves."""


def signal_faults(signal: Signal, *, was_played: bool = False) -> Iterator[Fault]:
    """All faults of a recording or a frequency response; the level of a loudspeaker's signal is no fault."""
    if isinstance(signal, FrequencyResponse):
        if fault := _number_fault(signal.name, signal.values, "line"):
            yield fault
        elif not (np.abs(signal.values) > _SMALLEST).any():
            yield Fault(signal.name, "a response", "nothing but zeros")
        return
    if not _LOWEST_RATE <= signal.rate <= _HIGHEST_RATE:
        wanted = f"{_LOWEST_RATE:g} to {_HIGHEST_RATE:g} samples a second"
        yield Fault(f"{signal.name} rate", wanted, f"{signal.rate:g}", "is it in Hz, or are the times in s?")
    if signal.force is None:
        yield from _channel_faults(signal, signal.response, signal.name, was_played=was_played)
    else:
        yield from _channel_faults(signal, signal.response, f"{signal.name} response", was_played=was_played)
        yield from _channel_faults(signal, signal.force, f"{signal.name} force", was_played=was_played)


def phase_fault(response: FrequencyResponse) -> Fault | None:
    """The fault of a response that does not follow its force: over time it rises towards the hit.

    Magnitudes, decibels or degrees in the place of a real or imaginary part lie as much before the hit as after it,
    and a conjugated response lies wholly before.
    """
    got, remedy = "one that answers before it is hit", "export re and im: no magnitudes, no decibels, no degrees"
    fault = Fault(response.name, "a response with its phase", got, remedy)
    if not response.values.imag.any():
        return fault
    if not _FINEST <= response.frequency[1] - response.frequency[0] <= _COARSEST:
        return None
    over_time = np.abs(np.fft.ifft(response.values * np.hanning(response.values.size))) ** 2
    first, _, third, last = (part.sum() for part in np.array_split(over_time[_BLOW_SAMPLES:-_BLOW_SAMPLES], 4))
    return fault if last > max(_RISE * third, _NOISE * first) else None


def force_fault(recording: Recording) -> Fault | None:
    """The fault of a force channel that holds no force; None where it holds one, or where none was recorded."""
    if recording.force is None:
        return None
    if _correlation(recording.force, recording.response) > _ALIKE_CORRELATION:
        got = "nearly the same as the response"
    elif rings(recording.force, recording.rate):
        got = "one that rings on after it"
    else:
        return None
    remedy = "--channels response,force where they are exchanged, response,response for a stereo microphone"
    return Fault(f"{recording.name} force", "a channel with a pulse for each hit", got, remedy)


def is_copy(first: Floats, second: Floats) -> bool:
    """Whether two channels are the same up to a factor and rounding."""
    return _correlation(first, second) > _COPY_CORRELATION


def rings(signal: Floats, rate: float) -> bool:
    """Whether there is still power after the loudest moment, in most blocks: the pulse of a bounce is in one or two."""
    loudest, after, quiet = _block_powers(signal, rate)
    return after > max(_RINGING_SHARE * loudest, _ABOVE_QUIET * quiet)


def is_pulse(signal: Floats, rate: float) -> bool:
    """Whether a channel is silent as soon as its loudest moment is over: a hammer's force, not a board."""
    loudest, after, quiet = _block_powers(signal, rate)
    return loudest > _PULSE_RATIO * after and after <= _NEAR_QUIET * quiet


def is_cut_to_silence(signal: Floats, rate: float) -> bool:
    """Whether a noise gate was used: much of a recording holds one and the same number."""
    blocks = split_blocks(signal, max(round(_GATE_BLOCK * rate), 2))
    return bool(len(blocks) and np.mean(np.ptp(blocks, axis=1) == 0.0) > _GATED_SHARE)


def clipped_samples(signal: Floats, full_scale: float) -> int:
    """Number of samples in runs at the largest or the smallest value beyond which the wave would have gone.

    A parabola that stays above a height for some time falls, within the same time before and after, by eight times its
    rise above that height. Where it rises by no more than the rounding, nothing was clipped. Beyond nine tenths of full
    scale two samples in a row are enough.
    """
    total = 0
    for side in (signal, -signal):
        top = float(side.max())
        if top <= 0.0:
            continue
        at_top = side >= top * (1.0 - 1e-9)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at_top.view(np.int8), [0]])))
        least = 2 if top > 0.9 * full_scale else _FLAT_RUN
        runs = [(first, stop) for first, stop in edges.reshape(-1, 2) if stop - first >= least]
        rises = 8.0 * _CUT_STEPS * _number_step(side) if runs else 0.0
        total += sum(int(stop - first) for first, stop in runs if _fall_beside(side, first, stop) > rises)
    return total


def _channel_faults(recording: Recording, signal: Floats, name: str, *, was_played: bool) -> Iterator[Fault]:
    if fault := _number_fault(name, signal, "sample"):
        yield fault
        return
    if signal.size < LEAST_DURATION * recording.rate:
        yield Fault(
            name, f"{LEAST_DURATION:g} s or more", f"{signal.size / recording.rate:.2g} s", "let the board ring out"
        )
    if np.ptp(signal) <= (SILENT_LEVEL * recording.full_scale if np.isfinite(recording.full_scale) else _SMALLEST):
        yield Fault(name, "a sound", "silence", "is the right channel connected?")
    elif not was_played and (fault := _level_fault(recording, signal, name)):
        yield fault


def _number_fault(name: str, values: NDArray[np.generic], item: str) -> Fault | None:
    """The fault of numbers as such: none, not finite, too large to be squared."""
    if not values.size:
        return Fault(name, f"{item}s", "none", "record it again")
    if not np.isfinite(values).all():
        return Fault(name, "finite numbers", f"{item} {int(np.argmin(np.isfinite(values))) + 1} is none")
    if max(np.abs(np.real(values)).max(), np.abs(np.imag(values)).max()) > _LARGEST:
        return Fault(name, f"numbers up to {_LARGEST:g}", "larger ones")
    return None


def _level_fault(recording: Recording, signal: Floats, name: str) -> Fault | None:
    """The fault of a signal that is clipped, or so quiet that its numbers are mostly rounding."""
    height = float(np.ptp(signal)) / 2.0
    is_quiet = np.isfinite(recording.full_scale) and height < _QUIET_LEVEL * recording.full_scale
    if is_quiet and height < _N_STEPS * _number_step(signal):
        got = f"{20.0 * np.log10(height / recording.full_scale):.0f} dB of what the file can hold"
        remedy = "too quiet: turn the gain up"
        return Fault(name, "a signal that is more than rounding", got, remedy)
    if (count := clipped_samples(signal, recording.full_scale)) > 0:
        got = f"{count} samples cut off at the largest value"
        return Fault(name, "a signal that is not clipped", got, "turn the gain down, or hit more softly")
    return None


def _fall_beside(side: Floats, first: int, stop: int) -> float:
    """The smaller fall of a wave before and after a run at its top, within as many samples."""
    length = stop - first
    neighbours = [part for part in (side[max(first - length, 0) : first], side[stop : stop + length]) if part.size]
    return min((float(side[first] - part.min()) for part in neighbours), default=0.0)


def _number_step(signal: Floats) -> float:
    """The quantisation step: the smallest difference among the largest values."""
    values = np.unique(signal)[-_N_STEPS:]
    return float(np.diff(values).min()) if values.size > 1 else 0.0


def _correlation(first: Floats, second: Floats) -> float:
    """Size of the correlation of two signals, 0 to 1; 0 where one is constant."""
    first, second = first - first.mean(), second - second.mean()
    power = float(first @ first) * float(second @ second)
    return abs(float(first @ second)) / np.sqrt(power) if power > 0.0 else 0.0


def _block_powers(signal: Floats, rate: float) -> tuple[float, float, float]:
    """Power of the loudest block, median power after it, and power of the quiet; all 0 where the signal ends there."""
    blocks = split_blocks(signal, max(round(_BLOCK * rate), 1))
    if len(blocks) <= _AFTER_BLOCKS[1]:
        return 0.0, 0.0, 0.0
    power = np.mean((blocks - np.median(signal)) ** 2, axis=1)
    loudest = int(np.argmax(power[: -_AFTER_BLOCKS[1]]))
    after = power[loudest + _AFTER_BLOCKS[0] : loudest + _AFTER_BLOCKS[1]]
    return float(power[loudest]), float(np.median(after)), float(np.quantile(power, 0.1))
