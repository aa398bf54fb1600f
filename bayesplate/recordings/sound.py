"""WAV and FLAC files to recordings: force and response channels, as numbers between -1 and 1."""

from __future__ import annotations

import io
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError
from bayesplate.recordings.checks import SILENT_LEVEL, is_copy, rings
from bayesplate.recordings.signals import Motion, Recording, Signal

_RATE_OFF = 1e-6
_CROSSTALK = 1e-3
"""Crosstalk into a channel to which nothing is connected, over the other channel."""
_BITS = {"PCM_S8": 8, "PCM_U8": 8, "PCM_16": 16, "PCM_24": 24, "PCM_32": 32}
"""Bits of a sample, by the library's name of its kind; other kinds are numbers without a largest value."""


def read_sound(path: Path, file_name: str, rate: float | None, channels: str, motion: Motion) -> list[Signal]:
    """The recordings of a sound file; parameters as of `read_recordings`."""
    import soundfile

    content, remarks = _mend_header(path.read_bytes(), file_name)
    try:
        with soundfile.SoundFile(io.BytesIO(content)) as file:
            own_rate, bits = float(file.samplerate), _BITS.get(file.subtype)
            columns = file.read(dtype="float64", always_2d=True)
    except (RuntimeError, ValueError, TypeError, OSError, MemoryError) as error:
        got, remedy = str(error).rpartition(": ")[2][:120], "save it as WAV, PCM or floating point"
        raise InputError(Fault(file_name, f"a {path.suffix[1:].upper()} file", got, remedy)) from None
    if rate is not None and abs(rate - own_rate) > _RATE_OFF * rate:
        wanted, remedy = f"{rate:g} Hz, as --rate says", "leave --rate out: the file knows"
        raise InputError(Fault(f"{file_name} rate", wanted, f"{own_rate:g} Hz", remedy))
    full_scale = np.inf if bits is None else 1.0 - 2.0 ** (1 - bits)
    recording = Recording(file_name, own_rate, columns[:, 0], None, motion, full_scale, remarks=remarks)
    return [*_split_channels(columns, recording, channels)]


def _mend_header(content: bytes, file_name: str) -> tuple[bytes, tuple[str, ...]]:
    """A WAV file whose header states the true number of bytes of samples, and a remark if it had to be mended.

    A recorder writes this number when it closes the file: if it was interrupted, the number is zero although all
    samples are there.
    """
    offset, align = 12, 1
    while content[:4] == b"RIFF" and offset + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, offset)
        first, n_left = offset + 8, len(content) - offset - 8
        if name == b"fmt " and size >= 16 and n_left >= 16:
            align = max(int.from_bytes(content[first + 12 : first + 14], "little"), 1)
        if name == b"data":
            is_right = size == n_left or (0 < size < n_left and _is_chunk(content[first + size + size % 2 :]))
            if is_right and size % align == 0:
                return content, ()
            n_bytes = (size if is_right else n_left) // align * align
            remark = (
                f"{file_name}: its header states {size} bytes of samples, {n_bytes} are there and read "
                "(was it cut off?)"
            )
            return content[: offset + 4] + struct.pack("<I", n_bytes) + content[first : first + n_bytes], (remark,)
        offset = first + size + size % 2
    return content, ()


def _is_chunk(rest: bytes) -> bool:
    """Whether these bytes begin with a chunk of a WAV file, or are too few for one."""
    if len(rest) < 8:
        return True
    name, size = struct.unpack_from("<4sI", rest)
    return all(0x20 <= byte < 0x7F for byte in name) and size <= len(rest) - 8


def _split_channels(columns: Floats, recording: Recording, channels: str) -> list[Recording]:
    """Recordings of the channels of a file, (n, n_channels) array, that otherwise have the fields of `recording`."""
    file_name = recording.name
    if channels.isdecimal():
        if int(channels) > columns.shape[1]:
            wanted = f"channel {channels}, as --channels says"
            raise InputError(Fault(f"{file_name} channels", wanted, f"{columns.shape[1]} channels"))
        columns = columns[:, [int(channels) - 1]]
    if columns.shape[1] > 2:
        wanted, remedy = "one channel, or two: force and response", "--channels 1, say, takes the first alone"
        raise InputError(Fault(f"{file_name} channels", wanted, str(columns.shape[1]), remedy))
    if columns.shape[1] == 2:
        columns, remarks = _drop_idle_channel(columns, recording)
        recording = replace(recording, remarks=(*recording.remarks, *(f"{file_name}: {remark}" for remark in remarks)))
    if columns.shape[1] == 1:
        return [replace(recording, response=columns[:, 0])]
    if channels == "response,response":
        first, second = (
            replace(recording, name=f"{file_name} channel {k + 1}", response=columns[:, k]) for k in (0, 1)
        )
        return [first, replace(second, remarks=())]
    force, response = (0, 1) if channels == "force,response" else (1, 0)
    return [replace(recording, response=columns[:, response], force=columns[:, force])]


def _drop_idle_channel(columns: Floats, recording: Recording) -> tuple[Floats, list[str]]:
    """Two channels without one that is silent or a copy of the other, and remarks on it."""
    if not len(columns):
        return columns, []
    spans = np.ptp(columns, axis=0)
    quiet = max(SILENT_LEVEL, _CROSSTALK * spans.max()) if np.isfinite(recording.full_scale) else SILENT_LEVEL
    silent = np.flatnonzero(spans <= quiet)
    if silent.size == 1 and rings(columns[:, 1 - silent[0]], recording.rate):
        return columns[:, 1 - silent], [f"channel {silent[0] + 1} is silent and left out"]
    if is_copy(*columns.T):
        return columns[:, :1], ["both channels hold the same sound, and one is used"]
    return columns, []
