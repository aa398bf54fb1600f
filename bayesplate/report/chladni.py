"""The sheet of Chladni figures: the nodal lines of the modes of a board, on one page to print."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.estimates.sheet import CombinedMode, Sheet, SheetMode, grid_points
from bayesplate.frequencies.system import WidthLimits
from bayesplate.planning.bench import Placing
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    SMALL_SIZE,
    TEXT_SIZE,
    VERMILLION,
    drawable_text,
    mathtext,
    place_panel,
)
from bayesplate.results.words import STIFFNESS_WORDS, STIFFNESS_WORDS_OF_ISOTROPIC, hertz_range, hertz_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

A4 = (8.27, 11.69)
"""Width and height of the page, inches."""

_MARGIN = 0.55
_HEAD, _FOOT = 0.95, 0.85
_BETWEEN = 0.62
_CAPTION = 0.42
_GAP = 0.30
_BAND = 0.055
_ROW_PADDING = 0.25
_LONGEST_HEADING = 62
_FEWEST_COLUMNS, _MOST_COLUMNS = 2, 4
_N_COMBINED = 3
_SAND_COLOUR, _LOW_COLOUR = "black", "0.86"


@dataclass(frozen=True)
class SheetLayout:
    """Layout of the page: columns and rows of modes, and the size of a panel and of its cell, inches."""

    n_columns: int
    n_rows: int
    panel: tuple[float, float]
    cell: tuple[float, float]


def sheet_layout(n_modes: int, aspect_ratio: float, *, has_combined: bool) -> SheetLayout:
    """The layout with the largest panels; `aspect_ratio` is length over width."""
    width = A4[0] - 2 * _MARGIN
    height = A4[1] - _HEAD - _FOOT - (_BETWEEN if has_combined else 0.0)
    candidates = []
    for n_columns in range(_N_COMBINED if has_combined else _FEWEST_COLUMNS, _MOST_COLUMNS + 1):
        n_rows = -(-n_modes // n_columns)
        cell = width / n_columns, height / (n_rows + has_combined)
        side = min(cell[0] - _GAP, (cell[1] - _CAPTION - _GAP) * aspect_ratio)
        candidates.append(SheetLayout(n_columns, n_rows, (side, side / aspect_ratio), cell))
    return max(candidates, key=lambda candidate: candidate.panel[0])


def chladni_sheet(sheet: Sheet, placing: Placing | None = None) -> Figure:
    """A sheet, A4 upright: a panel per mode, with sensor and hammer if they are placed, then the combined modes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=A4)
    layout = sheet_layout(len(sheet.modes), sheet.aspect_ratio, has_combined=bool(sheet.combined))
    if placing is not None:
        layout = _close_rows(layout)
    heading = f"{'Chladni figures' if placing is None else 'Modes to look for'}: {drawable_text(sheet.title)}"
    size = min(14.0, 14.0 * _LONGEST_HEADING / len(heading))
    _draw_text(figure, A4[0] / 2, A4[1] - 0.45, heading, fontsize=size, weight="bold")
    subtitle = f"setup: {sheet.setup}; {sheet.theory} plate; Hz {sheet.basis}"
    _draw_text(figure, A4[0] / 2, A4[1] - 0.72, subtitle, fontsize=9)
    top = A4[1] - _HEAD
    for i, mode in enumerate(sheet.modes):
        row, column = divmod(i, layout.n_columns)
        n_in_row = min(layout.n_columns, len(sheet.modes) - row * layout.n_columns)
        panel = _sheet_panel(figure, layout, _panel_left(layout, column, n_in_row), top - row * layout.cell[1], sheet)
        draw_sand(panel, mode.shape, sheet.limits)
        if placing is not None:
            _draw_placing(panel, placing, sheet)
        draw_caption(panel, *_mode_caption(mode))
    if sheet.combined:
        _draw_combined(figure, layout, sheet, top - layout.n_rows * layout.cell[1])
    _draw_legend(figure, sheet, placing)
    return figure


def _close_rows(layout: SheetLayout) -> SheetLayout:
    """A layout with the same panels, its rows as close as the captions allow."""
    height = min(layout.cell[1], layout.panel[1] + _CAPTION + _GAP + _ROW_PADDING)
    return replace(layout, cell=(layout.cell[0], height))


