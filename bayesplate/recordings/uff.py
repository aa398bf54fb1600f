"""Data sets 58 of a UFF file to recordings and frequency responses, in the units and of the kinds that they state."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import FrequencyResponse, Motion, Recording, Signal
from bayesplate.recordings.tables import require_lines, sampling_rate

_TIME, _RESPONSE = 1, 4
"""Kinds of function: a time response, a frequency response."""
_UNKNOWN_KINDS, _FORCE_KINDS = (0, 1), (9, 13)
_MOTIONS: dict[int, Motion] = {8: "displacement", 11: "velocity", 12: "acceleration", 15: "pressure"}
"""Kinds of data of an ordinate."""
_UNITS: dict[str, Motion | None] = {
    "n": None, "kn": None, "lbf": None,
    "m/s2": "acceleration", "m/s^2": "acceleration", "mm/s2": "acceleration", "mm/s^2": "acceleration",
    "in/s2": "acceleration", "in/s^2": "acceleration", "g": "acceleration",
    "m/s": "velocity", "mm/s": "velocity", "in/s": "velocity",
    "m": "displacement", "mm": "displacement", "um": "displacement", "in": "displacement", "pa": "pressure",
}  # fmt: skip
"""The quantity of an ordinate of unknown kind, by its unit; None is a force."""
_OVER_FORCE = re.compile(r"/\(?(n|kn|lbf)\)?$")
"""The end of the unit of a frequency response, which some headers state with its force."""
_UNITS_OF_ANYTHING = ("", "none", "v", "mv")
"""Units of an ordinate that tell no quantity."""
_AXES = {
    _TIME: ({"s": 1.0, "sec": 1.0, "second": 1.0, "seconds": 1.0, "ms": 1e-3, "": 1.0, "none": 1.0}, 17),
    _RESPONSE: ({"hz": 1.0, "khz": 1e3, "rad/s": 0.5 / np.pi, "rad/sec": 0.5 / np.pi, "": 1.0, "none": 1.0}, 18),
}
"""By kind of function: factors from the units of the abscissa to s or Hz, and the kind of data of the abscissa."""


def read_uff(path: Path, file_name: str, rate: float | None, channels: str, motion: Motion) -> list[Signal]:
    """Time and frequency responses among the data sets 58 and 58b of a UFF file; parameters as of `read_recordings`."""
    try:
        import pyuff
    except ImportError:
        remedy = 'pip install "bayesplate[recordings]", or WAV'
        raise InputError(Fault(file_name, "pyuff installed, which reads UFF", "none", remedy)) from None
    sets = []
    try:
        file = pyuff.UFF(str(path))
        kinds = [int(kind) for kind in file.get_set_types()]
        # one by one: the library reads no file that holds a set unknown to it
        sets = [file.read_sets(number) for number, kind in enumerate(kinds) if kind == 58]
        signals = _read_sets(sets, file_name, rate, motion)
    except InputError:
        raise
    except Exception as error:  # the library stumbles over broken files in many ways
        wanted = "whole data sets 58" if sets else "a UFF file"
        raise InputError(Fault(file_name, wanted, f"a broken one ({type(error).__name__})")) from None
    if not signals:
        got = f"{len(kinds)} others" if kinds else "no set that is whole (was it cut off?)"
        raise InputError(Fault(file_name, "data sets 58 or 58b with a time or a frequency response", got))
    return signals


def _read_sets(sets: list[dict[str, Any]], file_name: str, rate: float | None, motion: Motion) -> list[Signal]:
    """The signals of data sets.

    A force is a set of its own. It belongs to the responses that follow it, or to those that it follows where the first
    set is a response; a file's only force belongs to all of its responses.
    """
    signals: list[Signal | Floats] = []  # an array is a force
    for number, data_set in enumerate(sets, start=1):
        name, kind = f"{file_name} set {number}", int(data_set.get("func_type", 0))
        if kind not in _AXES:
            continue
        values, abscissa = np.asarray(data_set["data"]), np.asarray(data_set["x"], dtype=float)
        if values.ndim != 1 or not values.size == abscissa.size >= int(data_set.get("num_pts") or 0):
            raise ValueError("fewer numbers than stated")
        abscissa = abscissa * _axis_factor(data_set, kind, name)
        ordinate = _ordinate_kind(data_set, "ordinate", name, motion)
        if kind == _RESPONSE:
            require_lines(abscissa, f"{name} frequencies")
            response = FrequencyResponse(name, abscissa, values.astype(complex))
            signals.append(_response_over_force(response, ordinate, data_set, motion))
        elif ordinate is None:
            signals.append(np.real(values).astype(float))
        else:
            own_rate = sampling_rate(abscissa, name, rate)
            signals.append(Recording(name, own_rate, np.real(values).astype(float), None, ordinate))
    return _with_forces(signals)


def _with_forces(signals: list[Signal | Floats]) -> list[Signal]:
    """Signals of a file, the recordings with the forces among them."""
    forces = [signal for signal in signals if isinstance(signal, np.ndarray)]
    comes_after = len(forces) > 1 and isinstance(signals[0], Recording)
    force = forces[0] if len(forces) == 1 else None
    with_forces: list[Signal] = []
    for signal in reversed(signals) if comes_after else signals:
        if isinstance(signal, np.ndarray):
            force = signal
        elif isinstance(signal, FrequencyResponse):
            with_forces.append(signal)
        else:
            if force is not None and force.size != signal.response.size:
                raise ValueError("a force of another length")
            with_forces.append(replace(signal, force=force))
    return with_forces[::-1] if comes_after else with_forces


def _axis_factor(data_set: dict[str, Any], kind: int, name: str) -> float:
    unit, data_kind = (
        str(data_set.get("abscissa_axis_units_lab") or "").strip(),
        int(data_set.get("abscissa_spec_data_type") or 0),
    )
    factors, axis_kind = _AXES[kind]
    if data_kind not in (*_UNKNOWN_KINDS, axis_kind) or unit.lower() not in factors:
        wanted = f"an abscissa in {', '.join(key for key in factors if key not in ('', 'none'))}"
        raise InputError(Fault(name, wanted, f'"{unit}" (kind of data {data_kind})', "export it in s or Hz"))
    return factors[unit.lower()]


def _ordinate_kind(data_set: dict[str, Any], axis: str, name: str, motion: Motion) -> Motion | None:
    """The motion of an ordinate, None for a force; `motion` where its header says neither kind nor a known quantity."""
    data_kind = int(data_set.get(f"{axis}_spec_data_type") or 0)
    unit = str(data_set.get(f"{axis}_axis_units_lab") or "").strip().lower()
    unit = _OVER_FORCE.sub("", unit).strip("()")
    if data_kind in _FORCE_KINDS:
        return None
    if data_kind in _UNKNOWN_KINDS and unit in _UNITS_OF_ANYTHING:
        return motion
    if data_kind in _UNKNOWN_KINDS:
        if unit not in _UNITS:
            raise InputError(Fault(name, f"a unit among {', '.join(_UNITS)}", f'"{unit}"', "export its kind of data"))
        return _UNITS[unit]
    if data_kind not in _MOTIONS:
        wanted = f"a force or {', '.join(_MOTIONS.values())}"
        raise InputError(Fault(name, wanted, f"kind of data {data_kind}, {unit or '?'}"))
    return _MOTIONS[data_kind]


def _response_over_force(
    response: FrequencyResponse, numerator: Motion | None, header: dict[str, Any], motion: Motion
) -> FrequencyResponse:
    """A frequency response as motion over force; inverted where its header says force over motion."""
    data_kind = int(header.get("orddenom_spec_data_type") or 0)
    denominator = (
        None
        if data_kind in _UNKNOWN_KINDS and numerator is not None
        else _ordinate_kind(header, "orddenom", response.name, motion)
    )
    if numerator is not None and denominator is None:
        return replace(response, motion=numerator)
    if numerator is None and denominator is not None:
        with np.errstate(divide="ignore", invalid="ignore"):
            values = np.where(response.values == 0.0, 0.0, 1.0 / response.values)
        return replace(
            response,
            values=values,
            motion=denominator,
            remarks=(f"{response.name}: a force over {denominator}, turned over",),
        )
    got = "a force over a force" if denominator is None else f"{numerator} over {denominator}"
    raise InputError(Fault(response.name, "a motion over a force", got, "export the response over the force"))
