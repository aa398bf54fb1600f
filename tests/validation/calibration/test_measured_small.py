"""The arbiter of measured peaks: plain fits of one pole, at a pole that was planted where no peak of the size is."""

from __future__ import annotations

from itertools import product

import numpy as np
from validation.calibration.run_measured import DEGREES, HALF_WIDTHS, plain_fits

POLE, DECAY = 372.5, 4.4
SIZE = 0.02
"""Of the noise, over the size of the pole at its frequency."""


def response(hertz: np.ndarray) -> np.ndarray:
    """A pole on a real background, which moves the largest size of their sum away from it."""
    background = 2.0 + 0.004 * (hertz - POLE)
    noise = np.random.default_rng(1).standard_normal((2, hertz.size)) * SIZE / np.sqrt(2.0)
    return 1j * DECAY / (1j * (hertz - POLE) + DECAY) + background + noise[0] + 1j * noise[1]


def error(hertz: np.ndarray, half: float, degree: int, near: float) -> float:
    """Standard error of the pole's frequency by the information of a window, all else unknown."""
    kept = hertz[np.abs(hertz - near) <= half]
    shape = 1.0 / (1j * (kept - POLE) + DECAY)
    free = [shape, *(((kept - near) / half) ** k + 0j for k in range(degree + 1))]
    moved = [1j * DECAY * 1j * shape**2, -1j * DECAY * shape**2]  # by the pole's frequency and by its decay rate
    columns = np.stack([*moved, *free, *(1j * one for one in free)], axis=1)
    every = np.concatenate([columns.real, columns.imag])
    return float(SIZE / np.sqrt(2.0) * np.sqrt(np.linalg.inv(every.T @ every)[0, 0]))


def test_plain_fits_find_the_pole_and_not_the_largest_size():
    hertz, near = np.arange(340.0, 410.0, 0.5), 369.6
    values = response(hertz)
    found = np.array(plain_fits(hertz, values, near))
    errors = np.array([error(hertz, half, degree, near) for half, degree in product(HALF_WIDTHS, DEGREES)])

    assert np.abs((found - POLE) / errors).max() < 4.0
    assert abs(hertz[np.abs(values).argmax()] - POLE) > 10.0 * errors.max()
