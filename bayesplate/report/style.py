"""What the figures of a report share: width, colours told apart by every eye and in grey, panels placed in inches."""

from __future__ import annotations

import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 4.5
"""Inches. On a phone a point is then about one pixel of the page, so that the smallest words below stay readable."""

WORDS, SMALL = 9.0, 8.0
"""Sizes of text, points."""

# Okabe and Ito's colours.
BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
BLACK, DARK, GREY, LIGHT = "#000000", "0.30", "0.55", "0.88"
POSTERIOR, PAPER, WEIGHTED = BLUE, ORANGE, BLACK

NO_GLYPH = "\N{REPLACEMENT CHARACTER}"


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure of the report.

    Attributes
    ----------
    name : str
        Stem of its files.
    title : str
    alt : str
        What a person who cannot see it should know.
    caption : str
        How to read it.
    figure : matplotlib.figure.Figure
    """

    name: str
    title: str
    alt: str
    caption: str
    figure: Figure = field(repr=False)


def stacked(
    heights: Sequence[float],
    *,
    left: float = 0.6,
    right: float = 0.15,
    top: float = 0.12,
    bottom: float = 0.45,
    gap: float = 0.55,
) -> tuple[Figure, list[Axes]]:
    """An empty figure with panels below each other; everything in inches, so that no layout need be searched for.

    Parameters
    ----------
    heights : sequence of float
    left, right, top, bottom, gap : float
        Margins of the page, and the space between two panels.

    Returns
    -------
    figure : matplotlib.figure.Figure
        No state of pyplot is touched.
    panels : list of matplotlib.axes.Axes
    """
    from matplotlib.figure import Figure

    height = top + sum(heights) + gap * (len(heights) - 1) + bottom
    figure = Figure(figsize=(WIDTH, height))
    panels = []
    above = top
    for one in heights:
        box = (left / WIDTH, 1.0 - (above + one) / height, 1.0 - (left + right) / WIDTH, one / height)
        panels.append(figure.add_axes(box))
        plain_axes(panels[-1])
        above += one + gap
    return figure, panels


def plain_axes(panel: Axes) -> None:
    """Small words, and no frame above and at the right."""
    panel.tick_params(labelsize=SMALL, length=3)
    panel.spines[["top", "right"]].set_visible(False)


def legend_below(figure: Figure, handles: Sequence[Any], n_columns: int) -> None:
    """A legend at the foot of a figure."""
    figure.legend(
        handles=list(handles), loc="lower center", ncols=n_columns, frameon=False, fontsize=SMALL, borderaxespad=0.1,
        columnspacing=1.2, handletextpad=0.5, handlelength=1.6,
    )  # fmt: skip


def moved_apart(wanted: NDArray[np.float64], least: float) -> NDArray[np.float64]:
    """Places from 0 to 1, at least so far apart, near where they are wanted, which is in rising order."""
    placed = wanted.copy()
    for _ in range(2000):
        lacking = np.maximum(least - np.diff(placed), 0.0)
        if lacking.max(initial=0.0) < 1e-4:
            break
        placed[:-1] -= 0.5 * lacking
        placed[1:] += 0.5 * lacking
        placed = np.clip(placed, 0.0, 1.0)
    return placed


def short(text: str, longest: int) -> str:
    """A text cut to a number of characters, the cut shown."""
    return text if len(text) <= longest else text[: longest - 1] + "…"


def visible(text: str) -> str:
    """A text from a card without what steers the way text runs: control characters and direction marks are removed."""
    if text.isprintable():
        return text
    kept = (character if character not in "\t\n\r" else " " for character in text)
    return "".join(c for c in kept if unicodedata.category(c) not in {"Cc", "Cf", "Cs", "Co", "Cn"} or c in _JOINERS)


_JOINERS = "\u200c\u200d"
"""Format characters that shape letters and join emoji; they steer nothing."""


def drawable(text: str) -> str:
    """A text from a card as a figure can show it: what the font has no sign for becomes one that says so."""
    known = _glyphs()
    return "".join(c if ord(c) in known else NO_GLYPH for c in visible(text) if c not in _JOINERS)


@lru_cache(maxsize=1)
def _glyphs() -> frozenset[int]:
    from matplotlib import font_manager

    return frozenset(font_manager.get_font(font_manager.findfont("DejaVu Sans")).get_charmap())
