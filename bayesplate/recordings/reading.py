"""Files to recordings: WAV, FLAC and CSV, and UFF with the extra; every fault of every file at once."""

from __future__ import annotations

import os
import stat
from collections.abc import Sequence
from dataclasses import replace
from hashlib import sha256
from pathlib import Path

import numpy as np

from bayesplate.errors import Fault, InputError, plain
from bayesplate.recordings.checks import signal_faults
from bayesplate.recordings.signals import Motion, Read, Recording
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
"""By the ending of the file."""
COMPRESSED = (".m4a", ".mp3", ".aac", ".ogg", ".opus", ".wma", ".amr", ".3gp", ".mp4", ".mov")


def read_recordings(
    paths: Sequence[str | os.PathLike[str]],
    rate: float | None = None,
    channels: str = CHANNELS[0],
    motion: Motion = "acceleration",
    *,
    was_played: bool = False,
) -> list[list[Read]]:
    """What every file holds, file by file; every fault of every file is told at once.

    `rate` (Hz) and `motion` are for files that do not say them. The two channels of a sound file are one of `CHANNELS`,
    or the number of the one that is used. What a loudspeaker was given (`was_played`) may reach the largest value, and
    may be quiet.
    """
    faults: list[Fault] = []
    if not 0 < len(paths) <= MOST_FILES:
        raise InputError(Fault("FILES", f"1 to {MOST_FILES} recordings", str(len(paths))))
    found: list[list[Read]] = []
    for path, shown in zip(map(Path, paths), _names(paths), strict=True):
        try:
            _require_file(path, shown)
            read = _set_aside(READERS[path.suffix.lower()](path, shown, rate, channels, motion))
        except InputError as error:
            faults += error.faults
            continue
        faults += [fault for one in read for fault in signal_faults(one, was_played=was_played)]
        found.append(read)
    faults += _given_twice([one for own in found for one in own])
    if faults:
        raise InputError(faults)
    return found


def _set_aside(read: list[Read]) -> list[Read]:
    """Recordings of a file that are neither silent nor a copy of another; the first has the remarks on the rest."""
    kept, told, seen = list[Read](), list[str](), dict[bytes, str]()
    for one in read:
        signal = one.response if isinstance(one, Recording) else one.values
        if len(read) > 1 and (signal == signal[:1]).all():
            told.append(f"{one.name} is silent and left out")
        elif (first := seen.setdefault(_content(one), one.name)) is not one.name:
            told.append(f"{one.name} holds the same as {first} and is left out")
        else:
            kept.append(one)
    return [replace(kept[0], remarks=(*kept[0].remarks, *told)), *kept[1:]] if kept else read[:1]


def _content(one: Read) -> bytes:
    """What tells a recording from others."""
    content = sha256()
    for part in (one.response, one.force) if isinstance(one, Recording) else (one.values, one.frequency):
        content.update(b"" if part is None else np.ascontiguousarray(part).tobytes())
    return content.digest()


def _given_twice(read: Sequence[Read]) -> list[Fault]:
    """Recordings of the same content: a copy tells nothing new, and would count as a repeat without any scatter."""
    named: dict[bytes, list[str]] = {}
    for one in read:
        named.setdefault(_content(one), []).append(one.name)
    wanted, got, remedy = "each recording once", "the same samples again", "a copy is no new evidence: leave it out"
    return [Fault(" and ".join(names), wanted, got, remedy) for names in named.values() if len(names) > 1]


def _names(paths: Sequence[str | os.PathLike[str]]) -> list[str]:
    """Names of files as messages show them: the last part of the path, all of it where two files share that."""
    names = [Path(path).name for path in paths]
    shown = (str(path) if names.count(name) > 1 else name for path, name in zip(paths, names, strict=True))
    return [plain(one)[-120:] for one in shown]


def _require_file(path: Path, shown: str) -> None:
    """A regular file of a known kind and a size that fits into memory; looked at from outside only."""
    ending, wanted = path.suffix, f"a recording: {', '.join(READERS)}"
    if os.path.isdir(path):
        raise InputError(Fault(shown, "a recording", "a folder", f"give the files in it: {shown}/*.wav"))
    if ending.lower() in COMPRESSED:
        remedy = "record as WAV; what there is another program can save as WAV, but compression costs soft modes"
        raise InputError(Fault(shown, wanted, f'compressed sound, "{ending}"', remedy))
    if ending.lower() not in READERS:
        raise InputError(Fault(shown, wanted, f'"{ending}"' if ending else "no ending", "save it as WAV or CSV"))
    try:
        status = os.stat(path)
    except FileNotFoundError:
        raise InputError(Fault(shown, "a recording", "no such file", f"looked in {path.absolute().parent}")) from None
    except OSError as error:
        raise InputError(Fault(shown, "a readable file", error.strerror or str(error))) from None
    if not stat.S_ISREG(status.st_mode):
        raise InputError(Fault(shown, "a regular file", "a device"))
    if status.st_size == 0:
        raise InputError(Fault(shown, "a recording", "an empty file", "record it again"))
    if status.st_size > LARGEST_FILE:
        most, got = f"at most {LARGEST_FILE / 1e6:,.0f} MB", f"{status.st_size / 1e6:,.0f} MB"
        raise InputError(Fault(shown, most, got, "cut out the minutes with the hits"))
    if not os.access(path, os.R_OK):
        raise InputError(Fault(shown, "a readable file", "permission denied"))
