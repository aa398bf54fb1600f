"""Sand on a ringing board: a picture of the nodal lines on which it gathers, scored against the shapes of modes.

The picture is cropped by hand to the part of the board that vibrates, so that it may be turned by a few degrees, seen
from the side, unevenly lit and strewn in part. It is straightened in many ways; the score is the agreement of its best
form with the nodal lines of a shape.
"""

from __future__ import annotations

import os
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import Fault, InputError

if TYPE_CHECKING:
    from PIL.Image import Image

GRID = (96, 48)
"""Points along x and across it at which picture and shapes are compared."""
LARGEST_PICTURE = 50_000_000
MOST_PIXELS = 60_000_000
_FEWEST_PIXELS, _LEAST_CONTRAST = 24, 0.02
_STILL_AMPLITUDE = 0.12
"""Amplitude over the largest below which sand lies still."""
_BLUR, _LIGHT_SCALE = 1.3, 9.0
"""Points over which lines are blurred, and over which the light on a picture varies."""
_TURNS = np.radians(np.arange(-7.5, 7.6, 1.5))
_KEYSTONES = (-0.12, 0.0, 0.12)
_SCALES = (0.95, 1.0)
_N_CELLS = 70.0
"""Independent cells of a picture."""
_FOREIGN_PROBABILITY = 0.01
"""Probability that a picture shows none of the modes, or another one than its name says."""


