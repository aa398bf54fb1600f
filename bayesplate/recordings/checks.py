"""What is wrong with a signal before anything is looked for in it: empty, silent, clipped, short, not finite."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault
from bayesplate.recordings.hits import LEAST_DURATION
from bayesplate.recordings.signals import FrequencyResponse, Recording

Floats = NDArray[np.float64]

_FLAT = 4
"""Samples in a row at the very top: a wave that is not cut off passes it with one."""
_SILENT = 1e-5
"""Of full scale: less than the last bit of 16."""
_FASTEST, _SLOWEST = 1e6, 200.0
_LARGEST, _SMALLEST = 1e100, 1e-100
"""Of numbers without a unit: what lies between them can be squared and divided."""


def signal_faults(one: Recording | FrequencyResponse) -> Iterator[Fault]:
    """Every fault of a recording or a frequency response, with its name."""
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
    yield from _channel_faults(one, one.response, one.name if one.force is None else f"{one.name} response")
    if one.force is not None:
        yield from _channel_faults(one, one.force, f"{one.name} force")


def _channel_faults(one: Recording, signal: Floats, name: str) -> Iterator[Fault]:
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
    if spread <= (_SILENT * one.full_scale if np.isfinite(one.full_scale) else _SMALLEST):
        yield Fault(name, "a sound", "silence", "is the right channel connected?")
    elif (count := clipped_samples(signal, one.full_scale)) > 0:
        got = f"{count} samples cut off at the largest value"
        yield Fault(name, "a signal that is not clipped", got, "turn the gain down, or hit more softly")


def clipped_samples(signal: Floats, full_scale: float) -> int:
    """How many samples stand in runs at the largest or the smallest value; 0 if it was passed as a wave does.

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
        runs = np.diff(np.flatnonzero(np.diff(np.concatenate([[0], at_top.view(np.int8), [0]]))))[::2]
        least = 2 if top > 0.9 * full_scale else _FLAT
        total += int(runs[runs >= least].sum())
    return total


def _is_beyond(values: NDArray[np.generic]) -> bool:
    return bool((np.abs(np.real(values)) > _LARGEST).any() or (np.abs(np.imag(values)) > _LARGEST).any())


def _first(values: NDArray[np.generic]) -> int:
    return int(np.flatnonzero(~np.isfinite(values))[0]) + 1
