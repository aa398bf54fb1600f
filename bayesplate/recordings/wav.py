"""Sound files to recordings: what each channel is, and numbers between -1 and 1."""

from __future__ import annotations

import io
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import Fault, InputError
from bayesplate.recordings.signals import FrequencyResponse, Motion, Recording

_RATE_OFF = 1e-6


def read_wav(
    path: Path, shown: str, rate: float | None, channels: str, motion: Motion
) -> list[Recording | FrequencyResponse]:
    """The recordings of a WAV file: PCM of 8 to 32 bits, or floating point; parameters as of `read_recordings`."""
    from scipy.io import wavfile

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", wavfile.WavFileWarning)  # chunks with titles and the like
            # from memory: of a file the library asks for as much room as the header claims, up to all there is
            own_rate, samples = wavfile.read(io.BytesIO(path.read_bytes()))
    except (ValueError, OSError, EOFError, MemoryError) as error:
        remedy = "save it as WAV, PCM or floating point"
        raise InputError(Fault(shown, "a WAV file", str(error) or type(error).__name__, remedy)) from None
    except Exception as error:  # the reader of the library stumbles over broken headers in many ways
        raise InputError(Fault(shown, "a WAV file", f"a broken one ({type(error).__name__})")) from None
    return from_channels(np.atleast_1d(samples), float(own_rate), shown, rate, channels, motion)


def from_channels(
    samples: NDArray[Any], own_rate: float, shown: str, rate: float | None, channels: str, motion: Motion
) -> list[Recording | FrequencyResponse]:
    """Recordings from the samples of a sound file, (n,) or (n, n_channels) array."""
    faults = []
    if rate is not None and abs(rate - own_rate) > _RATE_OFF * rate:
        faults.append(
            Fault(
                f"{shown} rate", f"{rate:g} Hz, as --rate says", f"{own_rate:g} Hz", "leave --rate out: the file knows"
            )
        )
    count = 1 if samples.ndim == 1 else samples.shape[1]
    if count > 2:
        wanted = "one channel, or two: force and response"
        faults.append(Fault(f"{shown} channels", wanted, str(count), "save the two that are needed"))
    if faults:
        raise InputError(faults)
    columns, full_scale = _scaled(samples if samples.ndim == 2 else samples[:, None])
    if count == 1:
        return [Recording(shown, own_rate, columns[:, 0], None, motion, full_scale)]
    if channels == "response,response":
        return [
            Recording(f"{shown} channel {k + 1}", own_rate, columns[:, k], None, motion, full_scale) for k in (0, 1)
        ]
    force, response = (0, 1) if channels == "force,response" else (1, 0)
    return [Recording(shown, own_rate, columns[:, response], columns[:, force], motion, full_scale)]


def _scaled(samples: NDArray[Any]) -> tuple[NDArray[np.float64], float]:
    """Samples as numbers, whole ones over the largest of their kind, and where they end."""
    if samples.dtype == np.uint8:
        return (samples.astype(float) - 128.0) / 128.0, 127.0 / 128.0
    if np.issubdtype(samples.dtype, np.integer):
        largest = float(np.iinfo(samples.dtype).max)
        return samples.astype(float) / (largest + 1.0), largest / (largest + 1.0)
    return samples.astype(float), np.inf
