"""Files to recordings: WAV, FLAC and CSV, and UFF with the extra; all faults of all files are reported at once."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from bayesplate.errors import Fault, InputError, printable
from bayesplate.recordings.checks import signal_faults
from bayesplate.recordings.signals import Motion, Recording, Signal
from bayesplate.recordings.sound import read_sound
from bayesplate.recordings.tables import read_csv
from bayesplate.recordings.uff import read_uff

LARGEST_FILE = 400_000_000
"""Bytes; half an hour of two channels of 24 bits at 48 kHz."""
MOST_FILES = 200
CHANNELS = ("force,response", "response,force", "response,response")

READERS = {
    ".wav": read_sound, ".csv": read_csv, ".flac": read_sound, ".uff": read_uff, ".unv": read_uff, ".ufb": read_uff,
}  # fmt: skip
"""The reader of a file, by its ending."""
COMPRESSED_ENDINGS = (".m4a", ".mp3", ".aac", ".ogg", ".opus", ".wma", ".amr", ".3gp", ".mp4", ".mov")


def read_recordings(
    paths: Sequence[str | os.PathLike[str]],
    rate: float | None = None,
    channels: str = CHANNELS[0],
    motion: Motion = "acceleration",
    *,
    was_played: bool = False,
) -> list[list[Signal]]:
    """The signals of each file; all faults of all files are reported at once.

    `rate` (Hz) and `motion` are for files that do not state them. `channels` of a sound file is one of `CHANNELS`, or
    the number of the only channel that is used. The signal of a loudspeaker (`was_played`) may reach the largest value,
    and may be quiet.
    """
    faults: list[Fault] = []
    if not 0 < len(paths) <= MOST_FILES:
        raise InputError(Fault("FILES", f"1 to {MOST_FILES} recordings", str(len(paths))))
    signals_by_file: list[list[Signal]] = []
    for path, file_name in zip(map(Path, paths), _shown_names(paths), strict=True):
        try:
            _require_file(path, file_name)
            signals = _distinct_signals(READERS[path.suffix.lower()](path, file_name, rate, channels, motion))
        except InputError as error:
            faults += error.faults
            continue
        faults += [fault for signal in signals for fault in signal_faults(signal, was_played=was_played)]
        signals_by_file.append(signals)
    faults += _copy_faults([signal for signals in signals_by_file for signal in signals])
    if faults:
        raise InputError(faults)
    return signals_by_file


def _distinct_signals(signals: list[Signal]) -> list[Signal]:
    """Signals of a file that are neither silent nor a copy of another; the first has the remarks on the others."""
    distinct, remarks, names = list[Signal](), list[str](), dict[bytes, str]()
    for signal in signals:
        samples = signal.response if isinstance(signal, Recording) else signal.values
        if len(signals) > 1 and (samples == samples[:1]).all():
            remarks.append(f"{signal.name} is silent and left out")
        elif (first := names.setdefault(_content_digest(signal), signal.name)) is not signal.name:
            remarks.append(f"{signal.name} holds the same as {first} and is left out")
        else:
            distinct.append(signal)
    return [replace(distinct[0], remarks=(*distinct[0].remarks, *remarks)), *distinct[1:]] if distinct else signals[:1]


def _content_digest(signal: Signal) -> bytes:
    """A digest of the samples, the same for copies of a recording."""
    content = sha256()
    for part in (signal.response, signal.force) if isinstance(signal, Recording) else (signal.values, signal.frequency):
        content.update(b"" if part is None else np.ascontiguousarray(part).tobytes())
    return content.digest()


def _copy_faults(signals: Sequence[Signal]) -> list[Fault]:
    """A fault for each recording that is given twice: a copy would count as a repeat without any scatter."""
    names_by_content: dict[bytes, list[str]] = {}
    for signal in signals:
        names_by_content.setdefault(_content_digest(signal), []).append(signal.name)
    wanted, got, remedy = "each recording once", "the same samples again", "a copy is no new evidence: leave it out"
    return [Fault(" and ".join(names), wanted, got, remedy) for names in names_by_content.values() if len(names) > 1]


def _shown_names(paths: Sequence[str | os.PathLike[str]]) -> list[str]:
    """Names of files as messages show them: the last part of the path, or all of it where two files share that."""
    names = [Path(path).name for path in paths]
    shown_names = (str(path) if names.count(name) > 1 else name for path, name in zip(paths, names, strict=True))
    return [printable(name)[-120:] for name in shown_names]


def _require_file(path: Path, file_name: str) -> None:
    """Refuse a path that is no regular, readable file of a known kind and of a size that fits into memory."""
    ending, wanted = path.suffix, f"a recording: {', '.join(READERS)}"
    if os.path.isdir(path):
        raise InputError(Fault(file_name, "a recording", "a folder", f"give the files in it: {file_name}/*.wav"))
    if ending.lower() in COMPRESSED_ENDINGS:
        remedy = "record as WAV; what there is another program can save as WAV, but compression costs soft modes"
        raise InputError(Fault(file_name, wanted, f'compressed sound, "{ending}"', remedy))
    if ending.lower() not in READERS:
        raise InputError(Fault(file_name, wanted, f'"{ending}"' if ending else "no ending", "save it as WAV or CSV"))
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(
            Fault(file_name, "a recording", "no such file", f"looked in {path.absolute().parent}")
        ) from None
    except OSError as error:
        raise InputError(Fault(file_name, "a readable file", error.strerror or str(error))) from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(Fault(file_name, "a regular file", "a device"))
    if status.st_size == 0:
        raise InputError(Fault(file_name, "a recording", "an empty file", "record it again"))
    if status.st_size > LARGEST_FILE:
        most, got = f"at most {LARGEST_FILE / 1e6:,.0f} MB", f"{status.st_size / 1e6:,.0f} MB"
        raise InputError(Fault(file_name, most, got, "cut out the minutes with the hits"))
    if not os.access(path, os.R_OK):
        raise InputError(Fault(file_name, "a readable file", "permission denied"))