def read_picture(path: str | os.PathLike[str]) -> Floats:
    """A PNG or JPEG as shades of grey, 0 to 1: (n_rows, n_columns) array."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    path = Path(path)
    file_name, wanted = path.name, "a PNG or JPEG picture"
    if path.suffix.lower() not in (".png", ".jpg", ".jpeg"):
        raise InputError(Fault(file_name, wanted, f'"{path.suffix}"', "crop it to the board and save it as PNG"))
    try:
        if path.stat().st_size > LARGEST_PICTURE:
            got = f"{path.stat().st_size / 1e6:,.0f} MB"
            raise InputError(Fault(file_name, f"at most {LARGEST_PICTURE / 1e6:,.0f} MB", got, "save it smaller"))
        with Image.open(path) as picture:
            if picture.width * picture.height > MOST_PIXELS:
                raise InputError(
                    Fault(file_name, f"at most {MOST_PIXELS:,} pixels", f"{picture.width} x {picture.height}")
                )
            picture.draft("L", (4 * GRID[0], 4 * GRID[0]))
            upright = ImageOps.exif_transpose(picture)
            sides = upright.size
            grey = _as_grey(upright)
            grey.thumbnail((8 * GRID[0], 8 * GRID[0]))
            values = np.asarray(grey, dtype=float) / 255.0
    except FileNotFoundError:
        raise InputError(Fault(file_name, "a picture", "no such file")) from None
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        if isinstance(error, InputError):
            raise
        is_other = isinstance(error, UnidentifiedImageError)
        got = "another kind of file" if is_other else getattr(error, "strerror", None) or str(error)[:100]
        raise InputError(Fault(file_name, wanted, got)) from None
    if min(values.shape) < _FEWEST_PIXELS:
        got = f"{sides[0]} x {sides[1]}"
        raise InputError(Fault(file_name, "a picture of the whole board", got, "is it cropped to the board?"))
    if np.ptp(values) < _LEAST_CONTRAST:
        raise InputError(Fault(file_name, "a picture with lines on it", "one shade"))
    return values


def _as_grey(picture: Image) -> Image:
    """A picture in shades of grey of 8 bits; what is transparent is white."""
    if picture.mode.startswith("I"):  # 16 bits, which the library would cut off at 255
        return picture.convert("I").point(lambda shade: shade / 257.0).convert("L")
    if picture.mode in ("LA", "PA", "RGBA") or "transparency" in picture.info:
        from PIL.Image import new

        white = new("RGBA", picture.size, "white")
        white.alpha_composite(picture.convert("RGBA"))
        picture = white
    return picture.convert("L")


def straighten_picture(picture: Floats) -> Floats:
    """The straightened forms of a picture, (n_rows, n_columns) as it is seen: (n_forms, n_points) array."""
    from_below = picture[::-1].T  # rows of a picture run downward
    return np.stack([_normalise(_flatten_light(turned)) for turned in _turn_picture(from_below)])


def sand_evidence(forms: Floats, shapes: Floats) -> Floats:
    """ln of the evidence of a picture for each shape, zero for the average of all: (n_modes,) array.

    The forms of `straighten_picture` show the board from above, x from left to right and y from bottom to top; the
    shapes, (n_modes, n_x, n_y), are deflections at evenly spaced points of the part that vibrates, edges included.
    """
    scores = line_agreement(forms, shapes)
    log_likelihood = -0.5 * _N_CELLS * np.log(1.0 - np.clip(scores, 0.0, 0.999) ** 2)
    top = log_likelihood.max()
    relative = log_likelihood - top - np.log(np.mean(np.exp(log_likelihood - top)))
    return np.asarray(np.logaddexp(relative + np.log(1.0 - _FOREIGN_PROBABILITY), np.log(_FOREIGN_PROBABILITY)))


def line_agreement(forms: Floats, shapes: Floats) -> Floats:
    """Correlation of the best form of a picture with the nodal lines of each shape: (n_modes,) array."""
    lines = np.stack([_normalise(_flatten_light(_stillness(shape))) for shape in shapes])
    return np.asarray(np.abs(forms @ lines.T).max(axis=0))  # sand may be lighter or darker than the board


def _stillness(shape: Floats) -> Floats:
    """Stillness of a shape, 0 to 1, at the points of the grid: sand gathers where it is 1."""
    level = np.abs(shape) / np.abs(shape).max()
    return _sample_grid(np.exp(-((level / _STILL_AMPLITUDE) ** 2)), *_grid_points())


def _grid_points() -> tuple[Floats, Floats]:
    """Points of the grid as fractions of the sides: two (n_x, n_y) arrays."""
    x, y = (np.arange(n) + 0.5 for n in GRID)
    return tuple(np.meshgrid(x / GRID[0], y / GRID[1], indexing="ij"))  # type: ignore[return-value]


def _sample_grid(values: Floats, x: Floats, y: Floats) -> Floats:
    """Values on a grid over the board, edges included, interpolated at fractions of the sides."""
    from scipy.ndimage import map_coordinates

    n_x, n_y = values.shape
    return np.asarray(map_coordinates(values, [x * (n_x - 1), y * (n_y - 1)], order=1, mode="nearest"))


def _turn_picture(picture: Floats) -> list[Floats]:
    """The picture in all turns, keystones and scales that are tried."""
    from scipy.ndimage import gaussian_filter

    width, height = picture.shape
    smooth = gaussian_filter(picture, (0.3 * width / GRID[0], 0.3 * height / GRID[1]))
    x, y = _grid_points()
    u, v = (x - 0.5) * width, (y - 0.5) * height
    pictures = []
    for turn, keystone_x, keystone_y, scale in product(_TURNS, _KEYSTONES, _KEYSTONES, _SCALES):
        depth = 1.0 + keystone_x * (x - 0.5) + keystone_y * (y - 0.5)
        at_x = scale * (np.cos(turn) * u - np.sin(turn) * v) / depth / width + 0.5
        at_y = scale * (np.sin(turn) * u + np.cos(turn) * v) / depth / height + 0.5
        pictures.append(_sample_grid(smooth, at_x, at_y))
    return pictures


def _flatten_light(values: Floats) -> Floats:
    """The lines of a picture without uneven light, all of about the same contrast."""
    from scipy.ndimage import gaussian_filter

    blurred = gaussian_filter(values, _BLUR)
    lines = blurred - gaussian_filter(values, _LIGHT_SCALE)
    return np.asarray(lines / np.sqrt(gaussian_filter(lines**2, _LIGHT_SCALE) + 1e-2 * np.mean(lines**2) + 1e-12))


def _normalise(values: Floats) -> Floats:
    """All values as one vector of mean zero and length one."""
    row = values.ravel() - values.mean()
    return np.asarray(row / max(float(np.linalg.norm(row)), 1e-12))
