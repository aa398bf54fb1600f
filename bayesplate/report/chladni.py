"""The sheet of Chladni figures: where sand gathers on a board at each of its modes, on one page to print."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.estimates.sheet import CombinedMode, Sheet, SheetMode, points
from bayesplate.frequencies.system import Limits
from bayesplate.planning.bench import Placing
from bayesplate.report.style import BLUE, DARK, GREEN, SMALL, VERMILLION, WORDS, drawable, in_figure, placed
from bayesplate.results.words import STIFFNESS, STIFFNESS_OF_ISOTROPIC

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
_AIR = 0.25
_LONGEST_HEADING = 62
_FEWEST_COLUMNS, _MOST_COLUMNS = 2, 4
_N_COMBINED = 3
_SAND, _LOW = "black", "0.86"


@dataclass(frozen=True)
class Layout:
    """How the page is divided: columns and rows of modes, and the size of a panel and of its cell, inches."""

    n_columns: int
    n_rows: int
    panel: tuple[float, float]
    cell: tuple[float, float]


def layout(n_modes: int, aspect_ratio: float, *, has_combined: bool) -> Layout:
    """The division of the page that makes the panels largest; `aspect_ratio` is length over width."""
    width = A4[0] - 2 * _MARGIN
    height = A4[1] - _HEAD - _FOOT - (_BETWEEN if has_combined else 0.0)
    found = []
    for n_columns in range(_N_COMBINED if has_combined else _FEWEST_COLUMNS, _MOST_COLUMNS + 1):
        n_rows = -(-n_modes // n_columns)
        cell = width / n_columns, height / (n_rows + has_combined)
        side = min(cell[0] - _GAP, (cell[1] - _CAPTION - _GAP) * aspect_ratio)
        found.append(Layout(n_columns, n_rows, (side, side / aspect_ratio), cell))
    return max(found, key=lambda one: one.panel[0])


def chladni_sheet(sheet: Sheet, placing: Placing | None = None) -> Figure:
    """A sheet, A4 upright: a panel for each mode, where sensor and hammer go on each, then the combined modes."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=A4)
    plan = layout(len(sheet.modes), sheet.aspect_ratio, has_combined=bool(sheet.combined))
    if placing is not None:
        plan = _close(plan)
    heading = f"{'Chladni figures' if placing is None else 'Modes to look for'}: {drawable(sheet.title)}"
    size = min(14.0, 14.0 * _LONGEST_HEADING / len(heading))
    _text(figure, A4[0] / 2, A4[1] - 0.45, heading, fontsize=size, weight="bold")
    held = f"setup: {sheet.setup}; {sheet.theory} plate; Hz {sheet.basis}"
    _text(figure, A4[0] / 2, A4[1] - 0.72, held, fontsize=9)
    top = A4[1] - _HEAD
    for i, mode in enumerate(sheet.modes):
        row, column = divmod(i, plan.n_columns)
        in_row = min(plan.n_columns, len(sheet.modes) - row * plan.n_columns)
        panel = _panel(figure, plan, _left(plan, column, in_row), top - row * plan.cell[1], sheet)
        draw_sand(panel, mode.shape, sheet.limits)
        if placing is not None:
            _draw_placing(panel, placing, sheet)
        caption(panel, *_mode_caption(mode))
    if sheet.combined:
        _draw_combined(figure, plan, sheet, top - plan.n_rows * plan.cell[1])
    _legend(figure, sheet, placing)
    return figure


def _close(plan: Layout) -> Layout:
    """A layout with the same panels and no more room below each than its caption takes."""
    height = min(plan.cell[1], plan.panel[1] + _CAPTION + _GAP + _AIR)
    return replace(plan, cell=(plan.cell[0], height))


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


def _draw_combined(figure: Figure, plan: Layout, sheet: Sheet, top: float) -> None:
    mixed = {name for one in sheet.combined for name in one.weights}
    are_measured = all(mode.measured_hz is not None for mode in sheet.modes if mode.name in mixed)
    which = "measured" if are_measured else "lowest named"
    told = f"Mixtures of the {which} modes that would each answer to one stiffness alone"
    _text(figure, A4[0] / 2, top - 0.10, told, fontsize=9, weight="bold")
    told = "No board rings like this: the mixtures show where each stiffness is at work (darker: moves more)."
    _text(figure, A4[0] / 2, top - 0.28, told, fontsize=8)
    wide = replace(plan, cell=((A4[0] - 2 * _MARGIN) / _N_COMBINED, plan.cell[1]))
    names = STIFFNESS_OF_ISOTROPIC if sheet.isotropic else STIFFNESS
    for column, one in enumerate(sheet.combined):
        panel = _panel(figure, wide, _left(wide, column, len(sheet.combined)), top - _BETWEEN + _GAP / 2, sheet)
        _draw_mixture(panel, one, sheet.limits)
        caption(panel, one.name, f"{names[one.modulus]}, {in_figure(one.modulus)}")


def _left(plan: Layout, column: int, in_row: int) -> float:
    return A4[0] / 2 + (column - in_row / 2) * plan.cell[0] + (plan.cell[0] - plan.panel[0]) / 2


def _panel(figure: Figure, plan: Layout, left: float, top: float, sheet: Sheet) -> Axes:
    """A place of the sheet with the board and its edges."""
    return board_panel(figure, (left, top - _GAP / 2 - plan.panel[1]), plan.panel, sheet.edges, sheet.limits)


