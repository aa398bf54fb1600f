"""What the figures of a report share: colours, width, panels placed in inches, rows, humps, whiskers, legends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.results.tables import GREEK, JOINERS, SYMBOL, visible

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

Limits = tuple[float, float]

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
"""Those of Okabe and Ito: told apart by every eye, and in grey."""
BLACK, DARK, GREY, LIGHT = "#000000", "0.30", "0.55", "0.88"
POSTERIOR, PAPER, WEIGHTED = BLUE, ORANGE, BLACK

WIDTH = 4.5
"""Inches. On a phone a point is then about one pixel of the page, so that the smallest words below stay readable."""

WORDS, SMALL = 9.0, 8.0
"""Sizes of text, points."""
ROW = 0.235
"""Height of a row with one name, inches."""
_SHOWN = (0.002, 0.998)
_BINS = 60
_APART = 0.026
"""Share of the width that two upright names need."""

NO_GLYPH = "\N{REPLACEMENT CHARACTER}"


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure of the report."""

    name: str  # stem of its files
    title: str
    alt: str  # what a person who cannot see it should know
    caption: str  # how to read it
    figure: Figure = field(repr=False)


def placed(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """A panel at a place in inches, with small words and no frame above and at the right."""
    across, up = figure.get_size_inches()
    panel = figure.add_axes((left / across, bottom / up, width / across, height / up))
    plain_axes(panel)
    return panel


def plain_axes(panel: Axes) -> None:
    panel.tick_params(labelsize=SMALL, length=3)
    panel.xaxis.label.set_fontsize(SMALL)
    panel.yaxis.label.set_fontsize(SMALL)
    panel.spines[["top", "right"]].set_visible(False)


def stacked(
    heights: Sequence[float],
    *,
    left: float = 0.6,
    right: float = 0.15,
    top: float = 0.12,
    bottom: float = 0.45,
    gap: float = 0.55,
) -> tuple[Figure, list[Axes]]:
    """An empty figure with panels below each other, placed in inches, so that no layout need be searched for."""
    from matplotlib.figure import Figure

    height = top + sum(heights) + gap * (len(heights) - 1) + bottom
    figure = Figure(figsize=(WIDTH, height))
    panels = []
    foot = height - top + gap
    for one in heights:
        foot -= gap + one
        panels.append(placed(figure, left, foot, WIDTH - left - right, one))
    return figure, panels


def in_rows(names: Sequence[str], *, row: float = ROW, size: float = SMALL, **margins: float) -> tuple[Figure, Axes]:
    """A figure with one panel and a row for each name; `row` is its height, the margins are those of `stacked`."""
    figure, (panel,) = stacked([row * max(len(names), 1) + 0.1], **margins)
    name_rows(panel, names, size=size)
    return figure, panel


def name_rows(panel: Axes, names: Sequence[str], *, size: float = SMALL, parse_math: bool = False) -> None:
    """A row for each name, the first on top."""
    panel.set(ylim=(max(len(names), 1) - 0.5, -0.5))
    panel.set_yticks(range(len(names)), names, fontsize=size, parse_math=parse_math)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_axisbelow(True)


def heading(panel: Axes, words: str) -> None:
    panel.set_title(words, fontsize=WORDS, loc="left", weight="bold")


def limits(draws: Floats, others: Iterable[float] = (), *, reach: float = 1.5, margin: float = 0.04) -> Limits:
    """The range of a panel: nearly all draws, and of other values those that are not farther off than `reach` widths.

    `margin` is air at either side, as a share of what is shown.
    """
    low, high = np.quantile(draws, _SHOWN)
    far = reach * (high - low)
    seen = [low, high, *(value for value in others if low - far < value < high + far)]
    air = margin * (max(seen) - min(seen))
    return float(min(seen) - air), float(max(seen) + air)


def hump(panel: Axes, draws: Floats, ends: Limits, height: float = 1.0, **style: Any) -> None:
    """How often draws lie where, filled; the highest bin at the given height."""
    counts, bins = np.histogram(draws, bins=_BINS, range=ends)
    panel.stairs(height * counts / counts.max(), bins, fill=True, color=POSTERIOR, alpha=0.35, lw=0, **style)


def whisker(panel: Axes, row: Any, ends: tuple[Any, Any, Any], color: str, marker: str = "o", **style: Any) -> None:
    """A bar from the first to the last of three values, and a mark at the middle one; numbers, or arrays of them."""
    low, middle, high = ends
    panel.hlines(row, low, high, color=color, lw=1.8)
    panel.plot(middle, row, marker, **{"color": color, "mec": "black", "mew": 0.6, "ms": 5, **style})


def key(label: str, color: str, marker: str = "", **style: Any) -> Line2D:
    """An entry of a legend: a line with a mark, as of `whisker` unless the style says otherwise."""
    from matplotlib.lines import Line2D

    shown = {"mec": "black", "mew": 0.6, "ms": 5, "lw": 1.8, **style}
    return Line2D([], [], label=label, color=color, marker=marker, **shown)


def legend_below(figure: Figure, n_columns: int, *more: Artist) -> None:
    """A legend at the foot of a figure: what has a label in any of its panels, once, then further entries."""
    labelled = {
        label: handle for panel in figure.axes for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        handles=[*labelled.values(), *more], loc="lower center", ncols=n_columns, frameon=False, fontsize=SMALL,
        borderaxespad=0.1, columnspacing=1.2, handletextpad=0.5, handlelength=1.6,
    )  # fmt: skip


def hertz_axis(panel: Axes, low: float, high: float) -> None:
    """Frequencies from left to right, a factor as far everywhere."""
    panel.set(xscale="log", xlim=(low, high), xlabel="Hz")
    ticks = [tick for tick in (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000) if low <= tick <= high]
    panel.set_xticks(ticks, [str(tick) for tick in ticks])
    panel.minorticks_off()


def upright_names(panel: Axes, hertz: Sequence[float], names: Sequence[str], start: float, end: float) -> None:
    """Names upright at their frequencies, moved apart where they would overlap.

    Each has a line from its frequency, at the height `start`, to its place at the height `end`, shares of the panel.
    """
    low, high = np.log(panel.get_xlim())
    order = np.argsort(hertz, kind="stable")
    wanted = (np.log(np.array(hertz)[order]) - low) / (high - low)
    at: Any = {"transform": panel.transAxes}
    for place, true, i in zip(moved_apart(wanted, _APART), wanted, order, strict=True):
        panel.plot([true, place], [start, end], color=DARK, lw=0.4, clip_on=False, **at)
        side = "bottom" if end > start else "top"
        panel.text(place, end, names[i], rotation=90, ha="center", va=side, fontsize=SMALL - 1.5, **at)


def moved_apart(wanted: Floats, least: float) -> Floats:
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


def in_figure(text: str) -> str:
    """A text of ours with its symbols as matplotlib's mathematics; a user's text must not come here."""
    return SYMBOL.sub(
        lambda found: f"${GREEK.get(found['letter'], ('', found['letter']))[1]}_{{{found['index']}}}$", text
    )


def is_symbol(name: str) -> bool:
    """Whether a name, its unit aside, is a symbol of ours and nothing else: such a text holds nothing of a user's."""
    return SYMBOL.fullmatch(name.partition(",")[0]) is not None


def short(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def drawable(text: str) -> str:
    """A text from a card as a figure can show it: what the font has no sign for becomes one that says so."""
    known = _glyphs()
    return "".join(c if ord(c) in known else NO_GLYPH for c in visible(text) if c not in JOINERS)


@lru_cache(maxsize=1)
def _glyphs() -> frozenset[int]:
    from matplotlib import font_manager

    return frozenset(font_manager.get_font(font_manager.findfont("DejaVu Sans")).get_charmap())
