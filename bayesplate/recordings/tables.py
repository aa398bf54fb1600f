"""Tables to recordings: CSV with named columns, of a signal over time or of a response over frequency."""

from __future__ import annotations

import re
import warnings
from itertools import islice
from pathlib import Path

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import MOTIONS, FrequencyResponse, Motion, Read, Recording

_KEYS: dict[str, str] = {
    "time": "time", "time_s": "time", "t": "time", "force": "force", "response": "response", "sound": "pressure",
    **{motion: motion for motion in MOTIONS},
    "f_hz": "f_hz", "hz": "f_hz", "frequency": "f_hz", "frequency_hz": "f_hz", "re": "re", "real": "re", "im": "im",
    "imag": "im", "imaginary": "im", "coherence": "coherence",
}  # fmt: skip
"""What each name of a column means."""
WANTED = "named columns: force if it was measured, acceleration, velocity, displacement or sound, time; or f_hz, re, im"
_LONGEST_HEADER = 10_000
_END_OF_LINE = re.compile(r"\r\n|\r|\n")
"""As the reader of the numbers counts lines; Python knows more ends of lines."""
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


def read_csv(path: Path, shown: str, rate: float | None, channels: str, motion: Motion) -> list[Read]:
    """The recording of a CSV file; parameters as of `read_recordings`."""
    names, line = _header(path, shown)
    columns = _columns(path, shown, names, line)
    if "f_hz" in columns:
        return [_response(columns, shown, motion)]
    faults = []
    responses = [name for name in ("response", *MOTIONS) if name in columns]
    if not responses:
        faults.append(Fault(f"{shown} line {line}", WANTED, ", ".join(names) or "nothing"))
    if len(responses) > 1:
        faults.append(Fault(f"{shown} line {line}", "one response", "several", "one file for each sensor"))
    if "time" not in columns and rate is None:
        faults.append(Fault(f"{shown} rate", "a column time, or --rate", "neither", "--rate 48000"))
    if faults:
        raise InputError(faults)
    own_rate = rate_of(columns["time"], shown, rate) if "time" in columns else rate or 1.0
    own = next((one for one in MOTIONS if one in columns), motion)
    return [Recording(shown, own_rate, columns[responses[0]], columns.get("force"), own)]


def _header(path: Path, shown: str) -> tuple[list[str], int]:
    """Names of the columns, and the number of their line."""
    with path.open("rb") as file:
        head = file.read(_LONGEST_HEADER)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in head:
        raise InputError(
            Fault(shown, "a text file in UTF-8", "another encoding or binary data", "save it as CSV in UTF-8")
        )
    lines = _END_OF_LINE.split(head.decode("utf-8-sig", "replace"))
    told = ((number, one) for number, one in enumerate(lines, start=1) if one.strip() and one.lstrip()[0] != "#")
    number, line = next(told, (0, ""))
    if not number:
        raise InputError(Fault(shown, WANTED, "no header"))
    at = f"{shown} line {number}"
    if ";" in line or "\t" in line:
        raise InputError(Fault(at, "commas between columns", "semicolons or tabs", "and a point in 52.5"))
    names = [cell.strip().strip('"').lower() for cell in line.split(",")]
    unknown = [name for name in names if name not in _KEYS]
    if len(unknown) == len(names):
        raise InputError(Fault(at, WANTED, f'"{line[:60].strip()}"'))
    if unknown:
        raise InputError([Fault(at, f"columns among {', '.join(_KEYS)}", f'"{name[:40]}"') for name in unknown])
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise InputError([Fault(at, "each column once", f'"{name}" again') for name in twice])
    return names, number


def _columns(path: Path, shown: str, names: list[str], skipped: int) -> dict[str, Floats]:
    """The numbers below a header, by what the names of the columns mean."""
    try:
        with path.open(encoding="utf-8-sig") as lines, warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # that there are no numbers is told below
            values = np.loadtxt(islice(lines, skipped, None), delimiter=",", ndmin=2, comments="#")
    except ValueError:  # no numbers, or no UTF-8
        raise InputError(_wrong_line(path, shown, len(names), skipped)) from None
    if not values.size:
        raise InputError(Fault(shown, "samples below the header", "none", "record it again"))
    if values.shape[1] != len(names):
        raise InputError(Fault(shown, f"{len(names)} columns, as the header names", str(values.shape[1])))
    # of two columns that mean the same the first counts
    return {_KEYS[name]: np.ascontiguousarray(values[:, k]) for k, name in reversed([*enumerate(names)])}


def _wrong_line(path: Path, shown: str, n: int, skipped: int) -> Fault:
    """The first line after those that are skipped which does not hold n numbers."""
    wanted, remedy = f"{n} number{'s' * (n > 1)} on each line", "mend or cut that line"
    with path.open(encoding="utf-8-sig", errors="replace") as lines:
        for number, line in enumerate(islice(lines, skipped, None), start=skipped + 1):
            told = line.partition("#")[0].strip()
            try:
                is_right = len([float(cell) for cell in told.split(",")]) == n
            except ValueError:
                is_right = not told
            if not is_right:
                return Fault(f"{shown} line {number}", wanted, f'"{told[:60]}"', remedy)
    return Fault(shown, wanted, "other lines", remedy)


def _response(columns: dict[str, Floats], shown: str, motion: Motion) -> FrequencyResponse:
    if not {"re", "im"} <= columns.keys():
        raise InputError(Fault(shown, "the columns f_hz, re and im", ", ".join(columns)))
    _require_lines(columns["f_hz"], shown)
    parts = np.stack([columns["re"], columns["im"]], axis=1)
    values = parts.view(complex)[:, 0]  # without arithmetic: they may be no numbers
    return FrequencyResponse(shown, columns["f_hz"], values, motion)


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


def _require_lines(hertz: Floats, shown: str) -> None:
    """Refuse frequencies that are no evenly spaced lines."""
    steps = np.diff(np.where(np.abs(hertz) < _LATEST, hertz, -1.0))
    is_even = hertz.size >= _FEWEST_LINES and hertz[0] >= 0 and (steps > 0).all()
    if not is_even or np.ptp(steps) > _UNEVEN * float(np.mean(steps)):
        wanted = "a hundred evenly spaced lines or more, rising"
        raise InputError(Fault(f"{shown} f_hz", wanted, f"{hertz.size} others"))
