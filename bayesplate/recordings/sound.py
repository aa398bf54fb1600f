"""WAV and FLAC files to recordings: what each channel is, and numbers between -1 and 1."""

from __future__ import annotations

import io
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.checks import SILENT, is_copy, rings
from bayesplate.recordings.signals import Motion, Read, Recording

_RATE_OFF = 1e-6
_CROSSTALK = 1e-3
"""Of the other channel: what comes through into one to which nothing is connected."""
_BITS = {"PCM_S8": 8, "PCM_U8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
"""Of the samples of a file, by the library's name of their kind; others are numbers without a largest."""


def read_sound(path: Path, shown: str, rate: float | None, channels: str, motion: Motion) -> list[Read]:
    """The recordings of a sound file; parameters as of `read_recordings`."""
    import soundfile

    content, remarks = _mended(path.read_bytes(), shown)
    try:
        with soundfile.SoundFile(io.BytesIO(content)) as file:
            own_rate, bits = float(file.samplerate), _BITS.get(file.subtype)
            columns = file.read(dtype="float64", always_2d=True)
    except (RuntimeError, ValueError, TypeError, OSError, MemoryError) as error:
        got, remedy = str(error).rpartition(": ")[2][:120], "save it as WAV, PCM or floating point"
        raise InputError(Fault(shown, f"a {path.suffix[1:].upper()} file", got, remedy)) from None
    if rate is not None and abs(rate - own_rate) > _RATE_OFF * rate:
        wanted, remedy = f"{rate:g} Hz, as --rate says", "leave --rate out: the file knows"
        raise InputError(Fault(f"{shown} rate", wanted, f"{own_rate:g} Hz", remedy))
    full_scale = np.inf if bits is None else 1.0 - 2.0 ** (1 - bits)
    whole = Recording(shown, own_rate, columns[:, 0], None, motion, full_scale, remarks=remarks)
    return [*_of_channels(columns, whole, channels)]


def _mended(content: bytes, shown: str) -> tuple[bytes, tuple[str, ...]]:
    """A WAV file whose header states as many bytes of samples as there are, and what is told if it did not.

    A recorder writes their number when it closes the file: where it was cut off, that is zero, and all samples are
    there.
    """
    at, align = 12, 1
    while content[:4] == b"RIFF" and at + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, at)
        first, left = at + 8, len(content) - at - 8
        if name == b"fmt " and size >= 16 and left >= 16:
            align = max(int.from_bytes(content[first + 12 : first + 14], "little"), 1)
        if name == b"data":
            is_right = size == left or (0 < size < left and _is_chunk(content[first + size + size % 2 :]))
            if is_right and size % align == 0:
                return content, ()
            kept = (size if is_right else left) // align * align
            told = f"{shown}: its header states {size} bytes of samples, {kept} are there and read (was it cut off?)"
            return content[: at + 4] + struct.pack("<I", kept) + content[first : first + kept], (told,)
        at = first + size + size % 2
    return content, ()


def _is_chunk(rest: bytes) -> bool:
    """Whether a chunk of a WAV file, or nothing, stands there."""
    if len(rest) < 8:
        return True
    name, size = struct.unpack_from("<4sI", rest)
    return all(0x20 <= byte < 0x7F for byte in name) and size <= len(rest) - 8


def _of_channels(columns: Floats, whole: Recording, channels: str) -> list[Recording]:
    """What the channels of a file are, (n, n_channels) array, in recordings that are else as `whole`."""
    shown = whole.name
    if channels.isdecimal():
        if int(channels) > columns.shape[1]:
            wanted = f"channel {channels}, as --channels says"
            raise InputError(Fault(f"{shown} channels", wanted, f"{columns.shape[1]} channels"))
        columns = columns[:, [int(channels) - 1]]
    if columns.shape[1] > 2:
        wanted, remedy = "one channel, or two: force and response", "--channels 1, say, takes the first alone"
        raise InputError(Fault(f"{shown} channels", wanted, str(columns.shape[1]), remedy))
    if columns.shape[1] == 2:
        columns, told = _without_idle(columns, whole)
        whole = replace(whole, remarks=(*whole.remarks, *(f"{shown}: {one}" for one in told)))
    if columns.shape[1] == 1:
        return [replace(whole, response=columns[:, 0])]
    if channels == "response,response":
        first, second = (replace(whole, name=f"{shown} channel {k + 1}", response=columns[:, k]) for k in (0, 1))
        return [first, replace(second, remarks=())]
    force, response = (0, 1) if channels == "force,response" else (1, 0)
    return [replace(whole, response=columns[:, response], force=columns[:, force])]


def _without_idle(columns: Floats, whole: Recording) -> tuple[Floats, list[str]]:
    """Two channels without one that is silent or a copy of the other, and what is told of it."""
    spans = np.ptp(columns, axis=0) if len(columns) else np.zeros(2)
    quiet = max(SILENT, _CROSSTALK * spans.max()) if np.isfinite(whole.full_scale) else SILENT
    silent = np.flatnonzero(spans <= quiet)
    if silent.size == 1 and rings(columns[:, 1 - silent[0]], whole.rate):
        return columns[:, 1 - silent], [f"channel {silent[0] + 1} is silent and left out"]
    if is_copy(*columns.T):
        return columns[:, :1], ["both channels hold the same sound, and one is used"]
    return columns, []
