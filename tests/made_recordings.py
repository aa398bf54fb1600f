"""Recordings made for tests: a free board of the generator that was hit or tapped, as arrays and as files."""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import ritz
from generator.ringing import Blow, Ringing, recorded, ringing, with_noise
from numpy.typing import NDArray
from scipy.io import wavfile

from bayesplate.errors import InputError
from bayesplate.recordings.picking import PickedModes
from bayesplate.recordings.reading import read_recordings

Floats = NDArray[np.float64]
E_X, E_Y, G_XY = 12.1e9, 0.87e9, 0.72e9
SIDES, THICKNESS, DENSITY = (0.580, 0.217), 4.7e-3, 429.0
SENSOR = (0.560, 0.197)
CARD = """\
format = 1
name = "planted"

[plate]
length_x_mm = 580
length_y_mm = 217
thickness_mm = 4.7
density_kg_m3 = 429

[material]
poisson_xy = 0.4

[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
noise_percent = { median = 0.1, factor = 2 }
"""


@lru_cache(maxsize=4)
def board(n_modes: int = 16, least: float = 0.004, most: float = 0.012) -> Ringing:
    """A free board of known constants, its damping drawn once."""
    plate = ritz.Plate.from_moduli(
        E_X, E_Y, G_XY, 0.4, rho=DENSITY, h=THICKNESS, L_x=SIDES[0], L_y=SIDES[1], edges=ritz.ALL_FREE
    )
    damping = np.random.default_rng(5).uniform(least, most, n_modes)
    return ringing(plate, n_modes, damping)


def hits(
    rng: np.random.Generator,
    times: list[float],
    hammer: tuple[float, float],
    sensor: tuple[float, float] = SENSOR,
    *,
    rate: float = 4000.0,
    seconds: float = 1.5,
    decibels: float = 45.0,
    hum: float = 0.0,
) -> tuple[Floats, Floats]:
    """Force and acceleration of a board that is hit at some times, s, with noise."""
    blows = [Blow(one + rng.uniform(0.0, 1e-3), rng.uniform(0.4e-3, 1e-3), rng.uniform(3.0, 6.0)) for one in times]
    force, heard = recorded(board(), hammer, sensor, blows, rate, seconds)
    return with_noise(rng, force, 40.0, rate), with_noise(rng, heard, decibels, rate, hum)


def accelerance(
    hertz: Floats, hammer: tuple[float, float], of: Ringing | None = None, sensor: tuple[float, float] = SENSOR
) -> NDArray[np.complex128]:
    """Of a board between a hammer and a sensor."""
    plate = of or board()
    omega, own = 2.0 * np.pi * hertz[:, None], 2.0 * np.pi * plate.hertz
    terms = -(omega**2) * plate.residues(hammer, sensor)
    return np.sum(terms / (own**2 - omega**2 + 2j * plate.damping * own * omega), axis=1)


def with_complex_noise(
    rng: np.random.Generator, values: NDArray[np.complex128], share: float
) -> NDArray[np.complex128]:
    """A response with noise of a share of its greatest value in either part."""
    noise = share * np.abs(values).max() * rng.standard_normal((2, values.size))
    return values + noise[0] + 1j * noise[1]


def wav_bytes(format_tag: int, channels: int, rate: int, align: int, bits: int, data: bytes, claimed: int) -> bytes:
    """A WAV file by hand, with whatever its header says."""
    header = struct.pack("<HHIIHH", format_tag, channels, rate, rate * align & 0xFFFFFFFF, align, bits)
    chunks = b"fmt " + struct.pack("<I", len(header)) + header + b"data" + struct.pack("<I", claimed) + data
    return b"RIFF" + struct.pack("<I", (4 + len(chunks)) & 0xFFFFFFFF) + b"WAVE" + chunks


def uff(sets: list[dict[str, Any]]) -> bytes:
    """A UFF file, as text; keys: kind, x, y, even, axis, unit, top, top_unit, under."""
    lines = []
    for one in sets:
        x, y, even = one["x"], np.asarray(one["y"]), one.get("even", True)
        is_complex = np.iscomplexobj(y)
        axis = "{:>10}    0    0    0 {:<20} {:<20}"
        lines += ["    -1", "    58".ljust(80), *[" " * 80] * 5]
        lines.append(f"{one['kind']:5d}         0    0         0 NONE               1   3 NONE               1   3")
        step = x[1] - x[0] if even else 0.0
        lines.append(f"{6 if is_complex else 4:10d}{y.size:10d}{int(even):10d}{x[0]:13.5e}{step:13.5e}{0.0:13.5e}")
        lines.append(axis.format(one.get("axis", {1: 17, 4: 18}[one["kind"]]), "NONE", one.get("unit", "NONE")))
        lines.append(axis.format(one.get("top", 12), "NONE", one.get("top_unit", "NONE")))
        lines.append(axis.format(one.get("under", 13 if one["kind"] == 4 else 0), "NONE", "NONE"))
        lines.append(axis.format(0, "NONE", "NONE"))
        numbers = y.view(float) if is_complex else y
        if even:
            lines += ["".join(f"{v:20.11e}" for v in numbers[k : k + 4]) for k in range(0, numbers.size, 4)]
        else:
            pairs = [f"{t:13.5e}{v:20.11e}" for t, v in zip(x, y, strict=True)]
            lines += ["".join(pairs[k : k + 2]) for k in range(0, y.size, 2)]
        lines.append("    -1")
    return "\n".join([*lines, ""]).encode()


def write_wav(path: Path, rate: float, *channels: Floats, level: float = 0.5) -> Path:
    """A file of 16 bits, each channel up to a share of what it can hold."""
    columns = np.stack([level * channel / np.abs(channel).max() for channel in channels], axis=1)
    wavfile.write(path, round(rate), np.round(32767.0 * columns).astype(np.int16))
    return path


def write_table(path: Path, **columns: Floats) -> Path:
    """A CSV table with a header."""
    np.savetxt(path, np.column_stack([*columns.values()]), "%.9g", ",", header=",".join(columns), comments="")
    return path


def only(path: Path, content: bytes | None = None, **options: Any) -> Any:
    """The one recording, or frequency response, that a file holds."""
    if content is not None:
        path.write_bytes(content)
    ((one,),) = read_recordings([path], **options)
    return one


def refusal(call: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    """What is said where something is refused; empty where it is not."""
    try:
        call(*arguments, **options)
    except InputError as refused:
        return str(refused)
    return ""


def likely_below(found: PickedModes, hertz: float) -> Floats:
    """Frequencies of the likely modes below a limit, Hz."""
    return np.array([mode.hz for mode in found.likely if mode.hz < hertz])


def truth_below(hertz: float, of: Ringing | None = None) -> Floats:
    """Frequencies of a board below a limit, Hz."""
    damped = (of or board()).damped
    return damped[damped < hertz]


def write_taps(folder: Path, rng: np.random.Generator, *, rate: float = 8000.0) -> list[Path]:
    """Two recordings of six taps each by a microphone, with hum: what a maker has."""
    paths = []
    for number, hammer in enumerate([(0.03, 0.02), (0.15, 0.19)], start=1):
        times = [0.5 + 1.4 * i for i in range(6)]
        _, heard = hits(rng, times, hammer, (0.52, 0.03), rate=rate, seconds=9.0, decibels=35.0, hum=0.02)
        paths.append(write_wav(folder / f"tap{number}.wav", rate, heard))
    return paths