def _draw_placing(panel: Axes, placing: Placing, sheet: Sheet) -> None:
    style: Any = {"ls": "none", "clip_on": False, "zorder": 6, "mec": "black"}
    if placing.taps:
        panel.plot(
            *np.transpose([sheet.drawn_at(*tap) for tap in placing.taps]),
            ".",
            ms=4,
            **style | {"mfc": GREEN, "mec": GREEN},
        )
    panel.plot(*sheet.drawn_at(*placing.sensor), "o", ms=8, color=BLUE, mew=0.8, **style)
    panel.plot(*sheet.drawn_at(*placing.hammer), "X", ms=9, color=VERMILLION, mew=0.8, **style)


def _draw_combined(figure: Figure, layout: SheetLayout, sheet: Sheet, top: float) -> None:
    mixed_names = {name for mixture in sheet.combined for name in mixture.weights}
    are_measured = all(mode.measured_hz is not None for mode in sheet.modes if mode.name in mixed_names)
    kind = "measured" if are_measured else "lowest named"
    text = f"Mixtures of the {kind} modes that would each answer to one stiffness alone"
    _draw_text(figure, A4[0] / 2, top - 0.10, text, fontsize=9, weight="bold")
    text = "No board rings like this: the mixtures show where each stiffness is at work (darker: moves more)."
    _draw_text(figure, A4[0] / 2, top - 0.28, text, fontsize=8)
    wide_layout = replace(layout, cell=((A4[0] - 2 * _MARGIN) / _N_COMBINED, layout.cell[1]))
    names = STIFFNESS_WORDS_OF_ISOTROPIC if sheet.isotropic else STIFFNESS_WORDS
    for column, mixture in enumerate(sheet.combined):
        panel = _sheet_panel(
            figure, wide_layout, _panel_left(wide_layout, column, len(sheet.combined)), top - _BETWEEN + _GAP / 2, sheet
        )
        _draw_mixture(panel, mixture, sheet.limits)
        draw_caption(panel, mixture.name, f"{names[mixture.modulus]}, {mathtext(mixture.modulus)}")


def _panel_left(layout: SheetLayout, column: int, n_in_row: int) -> float:
    return A4[0] / 2 + (column - n_in_row / 2) * layout.cell[0] + (layout.cell[0] - layout.panel[0]) / 2


def _sheet_panel(figure: Figure, layout: SheetLayout, left: float, top: float, sheet: Sheet) -> Axes:
    """A panel of the sheet with the board and its edges."""
    return board_panel(figure, (left, top - _GAP / 2 - layout.panel[1]), layout.panel, sheet.edges, sheet.limits)


def board_panel(
    figure: Figure,
    corner: tuple[float, float],
    size: tuple[float, float],
    edges: Mapping[str, str],
    limits: WidthLimits | None,
) -> Axes:
    """Axes of a board from above, its sides from 0 to 1, with its edges drawn; corner and size in inches."""
    panel = place_panel(figure, *corner, *size)
    panel.set(xlim=(0, 1), ylim=(0, 1))
    panel.set_axis_off()
    for edge, word in edges.items():
        draw_edge(panel, edge, word, _BAND / size[edge[0] == "y"], limits)
    return panel


def draw_edge(panel: Axes, name: str, word: str, depth: float, limits: WidthLimits | None = None) -> None:
    """One edge: clamped hatched, supported dashed, free thin; `depth` of the hatching is a fraction of the side."""
    from matplotlib.patches import Rectangle

    along_y, at_end = name[0] == "x", name[1] == "1"
    x, low_y, high_y = _outline_points(limits)
    end = -1 if at_end else 0
    line: Any = ([at_end, at_end], [low_y[end], high_y[end]]) if along_y else (x, high_y if at_end else low_y)
    style = {"clamped": ("-", 1.0), "supported": ((0, (3, 2)), 1.4), "free": ("-", 0.6)}[word]
    panel.plot(*line, ls=style[0], lw=style[1], color="0.25", clip_on=False, zorder=4, label=f"edge {name} {word}")
    if word == "clamped":
        low = 1.0 if at_end else -depth
        box = ((low, line[1][0]), depth, line[1][1] - line[1][0]) if along_y else ((0.0, low), 1.0, depth)
        hatched = Rectangle(*box, hatch="//////", facecolor="none", edgecolor="0.45", lw=0.0, clip_on=False)
        panel.add_patch(hatched)


