"""Tables to recordings: CSV with named columns, of a signal over time or of a response over frequency."""

from __future__ import annotations

import re
import warnings
from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.axes import rate_of, require_lines
from bayesplate.recordings.signals import MOTIONS, FrequencyResponse, Motion, Recording

Floats = NDArray[np.float64]

_TIME, _HERTZ = ("time", "time_s", "t"), ("f_hz", "hz", "frequency", "frequency_hz")
_REAL, _IMAGINARY, _COHERENCE = ("re", "real"), ("im", "imag", "imaginary"), ("coherence",)
_FORCE, _RESPONSE = ("force",), ("response", "sound", *MOTIONS)
KNOWN = (*_TIME, *_FORCE, *_RESPONSE, *_HERTZ, *_REAL, *_IMAGINARY, *_COHERENCE)
WANTED = "named columns: force if it was measured, acceleration, velocity, displacement or sound, time; or f_hz, re, im"
_LONGEST_HEADER = 10_000
_END_OF_LINE = re.compile(r"\r\n|\r|\n")
"""As the reader of the numbers counts lines; Python knows more ends of lines."""


def read_csv(
    path: Path, shown: str, rate: float | None, channels: str, motion: Motion
) -> list[Recording | FrequencyResponse]:
    """The recording of a CSV file; parameters as of `read_recordings`."""
    names, line, skipped = _header(path, shown)
    columns = _columns(path, shown, names, skipped)
    if _of(columns, _HERTZ) is not None:
        return [_response(columns, shown, motion)]
    faults = []
    response = _of(columns, _RESPONSE)
    if response is None:
        faults.append(Fault(f"{shown} line {line}", WANTED, ", ".join(names) or "nothing"))
    if len([name for name in columns if name in _RESPONSE]) > 1:
        faults.append(Fault(f"{shown} line {line}", "one response", "several", "one file for each sensor"))
    times = _of(columns, _TIME)
    if times is None and rate is None:
        faults.append(Fault(f"{shown} rate", "a column time, or --rate", "neither", "--rate 48000"))
    if faults or response is None:
        raise InputError(faults)
    own_rate = rate or 1.0 if times is None else rate_of(times, shown, rate)
    named = next(name for name in columns if name in _RESPONSE)
    told: Motion = next((one for one in MOTIONS if one == named), "pressure" if named == "sound" else motion)
    return [Recording(shown, own_rate, response, _of(columns, _FORCE), told)]


def _header(path: Path, shown: str) -> tuple[list[str], int, int]:
    """Names of the columns, the number of their line, and how many lines stand before the numbers."""
    with path.open("rb") as file:
        head = file.read(_LONGEST_HEADER)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in head:
        raise InputError(
            Fault(shown, "a text file in UTF-8", "another encoding or binary data", "save it as CSV in UTF-8")
        )
    lines = _END_OF_LINE.split(head.decode("utf-8-sig", "replace"))
    for number, line in enumerate(lines, start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if ";" in line or "\t" in line:
            got = "semicolons or tabs"
            raise InputError(Fault(f"{shown} line {number}", "commas between columns", got, "and a point in 52.5"))
        names = [cell.strip().strip('"').lower() for cell in line.split(",")]
        if not any(name in KNOWN for name in names):
            raise InputError(Fault(f"{shown} line {number}", WANTED, f'"{line[:60].strip()}"'))
        unknown = [name for name in names if name not in KNOWN]
        if unknown:
            wanted = f"columns among {', '.join(dict.fromkeys(KNOWN))}"
            raise InputError([Fault(f"{shown} line {number}", wanted, f'"{name[:40]}"') for name in unknown])
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise InputError([Fault(f"{shown} line {number}", "each column once", f'"{name}" again') for name in twice])
        return names, number, number
    raise InputError(Fault(shown, WANTED, "no header"))


def _columns(path: Path, shown: str, names: list[str], skipped: int) -> dict[str, Floats]:
    try:
        with path.open(encoding="utf-8-sig") as lines, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that there are no numbers is told below
            values = np.loadtxt(islice(lines, skipped, None), delimiter=",", ndmin=2, comments="#")
    except ValueError as error:  # no numbers, or no UTF-8
        raise InputError(
            Fault(shown, f"{len(names)} numbers on each line", str(error)[:120], "mend or cut that line")
        ) from None
    if values.shape[1] != len(names) and values.size:
        raise InputError(Fault(shown, f"{len(names)} columns, as the header names", str(values.shape[1])))
    if not values.size:
        raise InputError(Fault(shown, "samples below the header", "none", "record it again"))
    return {name: np.ascontiguousarray(values[:, k]) for k, name in enumerate(names)}


def _of(columns: dict[str, Floats], names: tuple[str, ...]) -> Floats | None:
    return next((columns[name] for name in names if name in columns), None)


def _response(columns: dict[str, Floats], shown: str, motion: Motion) -> FrequencyResponse:
    hertz, real, imaginary = (_of(columns, names) for names in (_HERTZ, _REAL, _IMAGINARY))
    if hertz is None or real is None or imaginary is None:
        raise InputError(Fault(shown, "the columns f_hz, re and im", ", ".join(columns)))
    require_lines(hertz, shown)
    values = np.stack([real, imaginary], axis=1).view(complex)[:, 0]  # without arithmetic: they may be no numbers
    return FrequencyResponse(shown, hertz, values, _of(columns, _COHERENCE), motion)
