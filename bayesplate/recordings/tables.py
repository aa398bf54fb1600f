"""CSV files to recordings: named columns of a signal over time or of a response over frequency."""

from __future__ import annotations

import re
import warnings
from itertools import islice
from pathlib import Path

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import MOTIONS, FrequencyResponse, Motion, Recording, Signal

_COLUMN_MEANINGS: dict[str, str] = {
    "time": "time", "time_s": "time", "t": "time", "force": "force", "response": "response", "sound": "pressure",
    **{motion: motion for motion in MOTIONS},
    "f_hz": "f_hz", "hz": "f_hz", "frequency": "f_hz", "frequency_hz": "f_hz", "re": "re", "real": "re", "im": "im",
    "imag": "im", "imaginary": "im", "coherence": "coherence",
}  # fmt: skip
"""The quantity that each name of a column stands for."""
WANTED_COLUMNS = (
    "named columns: force if it was measured, acceleration, velocity, displacement or sound, time; or f_hz, re, im"
)
_LONGEST_HEADER = 10_000
_END_OF_LINE = re.compile(r"\r\n|\r|\n")
"""The ends of lines that numpy counts; Python knows more."""
_JITTER = 1e-3
"""Share of a time step by which the times of samples may be unevenly spaced."""
_GAP = 1.75
"""Steps between two times from which on a sample is missing; times are rounded, so two steps may look like less."""
_COARSEST_ROUNDING = 6.0
"""Steps to which times may be rounded, so that several samples have the same time."""
_LARGEST_VALUE = 1e12
"""Largest time in s or frequency in Hz."""
_FEWEST_LINES = 100
_SPACING_TOLERANCE = 2e-2
"""Share of the mean spacing by which the spacing of lines may vary."""


def read_csv(path: Path, file_name: str, rate: float | None, channels: str, motion: Motion) -> list[Signal]:
    """The recording of a CSV file; parameters as of `read_recordings`."""
    names, line = _read_header(path, file_name)
    columns = _read_columns(path, file_name, names, line)
    if "f_hz" in columns:
        return [_frequency_response(columns, file_name, motion)]
    faults = []
    responses = [name for name in ("response", *MOTIONS) if name in columns]
    if not responses:
        faults.append(Fault(f"{file_name} line {line}", WANTED_COLUMNS, ", ".join(names) or "nothing"))
    if len(responses) > 1:
        faults.append(Fault(f"{file_name} line {line}", "one response", "several", "one file for each sensor"))
    if "time" not in columns and rate is None:
        faults.append(Fault(f"{file_name} rate", "a column time, or --rate", "neither", "--rate 48000"))
    if faults:
        raise InputError(faults)
    own_rate = sampling_rate(columns["time"], file_name, rate) if "time" in columns else rate or 1.0
    column_motion = next((name for name in MOTIONS if name in columns), motion)
    return [Recording(file_name, own_rate, columns[responses[0]], columns.get("force"), column_motion)]


def _read_header(path: Path, file_name: str) -> tuple[list[str], int]:
    """Names of the columns, and the number of their line."""
    with path.open("rb") as file:
        head = file.read(_LONGEST_HEADER)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in head:
        raise InputError(
            Fault(file_name, "a text file in UTF-8", "another encoding or binary data", "save it as CSV in UTF-8")
        )
    lines = _END_OF_LINE.split(head.decode("utf-8-sig", "replace"))
    numbered = (
        (number, text) for number, text in enumerate(lines, start=1) if text.strip() and text.lstrip()[0] != "#"
    )
    number, line = next(numbered, (0, ""))
    if not number:
        raise InputError(Fault(file_name, WANTED_COLUMNS, "no header"))
    place = f"{file_name} line {number}"
    if ";" in line or "\t" in line:
        raise InputError(Fault(place, "commas between columns", "semicolons or tabs", "and a point in 52.5"))
    names = [cell.strip().strip('"').lower() for cell in line.split(",")]
    unknown = [name for name in names if name not in _COLUMN_MEANINGS]
    if len(unknown) == len(names):
        raise InputError(Fault(place, WANTED_COLUMNS, f'"{line[:60].strip()}"'))
    if unknown:
        raise InputError(
            [Fault(place, f"columns among {', '.join(_COLUMN_MEANINGS)}", f'"{name[:40]}"') for name in unknown]
        )
    meanings = [_COLUMN_MEANINGS[name] for name in names]
    if twice := [name for k, name in enumerate(names) if meanings[k] in meanings[:k]]:
        raise InputError([Fault(place, "each quantity once", f'"{name}" again') for name in twice])
    return names, number


