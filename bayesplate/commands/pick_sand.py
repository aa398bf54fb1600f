"""Which peak a picture of sand belongs to, and whether it lies as the board does."""

from __future__ import annotations

from collections.abc import Mapping
from math import log
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bayesplate.board.board import Board
    from bayesplate.recordings.picking import Picked
    from bayesplate.recordings.sand import Floats

_OFF = 0.03
"""Relative distance up to which a picture of sand belongs to a peak."""
_OBLONG = 0.01
"""Product of the logarithms of two aspect ratios from which on it matters that one is oblong the other way."""


def pictures_of(picked: Picked, pictures: Mapping[float, Floats]) -> tuple[dict[int, list[Floats]], list[str]]:
    """Pictures by the number of the likely peak nearest to their frequency, and those without one."""
    found: dict[int, list[Floats]] = {}
    told = []
    likely = picked.likely
    for hertz, picture in pictures.items():
        off = [abs(mode.frequency / hertz - 1.0) for mode in likely]
        if not off or min(off) > _OFF:
            told.append(f"no peak within {100.0 * _OFF:g} % of the sand at {hertz:g} Hz")
        else:
            found.setdefault(off.index(min(off)), []).append(picture)
    return found, told


def upright(board: Board, pictures: Mapping[float, Floats]) -> tuple[dict[float, Floats], list[str]]:
    """Pictures but those that are oblong the other way than their board, and what to do about these."""
    nominal = board.nominal()
    x, y = (1e3 * nominal[side] for side in ("length_x", "length_y"))
    aspects = {hertz: picture.shape[1] / picture.shape[0] for hertz, picture in pictures.items()}
    crosswise = [hertz for hertz, aspect in aspects.items() if log(aspect) * log(x / y) < -_OBLONG]
    form = "higher than wide" if x > y else "wider than high"
    told = [
        f"the sand at {hertz:g} Hz left out: the picture is {form}, the board {x:.0f} mm along x and {y:.0f} mm "
        "along y; turn it, x from left to right"
        for hertz in crosswise
    ]
    return {hertz: picture for hertz, picture in pictures.items() if hertz not in crosswise}, told
