"""Sand on a ringing board: a picture of the lines on which it gathers, scored against the shapes of modes.

The picture is cropped to the board by hand, so that it may be turned by a few degrees, seen from the side, lit unevenly
and strewn in part. It is compared as it is, and straightened in many ways; what counts is how well its best
straightened form agrees with where a shape stands still.
"""

from __future__ import annotations

import os
from itertools import product
from pathlib import Path

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError

GRID = (96, 48)
"""Points along x and across it at which picture and shapes are compared."""
LARGEST_PICTURE = 50_000_000
MOST_PIXELS = 60_000_000
_STILL = 0.12
"""Amplitude over the largest, below which sand lies still."""
_BLUR, _GROUND = 1.3, 9.0
"""Points over which lines are blurred, and over which the light on a picture varies."""
_TURNS = np.radians(np.arange(-7.5, 7.6, 1.5))
_KEYSTONES = (-0.12, 0.0, 0.12)
_SCALES = (0.95, 1.0)
_N_CELLS = 70.0
"""Independent parts of a picture."""
_NEVER = 0.01
"""Probability that a picture shows none of the modes, or is not what its name says."""


def read_picture(path: str | os.PathLike[str]) -> Floats:
    """A PNG or JPEG as shades of grey, 0 to 1: (n_rows, n_columns) array."""
    from PIL import Image, UnidentifiedImageError

    path = Path(path)
    shown, wanted = path.name, "a PNG or JPEG picture"
    if path.suffix.lower() not in (".png", ".jpg", ".jpeg"):
        raise InputError(Fault(shown, wanted, f'"{path.suffix}"', "crop it to the board and save it as PNG"))
    try:
        if path.stat().st_size > LARGEST_PICTURE:
            got = f"{path.stat().st_size / 1e6:,.0f} MB"
            raise InputError(Fault(shown, f"at most {LARGEST_PICTURE / 1e6:,.0f} MB", got, "save it smaller"))
        with Image.open(path) as picture:
            if picture.width * picture.height > MOST_PIXELS:
                raise InputError(Fault(shown, f"at most {MOST_PIXELS:,} pixels", f"{picture.width} x {picture.height}"))
            picture.draft("L", (4 * GRID[0], 4 * GRID[0]))
            grey = picture.convert("L")
            grey.thumbnail((8 * GRID[0], 8 * GRID[0]))
            values = np.asarray(grey, dtype=float) / 255.0
    except FileNotFoundError:
        raise InputError(Fault(shown, "a picture", "no such file")) from None
    except (UnidentifiedImageError, OSError, Image.DecompressionBombError) as error:
        raise InputError(Fault(shown, wanted, str(error)[:100])) from None
    if min(values.shape) < 24 or np.ptp(values) < 0.02:
        got = f"{values.shape[1]} x {values.shape[0]} of one shade"
        raise InputError(Fault(shown, "a picture with lines on it", got))
    return values


def straightened(picture: Floats) -> Floats:
    """The forms in which a picture is compared, (n_rows, n_columns) as it is seen: (n_forms, n_points) array."""
    from_below = picture[::-1].T  # rows of a picture run downward
    return np.stack([_normal(_flat(one)) for one in _turned(from_below)])


def sand_evidence(forms: Floats, shapes: Floats) -> Floats:
    """ln of how much a picture speaks for each shape, zero for the average of all: (n_modes,) array.

    The forms of `straightened` show the board from above, x from left to right and y from bottom to top; the shapes,
    (n_modes, n_x, n_y), are deflections at evenly spaced points of the whole board, edges included.
    """
    scores = agreement(forms, shapes)
    log_likelihood = -0.5 * _N_CELLS * np.log(1.0 - np.clip(scores, 0.0, 0.999) ** 2)
    top = log_likelihood.max()
    relative = log_likelihood - top - np.log(np.mean(np.exp(log_likelihood - top)))
    return np.asarray(np.logaddexp(relative + np.log(1.0 - _NEVER), np.log(_NEVER)))


def agreement(forms: Floats, shapes: Floats) -> Floats:
    """Correlation of a picture in its best form with the still lines of each shape: (n_modes,) array."""
    lines = np.stack([_normal(_flat(_still(shape))) for shape in shapes])
    return np.asarray(np.abs(forms @ lines.T).max(axis=0))  # sand may be lighter or darker than the board


def _still(shape: Floats) -> Floats:
    """Stillness of a shape, 0 to 1, at the points of the grid: sand lies where it is 1."""
    level = np.abs(shape) / np.abs(shape).max()
    return _sampled(np.exp(-((level / _STILL) ** 2)), *_points())


def _points() -> tuple[Floats, Floats]:
    """Places of the grid as fractions of the sides: two (n_x, n_y) arrays."""
    x, y = (np.arange(n) + 0.5 for n in GRID)
    return tuple(np.meshgrid(x / GRID[0], y / GRID[1], indexing="ij"))  # type: ignore[return-value]


def _sampled(values: Floats, x: Floats, y: Floats) -> Floats:
    """Values on a grid over the sides, edges included, at fractions of the sides."""
    from scipy.ndimage import map_coordinates

    n_x, n_y = values.shape
    return np.asarray(map_coordinates(values, [x * (n_x - 1), y * (n_y - 1)], order=1, mode="nearest"))


def _turned(picture: Floats) -> list[Floats]:
    """The picture turned, seen from the side and scaled in all ways that are tried."""
    from scipy.ndimage import gaussian_filter

    width, height = picture.shape
    smooth = gaussian_filter(picture, (0.3 * width / GRID[0], 0.3 * height / GRID[1]))
    x, y = _points()
    u, v = (x - 0.5) * width, (y - 0.5) * height
    found = []
    for turn, along, across, scale in product(_TURNS, _KEYSTONES, _KEYSTONES, _SCALES):
        depth = 1.0 + along * (x - 0.5) + across * (y - 0.5)
        there = scale * (np.cos(turn) * u - np.sin(turn) * v) / depth / width + 0.5
        upward = scale * (np.sin(turn) * u + np.cos(turn) * v) / depth / height + 0.5
        found.append(_sampled(smooth, there, upward))
    return found


def _flat(values: Floats) -> Floats:
    """Lines without the light that falls on them, no line brighter than the others."""
    from scipy.ndimage import gaussian_filter

    fine = gaussian_filter(values, _BLUR)
    off = fine - gaussian_filter(values, _GROUND)
    return np.asarray(off / np.sqrt(gaussian_filter(off**2, _GROUND) + 1e-2 * np.mean(off**2) + 1e-12))


def _normal(values: Floats) -> Floats:
    """All values in a row, of mean zero and length one."""
    row = values.ravel() - values.mean()
    return np.asarray(row / max(float(np.linalg.norm(row)), 1e-12))