def _outline_points(limits: WidthLimits | None) -> tuple[Floats, Floats, Floats]:
    """The outline of a board: points along the length, and the ends of the board along y there."""
    if limits is None:
        return np.array([0.0, 1.0]), np.zeros(2), np.ones(2)
    x = grid_points(len(limits[0]))
    x[[0, -1]] = 0.0, 1.0
    return x, *limits


def _shape_points(n: int, limits: WidthLimits | None) -> tuple[Floats, Floats]:
    """Points x and y, (n, n) arrays, at which a shape of n by n points is drawn."""
    x, y = np.meshgrid(grid_points(n), grid_points(n), indexing="ij")
    if limits is None:
        return x, y
    low, high = (limit[:, None] for limit in limits)
    return x, low + y * (high - low)


def draw_sand(panel: Axes, shape: Floats, limits: WidthLimits | None = None) -> None:
    """Nodal lines in black; the parts of negative displacement are grey."""
    grid = _shape_points(len(shape), limits)
    panel.contourf(*grid, shape, levels=[-np.inf, 0.0, np.inf], colors=[_LOW_COLOUR, "white"])
    panel.contour(*grid, shape, levels=[0.0], colors=_SAND_COLOUR, linewidths=1.8)


def _draw_mixture(panel: Axes, mixture: CombinedMode, limits: WidthLimits | None) -> None:
    """Nodal lines on grey, the darker the larger the displacement."""
    grid = _shape_points(len(mixture.shape), limits)
    largest = np.abs(mixture.shape).max()
    levels = [0.0, 0.1, 0.3, 0.5, 0.7, 1.0]
    greys = ["1.0", "0.92", "0.82", "0.72", "0.60"]
    panel.contourf(*grid, np.abs(mixture.shape) / largest, levels=levels, colors=greys, extend="max")
    panel.contour(*grid, mixture.shape, levels=[0.0], colors=_SAND_COLOUR, linewidths=1.4)


def _mode_caption(mode: SheetMode) -> tuple[str, str]:
    name = mode.name if mode.name.startswith("(") else "no clear name"
    first_line = f"{name}   {hertz_text(mode.hertz)} Hz"
    if mode.measured_hz is not None:
        return first_line, f"measured {mode.measured_hz:.5g} Hz"
    if mode.band_hz is not None:
        return first_line, f"likely {hertz_range(*mode.band_hz)} Hz"
    return first_line, "not measured"


def draw_caption(panel: Axes, first: str, *others: str) -> None:
    """Lines of text below a panel, clear of a clamped edge, the first one bold."""
    common: Any = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "va": "top"}
    panel.annotate(first, (0.5, 0.0), (0, -6), fontsize=TEXT_SIZE, weight="bold", **common)
    for i, line in enumerate(others):
        panel.annotate(line, (0.5, 0.0), (0, -18 - 10 * i), fontsize=SMALL_SIZE, color=DARK, **common)


def _draw_legend(figure: Figure, sheet: Sheet, placing: Placing | None) -> None:
    line_styles = {"clamped": "hatched", "supported": "dashed", "free": "thin"}
    edges = ", ".join(f"{line_styles[word]} = {word}" for word in dict.fromkeys(sheet.edges.values()))
    along, begins = ("x", "x") if sheet.isotropic else ("the grain", "The grain")
    lines = (
        f"Edges: {edges}. {begins} runs from left to right.",
        "Black lines stay at rest, sand gathers there; white and grey parts move against each other.",
        f"A name counts the lines crossed on the way along {along}, then on the way across it; "
        f"here the counts begin at {sheet.first_label}.",
    )
    notes = [f"Likely: two times in three, {sheet.likely}."] if sheet.likely else []
    if placing is not None:
        notes.append("Disc: the sensor. Cross: the hammer. Small dots: tap there to tell the figures apart.")
    for i, line in enumerate((*lines, *notes)):
        _draw_text(figure, A4[0] / 2, 0.68 - 0.15 * i, line, fontsize=8)


def _draw_text(figure: Figure, x: float, y: float, text: str, **style: Any) -> None:
    """A centred line of text at a place in inches; dollar signs are not read as mathtext."""
    figure.text(x / A4[0], y / A4[1], text, ha="center", va="center", parse_math=False, **style)
