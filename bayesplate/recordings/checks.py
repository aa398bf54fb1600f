"""What is wrong with a signal before anything is looked for in it: empty, silent, clipped, short, not finite."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault
from bayesplate.recordings.channels import SILENT
from bayesplate.recordings.hits import LEAST_DURATION
from bayesplate.recordings.signals import FrequencyResponse, Recording

Floats = NDArray[np.float64]

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


def signal_faults(one: Recording | FrequencyResponse, *, was_played: bool = False) -> Iterator[Fault]:
    """Every fault of a recording or a frequency response, with its name; the level of what was played is nobody's."""
    if isinstance(one, FrequencyResponse):
        if not np.isfinite(one.values).all():
            yield Fault(one.name, "finite numbers", f"line {_first(one.values)} is none")
        elif _is_beyond(one.values):
            yield Fault(one.name, f"numbers up to {_LARGEST:g}", "larger ones")
        elif not (np.abs(one.values) > _SMALLEST).any():
            yield Fault(one.name, "a response", "nothing but zeros")
        return
    if not _SLOWEST <= one.rate <= _FASTEST:
        yield Fault(
            f"{one.name} rate", f"{_SLOWEST:g} to {_FASTEST:g} samples a second", f"{one.rate:g}", "is it in Hz?"
        )
    channels = {one.name if one.force is None else f"{one.name} response": one.response}
    if one.force is not None:
        channels[f"{one.name} force"] = one.force
    for name, signal in channels.items():
        yield from _channel_faults(one, signal, name, was_played=was_played)


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


def _channel_faults(one: Recording, signal: Floats, name: str, *, was_played: bool) -> Iterator[Fault]:
    if signal.size == 0:
        yield Fault(name, "samples", "none", "record it again")
        return
    if not np.isfinite(signal).all():
        yield Fault(name, "finite numbers", f"sample {_first(signal)} is none")
        return
    if _is_beyond(signal):
        yield Fault(name, f"numbers up to {_LARGEST:g}", "larger ones")
        return
    if signal.size < LEAST_DURATION * one.rate:
        yield Fault(name, f"{LEAST_DURATION:g} s or more", f"{signal.size / one.rate:.2g} s", "let the board ring out")
    spread = float(np.ptp(signal))
    if spread <= (SILENT * one.full_scale if np.isfinite(one.full_scale) else _SMALLEST):
        yield Fault(name, "a sound", "silence", "is the right channel connected?")
    elif not was_played:
        yield from _level_faults(one, signal, name)


def _level_faults(one: Recording, signal: Floats, name: str) -> Iterator[Fault]:
    """Too loud for what records it, or so quiet that its numbers are mostly rounding."""
    height = float(np.ptp(signal)) / 2.0
    is_quiet = np.isfinite(one.full_scale) and height < _TOO_QUIET * one.full_scale
    if is_quiet and height < _N_STEPS * _step(signal):
        got = f"{20.0 * np.log10(height / one.full_scale):.0f} dB of what the file can hold"
        yield Fault(name, "a signal that is more than rounding", got, "too quiet: turn the gain up, or go closer")
    elif (count := clipped_samples(signal, one.full_scale)) > 0:
        got = f"{count} samples cut off at the largest value"
        yield Fault(name, "a signal that is not clipped", got, "turn the gain down, or hit more softly")


def clipped_samples(signal: Floats, full_scale: float) -> int:
    """How many samples stand in runs at the largest or the smallest value beyond which the wave would have gone.

    A parabola that stays above a height for a while falls, within the same while before and after, by eight times what
    it rises above that height. Where it rises by no more than the rounding, nothing was cut off.

    Parameters
    ----------
    signal : (n,) array
    full_scale : float
        Beyond nine tenths of it, where it is known, two samples in a row are enough.
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
        if runs:
            rises = 8.0 * _CUT * _step(side)
            total += sum(int(stop - first) for first, stop in runs if _fall_beside(side, first, stop) > rises)
    return total


def _fall_beside(side: Floats, first: int, stop: int) -> float:
    """By how much a wave falls before and after a run at its top, within as many samples: the smaller of the two."""
    length = stop - first
    beside = [part for part in (side[max(first - length, 0) : first], side[stop : stop + length]) if part.size]
    return min((float(side[first] - part.min()) for part in beside), default=0.0)


def _step(signal: Floats) -> float:
    """The smallest difference among the largest values: what one bit, or one digit, is worth there."""
    values = np.unique(signal)[-_N_STEPS:]
    return float(np.diff(values).min()) if values.size > 1 else 0.0


def _is_beyond(values: NDArray[np.generic]) -> bool:
    return bool((np.abs(np.real(values)) > _LARGEST).any() or (np.abs(np.imag(values)) > _LARGEST).any())


def _first(values: NDArray[np.generic]) -> int:
    return int(np.flatnonzero(~np.isfinite(values))[0]) + 1
