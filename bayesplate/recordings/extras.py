"""FLAC and UFF files to recordings, by libraries that come with the extra `bayesplate[recordings]`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import FrequencyResponse, Motion, Recording
from bayesplate.recordings.wav import from_channels

_TIME, _RESPONSE, _FORCE = 1, 4, -1
"""Kinds of function of a UFF data set 58: a time response, a frequency response; a force has no number of its own."""
_MOTIONS: dict[int, Motion] = {8: "displacement", 11: "velocity", 12: "acceleration", 15: "pressure"}
"""Kinds of data of its ordinate."""
_EXCITATION = 13


def read_flac(
    path: Path, shown: str, rate: float | None, channels: str, motion: Motion
) -> list[Recording | FrequencyResponse]:
    """The recordings of a FLAC file; parameters as of `read_recordings`."""
    try:
        import soundfile
    except ImportError:
        raise InputError(_lacking(shown, "FLAC", "soundfile")) from None
    try:
        samples, own_rate = soundfile.read(path, dtype="int32", always_2d=False)
    except (RuntimeError, OSError) as error:
        raise InputError(Fault(shown, "a FLAC file", str(error)[:120])) from None
    return from_channels(samples, float(own_rate), shown, rate, channels, motion)


def read_uff(
    path: Path, shown: str, rate: float | None, channels: str, motion: Motion
) -> list[Recording | FrequencyResponse]:
    """Time and frequency responses among the data sets 58 and 58b of a UFF file; parameters as of `read_recordings`.

    A force, which is a data set of its own, belongs to the responses that follow it.
    """
    try:
        import pyuff
    except ImportError:
        raise InputError(_lacking(shown, "UFF", "pyuff")) from None
    try:
        every = pyuff.UFF(str(path)).read_sets()
    except Exception as error:  # the library stumbles over broken files in many ways
        raise InputError(Fault(shown, "a UFF file", f"a broken one ({type(error).__name__})")) from None
    sets = [one for one in (every if isinstance(every, list) else [every]) if one.get("type") == 58]
    found: list[Recording | FrequencyResponse] = []
    force: dict[str, Any] | None = None
    for number, one in enumerate(sets, start=1):
        name = f"{shown} set {number}"
        try:
            kind = _kind_of(one)
            if kind == _FORCE:
                force = one
            elif kind:
                found.append(_of_set(one, kind, name, force, motion))
        except (KeyError, IndexError, TypeError, ValueError, ZeroDivisionError) as error:
            raise InputError(Fault(name, "a whole data set 58", f"a broken one ({type(error).__name__})")) from None
    if not found:
        raise InputError(Fault(shown, "data sets 58 or 58b with a time or a frequency response", f"{len(sets)} others"))
    return found


def _kind_of(one: dict[str, Any]) -> int:
    """What a data set 58 holds: one of the kinds above, 0 for any other."""
    kind = int(one.get("func_type", 0))
    if kind == _TIME and int(one.get("ordinate_spec_data_type", 0)) == _EXCITATION:
        return _FORCE
    return kind if kind in (_TIME, _RESPONSE) else 0


def _of_set(
    one: dict[str, Any], kind: int, name: str, force: dict[str, Any] | None, motion: Motion
) -> Recording | FrequencyResponse:
    """The recording or the frequency response of a data set; any error of its numbers where it is broken."""
    told = _MOTIONS.get(int(one.get("ordinate_spec_data_type", 0)), motion)
    values, at = np.asarray(one["data"]), np.asarray(one["x"], dtype=float)
    own = None if force is None else np.real(np.asarray(force["data"])).astype(float)
    if values.shape != at.shape or values.ndim != 1 or (own is not None and own.shape != at.shape):
        raise ValueError("numbers and their places are not as many")
    rises = at.size > 1 and np.isfinite(at).all() and bool((np.diff(at) > 0).all())
    if not rises:
        raise ValueError("times or frequencies that do not rise")
    if kind == _RESPONSE:
        return FrequencyResponse(name, at, values.astype(complex), None, told)
    return Recording(name, 1.0 / float(at[1] - at[0]), np.real(values).astype(float), own, told)


def _lacking(shown: str, kind: str, library: str) -> Fault:
    return Fault(
        shown, f"{library} installed, which reads {kind}", "none", 'pip install "bayesplate[recordings]", or WAV'
    )
