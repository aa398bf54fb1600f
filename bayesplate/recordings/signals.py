"""The signals of a file: a recording of a response, with or without the force, or a ready frequency response."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from bayesplate.arrays import Complex, Floats

Place = tuple[float, float]
"""m, from the corner of the edges x0 and y0."""

Motion = Literal["acceleration", "velocity", "displacement", "pressure"]
MOTIONS: tuple[Motion, ...] = get_args(Motion)


@dataclass(frozen=True, eq=False)
class Recording:
    """A response over time, (n_samples,) in any unit, and the force of the hammer where it was recorded."""

    name: str
    rate: float
    response: Floats
    force: Floats | None = None
    motion: Motion = "acceleration"
    full_scale: float = np.inf
    """Largest value that the file can hold."""
    hammer: Place | None = None
    sensor: Place | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """A response over a force, (n_lines,) complex, at evenly spaced frequencies in Hz."""

    name: str
    frequency: Floats
    values: Complex
    motion: Motion = "acceleration"
    hammer: Place | None = None
    sensor: Place | None = None
    remarks: tuple[str, ...] = ()


Signal = Recording | FrequencyResponse


def split_blocks(signal: Floats, length: int) -> Floats:
    """Consecutive blocks of a signal, (n_blocks, length), without the incomplete block at its end."""
    return signal[: signal.size // length * length].reshape(-1, length)
