"""Recordings that nobody made: taps on a board of known constants, as a phone beside it would hear them, and its card.

The modes are those of an ideal plate; each tap excites them by their deflection where it falls, and what is heard is
the acceleration under the phone, with the noise of a room and the hum of its lamps. The picture is sand on one of the
modes.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.io import wavfile

from bayesplate.board.material import rigidities
from bayesplate.commands.prepare import prepare
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.system import system_of
from bayesplate.plate.solve import Modes

Floats = NDArray[np.float64]

E_X, E_Y, G_XY = 11.4e9, 0.83e9, 0.71e9
"""Pa; what the page finds again."""
RATE, SECONDS, N_TAPS = 16_000, 12.5, 6
N_MODES = 16
PHONE = (0.93, 0.12)
TAPS = {"tap-corner.wav": (0.04, 0.08), "tap-side.wav": (0.31, 0.93)}
"""Where phone and fingers are, as shares of the two sides."""
DRIVEN = 3
"""Number of the mode, from 0, on which the sand was strewn."""
CARD = """\
# Invented: a board that was tapped in a computer.
format = 1
name = "tapped"

[plate]
length_x_mm = 520
length_y_mm = 190
thickness_mm = { mean = 3.6, sd = 0.02 }
mass_g = 149

[material]
poisson_xy = 0.4

[setup]
edges = { x0 = "free", x1 = "free", y0 = "free", y1 = "free" }
"""


def write_taps(folder: Path) -> None:
    """Write the card, two recordings and the picture into a folder."""
    card = folder / "tapped.toml"
    card.write_text(CARD)
    board = prepare(card, may_lack_frequencies=True).board
    nominal = board.nominal()
    values = nominal | rigidities(E_X, E_Y, G_XY, nominal["thickness"], nominal["poisson_xy"])._asdict()
    modes, named = spectrum(system_of(board, board.setups[0]), values, N_MODES)
    hertz = np.array([mode.frequency for mode in named])
    rng = np.random.default_rng(11)
    damping = rng.uniform(0.004, 0.012, N_MODES)
    for name, place in TAPS.items():
        heard = _heard(modes, hertz, damping, place, rng)
        wavfile.write(folder / name, RATE, np.round(0.4 * 32767.0 * heard / np.abs(heard).max()).astype(np.int16))
    _write_sand(modes, folder / "sand.png", rng)


def _heard(
    modes: Modes, hertz: Floats, damping: Floats, place: tuple[float, float], rng: np.random.Generator
) -> Floats:
    """What the phone records: (n_samples,) array."""
    at_finger, at_phone = (_deflection(modes, one) for one in (place, PHONE))
    times = np.arange(round(SECONDS * RATE)) / RATE
    heard = np.zeros(times.size)
    for tap in range(N_TAPS):
        since = times - (0.6 + 1.95 * tap + rng.uniform(0.0, 0.05))
        soft = rng.uniform(0.3e-3, 0.6e-3)  # s that the finger stays: a soft tap excites high modes less
        sizes = rng.uniform(0.5, 1.0) * at_finger * at_phone * hertz * np.exp(-((2.0 * hertz * soft) ** 2))
        first = int(np.argmax(since > 0.0))
        for size, own, ratio in zip(sizes, hertz, damping, strict=True):
            after = since[first:]
            heard[first:] += size * np.exp(-2.0 * np.pi * own * ratio * after) * np.sin(2.0 * np.pi * own * after)
        click = np.exp(-since[first : first + 40] / 4e-4) * rng.standard_normal(40)
        heard[first : first + 40] += 0.3 * np.abs(sizes).max() * click
    level = float(np.sqrt(np.mean(heard**2)))
    return heard + 0.02 * level * (rng.standard_normal(times.size) + np.sin(2.0 * np.pi * 100.0 * times))


def _deflection(modes: Modes, place: tuple[float, float]) -> Floats:
    x, y = (np.array([one]) for one in place)
    return modes.displacement(x, y)[:, 0, 0]


def _write_sand(modes: Modes, path: Path, rng: np.random.Generator) -> None:
    shape = modes.displacement(np.linspace(0.0, 1.0, 520), np.linspace(0.0, 1.0, 190))[DRIVEN]
    sand = np.exp(-((shape / np.abs(shape).max() / 0.1) ** 2)) * rng.uniform(0.3, 1.0, shape.shape)
    picture = np.clip(0.25 + 0.6 * sand + 0.06 * rng.standard_normal(shape.shape), 0.0, 1.0)
    Image.fromarray(np.round(255.0 * picture).astype(np.uint8).T[::-1]).save(path)
