"""Style of the figures of a report: colours, width, panels placed in inches, rows, densities, whiskers, legends."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.results.tables import GREEK, JOINERS, SYMBOL, strip_control_characters

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

AxisRange = tuple[float, float]

BLUE, ORANGE, GREEN, VERMILLION, SKY, PURPLE = "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7"
"""Colours of Okabe and Ito, distinct to colour-blind eyes and in grey."""
BLACK, DARK, GREY, LIGHT = "#000000", "0.30", "0.55", "0.88"
POSTERIOR_COLOUR, PAPER_COLOUR, WEIGHTED_COLOUR = BLUE, ORANGE, BLACK

FIGURE_WIDTH = 4.5
"""Inches. On a phone a point is then about one pixel of the page, so that the smallest text stays readable."""

TEXT_SIZE, SMALL_SIZE = 9.0, 8.0
"""Sizes of text, points."""
ROW_HEIGHT = 0.235
"""Height of a row with one name, inches."""
_SHOWN_QUANTILES = (0.002, 0.998)
_N_BINS = 60
_NAME_SPACING = 0.026
"""Least distance of two upright names, as a share of the width."""

NO_GLYPH = "\N{REPLACEMENT CHARACTER}"


@dataclass(frozen=True, eq=False)
class Picture:
    """A figure of the report."""

    name: str  # stem of its files
    title: str
    alt: str  # alternative text, for readers who cannot see the figure
    caption: str  # how to read the figure
    figure: Figure = field(repr=False)


def place_panel(figure: Figure, left: float, bottom: float, width: float, height: float) -> Axes:
    """A panel at a place in inches, with small text and no frame above and at the right."""
    figure_width, figure_height = figure.get_size_inches()
    panel = figure.add_axes((left / figure_width, bottom / figure_height, width / figure_width, height / figure_height))
    plain_axes(panel)
    return panel


def plain_axes(panel: Axes) -> None:
    panel.tick_params(labelsize=SMALL_SIZE, length=3)
    panel.xaxis.label.set_fontsize(SMALL_SIZE)
    panel.yaxis.label.set_fontsize(SMALL_SIZE)
    panel.spines[["top", "right"]].set_visible(False)


def stacked_panels(
    heights: Sequence[float],
    *,
    left: float = 0.6,
    right: float = 0.15,
    top: float = 0.12,
    bottom: float = 0.45,
    gap: float = 0.55,
) -> tuple[Figure, list[Axes]]:
    """An empty figure with panels below each other, placed in inches; it needs no layout engine."""
    from matplotlib.figure import Figure

    total_height = top + sum(heights) + gap * (len(heights) - 1) + bottom
    figure = Figure(figsize=(FIGURE_WIDTH, total_height))
    panels = []
    foot = total_height - top + gap
    for height in heights:
        foot -= gap + height
        panels.append(place_panel(figure, left, foot, FIGURE_WIDTH - left - right, height))
    return figure, panels


def panel_with_rows(
    names: Sequence[str], *, row: float = ROW_HEIGHT, size: float = SMALL_SIZE, **margins: float
) -> tuple[Figure, Axes]:
    """A figure with one panel and a row, of height `row`, for each name; margins as of `stacked_panels`."""
    figure, (panel,) = stacked_panels([row * max(len(names), 1) + 0.1], **margins)
    name_rows(panel, names, size=size)
    return figure, panel


def name_rows(panel: Axes, names: Sequence[str], *, size: float = SMALL_SIZE, parse_math: bool = False) -> None:
    """A row for each name, the first on top."""
    panel.set(ylim=(max(len(names), 1) - 0.5, -0.5))
    panel.set_yticks(range(len(names)), names, fontsize=size, parse_math=parse_math)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_axisbelow(True)


def draw_heading(panel: Axes, words: str) -> None:
    panel.set_title(words, fontsize=TEXT_SIZE, loc="left", weight="bold")


def axis_range(draws: Floats, others: Iterable[float] = (), *, reach: float = 1.5, margin: float = 0.04) -> AxisRange:
    """The range of an axis: nearly all draws, and the other values that lie within `reach` widths of them.

    `margin` is the padding at either side, as a share of the range.
    """
    low, high = np.quantile(draws, _SHOWN_QUANTILES)
    far = reach * (high - low)
    values = [low, high, *(value for value in others if low - far < value < high + far)]
    padding = margin * (max(values) - min(values))
    return float(min(values) - padding), float(max(values) + padding)


def draw_density(panel: Axes, draws: Floats, ends: AxisRange, height: float = 1.0, **style: Any) -> None:
    """A filled histogram of draws, scaled so that its highest bin has the given height."""
    counts, bins = np.histogram(draws, bins=_N_BINS, range=ends)
    panel.stairs(height * counts / counts.max(), bins, fill=True, color=POSTERIOR_COLOUR, alpha=0.35, lw=0, **style)


def draw_whisker(
    panel: Axes, row: Any, ends: tuple[Any, Any, Any], color: str, marker: str = "o", **style: Any
) -> None:
    """A bar from the first to the last of three values, and a marker at the middle one; numbers or arrays."""
    low, middle, high = ends
    panel.hlines(row, low, high, color=color, lw=1.8)
    panel.plot(middle, row, marker, **{"color": color, "mec": "black", "mew": 0.6, "ms": 5, **style})


def legend_entry(label: str, color: str, marker: str = "", **style: Any) -> Line2D:
    """An entry of a legend: a line with a marker, as of `draw_whisker` unless the style says otherwise."""
    from matplotlib.lines import Line2D

    line_style = {"mec": "black", "mew": 0.6, "ms": 5, "lw": 1.8, **style}
    return Line2D([], [], label=label, color=color, marker=marker, **line_style)


def draw_legend(figure: Figure, n_columns: int, *more: Artist) -> None:
    """A legend at the foot of a figure: each label of its panels once, then further entries."""
    handles = {
        label: handle for panel in figure.axes for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    figure.legend(
        handles=[*handles.values(), *more], loc="lower center", ncols=n_columns, frameon=False, fontsize=SMALL_SIZE,
        borderaxespad=0.1, columnspacing=1.2, handletextpad=0.5, handlelength=1.6,
    )  # fmt: skip


def set_hertz_axis(panel: Axes, low: float, high: float) -> None:
    """A logarithmic frequency axis."""
    panel.set(xscale="log", xlim=(low, high), xlabel="Hz")
    ticks = [tick for tick in (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000) if low <= tick <= high]
    panel.set_xticks(ticks, [str(tick) for tick in ticks])
    panel.minorticks_off()


def draw_upright_names(panel: Axes, hertz: Sequence[float], names: Sequence[str], start: float, end: float) -> None:
    """Upright names at their frequencies, moved apart where they would overlap.

    A line leads from each frequency, at the height `start`, to its name at the height `end`, shares of the panel.
    """
    low, high = np.log(panel.get_xlim())
    order = np.argsort(hertz, kind="stable")
    true_places = (np.log(np.array(hertz)[order]) - low) / (high - low)
    in_axes: Any = {"transform": panel.transAxes}
    for place, true_place, i in zip(separate_places(true_places, _NAME_SPACING), true_places, order, strict=True):
        panel.plot([true_place, place], [start, end], color=DARK, lw=0.4, clip_on=False, **in_axes)
        side = "bottom" if end > start else "top"
        panel.text(place, end, names[i], rotation=90, ha="center", va=side, fontsize=SMALL_SIZE - 1.5, **in_axes)


def separate_places(desired_places: Floats, distance: float) -> Floats:
    """Places from 0 to 1, at least `distance` apart, near the desired places, which are in rising order."""
    places = desired_places.copy()
    for _ in range(2000):
        overlap = np.maximum(distance - np.diff(places), 0.0)
        if overlap.max(initial=0.0) < 1e-4:
            break
        places[:-1] -= 0.5 * overlap
        places[1:] += 0.5 * overlap
        places = np.clip(places, 0.0, 1.0)
    return places


def mathtext(text: str) -> str:
    """A text of the package with its symbols as matplotlib mathtext; not for texts of users."""
    return SYMBOL.sub(
        lambda match: f"${GREEK.get(match['letter'], ('', match['letter']))[1]}_{{{match['index']}}}$", text
    )


def is_symbol(name: str) -> bool:
    """Whether a name without its unit is a symbol of the package, so that it contains no text of a user."""
    return SYMBOL.fullmatch(name.partition(",")[0]) is not None


def shorten(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[: longest - 1] + "…"


def drawable_text(text: str) -> str:
    """A text from a card for a figure: characters without a glyph in the font become replacement characters."""
    glyphs = _glyphs()
    return "".join(c if ord(c) in glyphs else NO_GLYPH for c in strip_control_characters(text) if c not in JOINERS)


@lru_cache(maxsize=1)
def _glyphs() -> frozenset[int]:
    from matplotlib import font_manager

    return frozenset(font_manager.get_font(font_manager.findfont("DejaVu Sans")).get_charmap())