def _read_columns(path: Path, file_name: str, names: list[str], skipped: int) -> dict[str, Floats]:
    """The columns of numbers below a header, by the quantities that they hold."""
    try:
        # of another encoding a comment may be, a number is not
        with path.open(encoding="utf-8-sig", errors="replace") as lines, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # a table without numbers is refused below
            values = np.loadtxt(islice(lines, skipped, None), delimiter=",", ndmin=2, comments="#")
    except ValueError:
        raise InputError(_line_fault(path, file_name, len(names), skipped)) from None
    if not values.size:
        raise InputError(Fault(file_name, "samples below the header", "none", "record it again"))
    if values.shape[1] != len(names):
        raise InputError(Fault(file_name, f"{len(names)} columns, as the header names", str(values.shape[1])))
    return {_COLUMN_MEANINGS[name]: np.ascontiguousarray(values[:, k]) for k, name in enumerate(names)}


def _line_fault(path: Path, file_name: str, n: int, skipped: int) -> Fault:
    """The fault of the first line, after the skipped ones, that does not hold n numbers."""
    wanted, remedy = f"{n} number{'s' * (n > 1)} on each line", "mend or cut that line"
    with path.open(encoding="utf-8-sig", errors="replace") as lines:
        for number, line in enumerate(islice(lines, skipped, None), start=skipped + 1):
            content = line.partition("#")[0].strip()
            try:
                is_right = len([float(cell) for cell in content.split(",")]) == n
            except ValueError:
                is_right = not content
            if not is_right:
                return Fault(f"{file_name} line {number}", wanted, f'"{content[:60]}"', remedy)
    return Fault(file_name, wanted, "other lines", remedy)


def _frequency_response(columns: dict[str, Floats], file_name: str, motion: Motion) -> FrequencyResponse:
    if not {"re", "im"} <= columns.keys():
        raise InputError(Fault(file_name, "the columns f_hz, re and im", ", ".join(columns)))
    require_lines(columns["f_hz"], f"{file_name} f_hz")
    components = np.stack([columns["re"], columns["im"]], axis=1)
    values = components.view(complex)[:, 0]  # without arithmetic: they may be NaN
    return FrequencyResponse(file_name, columns["f_hz"], values, motion)


def sampling_rate(times: Floats, file_name: str, rate: float | None = None) -> float:
    """Samples a second of evenly spaced times in s, rounded to seven digits; a given `rate` must agree with them."""
    steps = np.diff(np.where(np.abs(times) < _LARGEST_VALUE, times, np.nan))
    if times.size < 2 or not (steps >= 0.0).all() or times[-1] <= times[0]:
        raise InputError(Fault(f"{file_name} time", "times in s that rise", "times that do not"))
    step = float((times[-1] - times[0]) / (times.size - 1))
    rounding = float(steps[steps > 0.0].min()) if (steps == 0.0).any() else 0.0
    deviation = np.abs(times - times[0] - step * np.arange(times.size)).max()
    tolerance = max(_JITTER * step, 1e-6 * float(np.abs(times).max()), rounding)
    if (
        deviation > tolerance + step
        or steps.max() > max(_GAP * step, 1.01 * rounding)
        or rounding > _COARSEST_ROUNDING * step
    ):
        raise InputError(Fault(f"{file_name} time", "evenly spaced samples", "uneven ones", "record without gaps"))
    own_rate = 1.0 / step
    if rate is not None and abs(rate / own_rate - 1.0) > _JITTER:
        raise InputError(
            Fault(f"{file_name} rate", f"{rate:g} Hz, as --rate says", f"{own_rate:.6g} Hz", "leave --rate out")
        )
    return rate or float(f"{own_rate:.7g}")


def require_lines(hertz: Floats, place: str) -> None:
    """Refuse frequencies in Hz that are not evenly spaced lines."""
    steps = np.diff(np.where(np.abs(hertz) < _LARGEST_VALUE, hertz, -1.0))
    is_even = hertz.size >= _FEWEST_LINES and hertz[0] >= 0 and (steps > 0).all()
    if not is_even or np.ptp(steps) > _SPACING_TOLERANCE * float(np.mean(steps)):
        wanted = "a hundred evenly spaced lines or more, rising"
        raise InputError(Fault(place, wanted, f"{hertz.size} others"))
