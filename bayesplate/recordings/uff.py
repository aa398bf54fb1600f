"""Data sets 58 of a UFF file to recordings and frequency responses, in the units and of the kinds that they state."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import FrequencyResponse, Motion, Read, Recording
from bayesplate.recordings.tables import rate_of

_TIME, _RESPONSE = 1, 4
"""Kinds of function: a time response, a frequency response."""
_UNKNOWN, _FORCES = (0, 1), (9, 13)
_MOTIONS: dict[int, Motion] = {8: "displacement", 11: "velocity", 12: "acceleration", 15: "pressure"}
"""Kinds of data of an ordinate."""
_UNITS: dict[str, Motion | None] = {
    "n": None, "lbf": None, "m/s2": "acceleration", "m/s^2": "acceleration", "m/s": "velocity", "mm/s": "velocity",
    "m": "displacement", "mm": "displacement", "pa": "pressure",
}  # fmt: skip
"""What they tell of an ordinate of unknown kind; None is a force."""
_AXES = {
    _TIME: ({"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "": 1.0, "none": 1.0}, 17),
    _RESPONSE: ({"hz": 1.0, "khz": 1e3, "rad/s": 0.5 / np.pi, "rad/sec": 0.5 / np.pi, "": 1.0, "none": 1.0}, 18),
}
"""Units of an abscissa in s or Hz, and its kind of data."""


def read_uff(path: Path, shown: str, rate: float | None, channels: str, motion: Motion) -> list[Read]:
    """Time and frequency responses among the data sets 58 and 58b of a UFF file; parameters as of `read_recordings`."""
    try:
        import pyuff
    except ImportError:
        remedy = 'pip install "bayesplate[recordings]", or WAV'
        raise InputError(Fault(shown, "pyuff installed, which reads UFF", "none", remedy)) from None
    sets = []
    try:
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        # one by one: the library reads no file that holds a set unknown to it
        sets = [file.read_sets(number) for number, kind in enumerate(kinds) if kind == 58]
        found = [*_of_sets(sets, shown, motion)]
    except InputError:
        raise
    except Exception as error:  # the library stumbles over broken files in many ways
        wanted = "whole data sets 58" if sets else "a UFF file"
        raise InputError(Fault(shown, wanted, f"a broken one ({type(error).__name__})")) from None
    if not found:
        got = f"{len(kinds)} others" if kinds else "no set that is whole (was it cut off?)"
        raise InputError(Fault(shown, "data sets 58 or 58b with a time or a frequency response", got))
    return found


def _of_sets(sets: list[dict[str, Any]], shown: str, motion: Motion) -> Iterator[Read]:
    """What data sets hold; a force, which is a set of its own, belongs to the responses that follow it."""
    force = None
    for number, one in enumerate(sets, start=1):
        name, kind = f"{shown} set {number}", int(one.get("func_type", 0))
        if kind not in _AXES:
            continue
        values, at = np.asarray(one["data"]), np.asarray(one["x"], dtype=float)
        if values.ndim != 1 or not values.size == at.size >= int(one.get("num_pts") or 0):
            raise ValueError("fewer numbers than stated")
        at = at * _unit(one, kind, name)
        own = _kind(one, "ordinate", name, motion)
        if kind == _RESPONSE:
            yield _response(FrequencyResponse(name, at, values.astype(complex)), own, one, motion)
        elif own is None:
            force = np.real(values).astype(float)
        else:
            if force is not None and force.size != at.size:
                raise ValueError("a force of another length")
            yield Recording(name, rate_of(at, name), np.real(values).astype(float), force, own)


def _unit(one: dict[str, Any], kind: int, name: str) -> float:
    unit, data = str(one.get("abscissa_axis_units_lab") or "").strip(), int(one.get("abscissa_spec_data_type") or 0)
    known, of = _AXES[kind]
    if data not in (*_UNKNOWN, of) or unit.lower() not in known:
        wanted = f"an abscissa in {', '.join(key for key in known if key not in ('', 'none'))}"
        raise InputError(Fault(name, wanted, f'"{unit}" (kind of data {data})', "export it in s or Hz"))
    return known[unit.lower()]


def _kind(one: dict[str, Any], axis: str, name: str, motion: Motion) -> Motion | None:
    """What an ordinate is: a motion, None for a force; `motion` where the header says neither kind nor unit."""
    data = int(one.get(f"{axis}_spec_data_type") or 0)
    unit = str(one.get(f"{axis}_axis_units_lab") or "").strip().lower()
    if data in _FORCES:
        return None
    if data in _UNKNOWN:
        return _UNITS.get(unit, motion)
    if data not in _MOTIONS:
        wanted = f"a force or {', '.join(_MOTIONS.values())}"
        raise InputError(Fault(name, wanted, f"kind of data {data}, {unit or '?'}"))
    return _MOTIONS[data]


def _response(
    one: FrequencyResponse, numerator: Motion | None, header: dict[str, Any], motion: Motion
) -> FrequencyResponse:
    """A frequency response as its header says: of a motion over a force, or turned over."""
    data = int(header.get("orddenom_spec_data_type") or 0)
    below = None if data in _UNKNOWN and numerator is not None else _kind(header, "orddenom", one.name, motion)
    if numerator is not None and below is None:
        return replace(one, motion=numerator)
    if numerator is None and below is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.where(one.values == 0.0, 0.0, 1.0 / one.values)
        return replace(one, values=values, motion=below, remarks=(f"{one.name}: a force over {below}, turned over",))
    got = "a force over a force" if below is None else f"{numerator} over {below}"
    raise InputError(Fault(one.name, "a motion over a force", got, "export the response over the force"))
