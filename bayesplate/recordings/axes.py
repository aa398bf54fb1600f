"""Axes of tables and data sets: the rate of evenly spaced times, and lines of a spectrum."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault, InputError

Floats = NDArray[np.float64]

_JITTER = 1e-3
"""Share of a step by which the times of samples may be unevenly spaced."""
_GAP = 1.75
"""Steps between two times at which a sample is missing; times are rounded, so two steps may look like less."""
_COARSEST = 6.0
"""Steps to which times may be rounded, so that several of them are the same."""
_LATEST = 1e12
"""s, Hz."""
_FEWEST_LINES = 100
_UNEVEN = 2e-2
"""Of the spacing of lines."""


def rate_of(times: Floats, shown: str, rate: float | None = None) -> float:
    """Samples a second of evenly spaced times in s, rounded to some digits; `rate` must agree where it was given."""
    steps = np.diff(np.where(np.abs(times) < _LATEST, times, np.nan))
    if times.size < 2 or not (steps >= 0.0).all() or times[-1] <= times[0]:
        raise InputError(Fault(f"{shown} time", "times in s that rise", "times that do not"))
    step = float((times[-1] - times[0]) / (times.size - 1))
    rounding = float(steps[steps > 0.0].min()) if (steps == 0.0).any() else 0.0
    away = np.abs(times - times[0] - step * np.arange(times.size)).max()
    off = max(_JITTER * step, 1e-6 * float(np.abs(times).max()), rounding)
    if away > off + step or steps.max() > max(_GAP * step, 1.01 * rounding) or rounding > _COARSEST * step:
        raise InputError(Fault(f"{shown} time", "evenly spaced samples", "uneven ones", "record without gaps"))
    own = 1.0 / step
    if rate is not None and abs(rate / own - 1.0) > _JITTER:
        raise InputError(Fault(f"{shown} rate", f"{rate:g} Hz, as --rate says", f"{own:.6g} Hz", "leave --rate out"))
    return rate or float(f"{own:.7g}")


def require_lines(hertz: Floats, shown: str) -> None:
    """Refuse frequencies that are no evenly spaced lines."""
    steps = np.diff(np.where(np.abs(hertz) < _LATEST, hertz, -1.0))
    is_even = hertz.size >= _FEWEST_LINES and hertz[0] >= 0 and (steps > 0).all()
    if not is_even or np.ptp(steps) > _UNEVEN * float(np.mean(steps)):
        wanted = "a hundred evenly spaced lines or more, rising"
        raise InputError(Fault(f"{shown} f_hz", wanted, f"{hertz.size} others"))