def board_panel(
    figure: Figure,
    corner: tuple[float, float],
    size: tuple[float, float],
    edges: Mapping[str, str],
    limits: Limits | None,
) -> Axes:
    """Axes of a board from above, its sides from 0 to 1, with its edges drawn; corner and size in inches."""
    panel = placed(figure, *corner, *size)
    panel.set(xlim=(0, 1), ylim=(0, 1))
    panel.set_axis_off()
    for edge, word in edges.items():
        draw_edge(panel, edge, word, _BAND / size[edge[0] == "y"], limits)
    return panel


def draw_edge(panel: Axes, name: str, word: str, depth: float, limits: Limits | None = None) -> None:
    """One edge: clamped hatched, supported dashed, free thin; `depth` of the hatching as a fraction of the side."""
    from matplotlib.patches import Rectangle

    along_y, at_end = name[0] == "x", name[1] == "1"
    x, low_y, high_y = _outline(limits)
    end = -1 if at_end else 0
    line: Any = ([at_end, at_end], [low_y[end], high_y[end]]) if along_y else (x, high_y if at_end else low_y)
    style = {"clamped": ("-", 1.0), "supported": ((0, (3, 2)), 1.4), "free": ("-", 0.6)}[word]
    panel.plot(*line, ls=style[0], lw=style[1], color="0.25", clip_on=False, zorder=4, label=f"edge {name} {word}")
    if word == "clamped":
        low = 1.0 if at_end else -depth
        box = ((low, line[1][0]), depth, line[1][1] - line[1][0]) if along_y else ((0.0, low), 1.0, depth)
        hatched = Rectangle(*box, hatch="//////", facecolor="none", edgecolor="0.45", lw=0.0, clip_on=False)
        panel.add_patch(hatched)


def _outline(limits: Limits | None) -> tuple[Floats, Floats, Floats]:
    """Points along the length, from end to end, and where the board begins and ends along y there."""
    if limits is None:
        return np.array([0.0, 1.0]), np.zeros(2), np.ones(2)
    x = points(len(limits[0]))
    x[[0, -1]] = 0.0, 1.0
    return x, *limits


def _places(n: int, limits: Limits | None) -> tuple[Floats, Floats]:
    """Points x and y, (n, n) arrays, at which a shape of n by n points is drawn."""
    x, y = np.meshgrid(points(n), points(n), indexing="ij")
    if limits is None:
        return x, y
    low, high = (limit[:, None] for limit in limits)
    return x, low + y * (high - low)


def draw_sand(panel: Axes, shape: Floats, limits: Limits | None = None) -> None:
    """Nodal lines in black; the parts that move down while the others move up are grey."""
    at = _places(len(shape), limits)
    panel.contourf(*at, shape, levels=[-np.inf, 0.0, np.inf], colors=[_LOW, "white"])
    panel.contour(*at, shape, levels=[0.0], colors=_SAND, linewidths=1.8)


def _draw_mixture(panel: Axes, one: CombinedMode, limits: Limits | None) -> None:
    """Nodal lines on a grey ground that is darker the more the board moves."""
    at = _places(len(one.shape), limits)
    largest = np.abs(one.shape).max()
    levels = [0.0, 0.1, 0.3, 0.5, 0.7, 1.0]
    greys = ["1.0", "0.92", "0.82", "0.72", "0.60"]
    panel.contourf(*at, np.abs(one.shape) / largest, levels=levels, colors=greys, extend="max")
    panel.contour(*at, one.shape, levels=[0.0], colors=_SAND, linewidths=1.4)


def _mode_caption(mode: SheetMode) -> tuple[str, str]:
    name = mode.name if mode.name.startswith("(") else "no clear name"
    first = f"{name}   {_hertz(mode.hertz)} Hz"
    if mode.measured_hz is not None:
        return first, f"measured {mode.measured_hz:.5g} Hz"
    if mode.band_hz is not None:
        return first, f"likely {_hertz(mode.band_hz[0])} to {_hertz(mode.band_hz[1])} Hz"
    return first, "not measured"


def _hertz(value: float) -> str:
    return f"{value:.1f}" if value < 100 else f"{value:.0f}"


def caption(panel: Axes, first: str, *others: str) -> None:
    """Lines below a panel, clear of a clamped edge, the first one bold."""
    common: Any = {"xycoords": "axes fraction", "textcoords": "offset points", "ha": "center", "va": "top"}
    panel.annotate(first, (0.5, 0.0), (0, -6), fontsize=WORDS, weight="bold", **common)
    for i, line in enumerate(others):
        panel.annotate(line, (0.5, 0.0), (0, -18 - 10 * i), fontsize=SMALL, color=DARK, **common)


def _legend(figure: Figure, sheet: Sheet, placing: Placing | None) -> None:
    drawn = {"clamped": "hatched", "supported": "dashed", "free": "thin"}
    edges = ", ".join(f"{drawn[word]} = {word}" for word in dict.fromkeys(sheet.edges.values()))
    along, begins = ("x", "x") if sheet.isotropic else ("the grain", "The grain")
    lines = (
        f"Edges: {edges}. {begins} runs from left to right.",
        "Black lines stay at rest, sand gathers there; white and grey parts move against each other.",
        f"A name counts the lines crossed on the way along {along}, then on the way across it; "
        f"here the counts begin at {sheet.first_label}.",
    )
    told = [f"Likely: two times in three, {sheet.likely}."] if sheet.likely else []
    if placing is not None:
        told.append("Disc: the sensor. Cross: the hammer. Small dots: tap there to tell the figures apart.")
    for i, line in enumerate((*lines, *told)):
        _text(figure, A4[0] / 2, 0.68 - 0.15 * i, line, fontsize=8)


def _text(figure: Figure, x: float, y: float, text: str, **style: Any) -> None:
    """A centred line at a place in inches; a user's dollar signs stay as they are."""
    figure.text(x / A4[0], y / A4[1], text, ha="center", va="center", parse_math=False, **style)
