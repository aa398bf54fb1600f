"""The figure of the board: outline to scale, edges, grain, hammer and sensors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values, vibrating_lengths
from bayesplate.board.setup import Setup
from bayesplate.board.words import EDGES
from bayesplate.frequencies.system import System, system_of
from bayesplate.report.style import (
    DARK,
    FIGURE_WIDTH,
    GREY,
    LIGHT,
    SMALL_SIZE,
    TEXT_SIZE,
    VERMILLION,
    Picture,
    place_panel,
    shorten,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_WIDEST, _TALLEST = 3.1, 3.6
_LEFT, _ABOVE, _BELOW = 0.85, 0.42, 0.62
_HATCH = 0.10
_HEADING = 0.14
_LEGEND = 0.3
_N_GRAIN = 13
_N_POINTS = 201
_BEND_HEIGHT = 0.12
"""Height at which the largest rise is drawn, as a share of the shorter side."""
_EDGE_LINES = {"clamped": ("-", 1.6), "supported": ((0, (4, 3)), 1.6), "free": ("-", 0.9)}
_MARKERS = {"accelerometer": "s", "exciter": "D", "shaker": "D", "weight": "p", "hammer": "X"}
_MARKER_STYLE: Any = {"ls": "none", "ms": 7, "mec": "black", "mew": 0.8, "clip_on": False, "zorder": 6}


def board_picture(board: Board) -> Picture:
    """A board in each of its setups, from above."""
    from matplotlib.figure import Figure

    values = board.nominal()
    outlines = [_drawn_outline(system_of(board, setup), values) for setup in board.setups]
    length, width = float(values["length_x"]), max(outline.width for outline in outlines)
    scale = min(_WIDEST / length, _TALLEST / width)
    above = _ABOVE + (_HEADING if len(board.setups) > 1 else 0.0)
    row_height = above + width * scale + _BELOW
    has_items = any(setup.hammer or any(item.places for item in setup.attached) for setup in board.setups)
    has_legend = has_items or _is_warped(board)
    height = row_height * len(board.setups) + (
        _LEGEND * (2 if has_items and _is_warped(board) else 1) if has_legend else 0.0
    )
    figure = Figure(figsize=(FIGURE_WIDTH, height))
    handles: dict[str, Any] = {}
    for i, (setup, outline) in enumerate(zip(board.setups, outlines, strict=True)):
        size = (length * scale, width * scale)
        left = _LEFT + (FIGURE_WIDTH - _LEFT - 0.55 - size[0]) / 2
        bottom = height - i * row_height - above - size[1]
        panel = place_panel(figure, left, bottom, *size)
        panel.set(xlim=(0, length), ylim=(0, width))
        panel.set_axis_off()
        if not board.isotropic:
            _draw_grain(panel, outline)
        _draw_board(panel, setup, outline, values, scale, _length_direction(board))
        if len(board.setups) > 1:
            heading = (length / 2, width + 0.3 / scale)
            panel.text(
                *heading, shorten(setup.name, 44), ha="center", fontsize=TEXT_SIZE, weight="bold", parse_math=False
            )
        handles |= _draw_items(panel, setup, outline) | _draw_warp(panel, board, length, outline.width)
    if handles:
        figure.legend(
            handles=list(handles.values()), loc="lower center", ncols=3, frameon=False, fontsize=SMALL_SIZE,
            handletextpad=0.4,
        )  # fmt: skip
    sentences = {
        _VIEW_NOTE: True,
        _GRAIN_NOTE: not board.isotropic,
        _EDGES_NOTE: True,
        _OUTLINE_NOTE: not all(outline.is_rectangle for outline in outlines),
        _WARP_NOTE: _is_warped(board),
    }
    caption = " ".join(text for text, applies in sentences.items() if applies)
    return Picture("board", "The board, drawn to scale", _alt_text(board, values, outlines), caption, figure)


_VIEW_NOTE = "Seen from above, drawn to scale."
_GRAIN_NOTE = "The fine lines run along the grain."
_EDGES_NOTE = "Hatched: held by a clamp; dashed: resting on a support; thin: free."
_OUTLINE_NOTE = (
    "The outline is what the readings of the width make probable. Which edge recedes they do not say: where both are "
    "free, both are drawn to recede alike."
)
_WARP_NOTE = (
    "Red: how far the board is from flat where a straightedge lies along it and across it, drawn larger than it is; "
    "a filled corner lifts off the table."
)


@dataclass(frozen=True, eq=False)
class _DrawnOutline:
    """The outline of a whole board, clamped parts included: its ends along y at points x, m."""

    x: Floats
    low: Floats
    high: Floats
    is_rectangle: bool

    @property
    def width(self) -> float:
        return float(self.high.max())

    def at(self, x: Floats) -> tuple[Floats, Floats]:
        """Ends along y at points x, m; beyond the length of the board as at its ends."""
        return np.interp(x, self.x, self.low), np.interp(x, self.x, self.high)

    def across(self) -> str:
        narrowest, widest = (f"{extreme((self.high - self.low) * 1e3):.4g}" for extreme in (np.min, np.max))
        return f"{widest} mm across" if self.is_rectangle else f"{narrowest} to {widest} mm across"


def _drawn_outline(system: System, values: Values) -> _DrawnOutline:
    """The outline of a board in the model of a setup."""
    x = np.linspace(0.0, float(values["length_x"]), _N_POINTS)
    adjusted = system.adjusted(values)
    length, width = (float(side) for side in vibrating_lengths(adjusted, system.setup))
    start = float(values[system.setup.input_name("x0")]) if "x0" in system.setup.clamped else 0.0
    limits = system.limits((x - start) / length)
    low, high = limits or (np.zeros_like(x), np.ones_like(x))
    return _DrawnOutline(x, low * width, float(adjusted["length_y"]) - (1.0 - high) * width, limits is None)


def _draw_grain(panel: Axes, outline: _DrawnOutline) -> None:
    for y in np.linspace(0, outline.width, _N_GRAIN + 2)[1:-1]:
        within = (outline.low <= y) & (y <= outline.high)
        panel.plot(outline.x, np.where(within, y, np.nan), color=LIGHT, lw=0.7, zorder=1)


def _draw_board(panel: Axes, setup: Setup, outline: _DrawnOutline, values: Values, scale: float, along: str) -> None:
    length, width = float(values["length_x"]), outline.width
    covered = {edge: float(values[setup.input_name(edge)]) for edge in setup.clamped}
    low_x, high_x = covered.get("x0", 0.0), length - covered.get("x1", 0.0)
    low_y, high_y = covered.get("y0", 0.0), width - covered.get("y1", 0.0)
    free = (low_x, high_x, low_y, high_y)
    for edge in EDGES:
        _draw_edge(panel, edge, setup.edges[edge], covered.get(edge, 0.0), free, outline, scale)
    around = np.concatenate([outline.x, outline.x[::-1], [0.0]])
    panel.plot(around, np.concatenate([outline.low, outline.high[::-1], outline.low[:1]]), color=GREY, lw=0.7,
               clip_on=False, zorder=2)  # fmt: skip
    across = 0.34 / scale
    _dimension(panel, (0, -across), (length, -across), f"{length * 1e3:.4g} mm, {along}", below=True)
    _dimension(panel, (-across, 0), (-across, width), outline.across(), below=False)


def _draw_edge(
    panel: Axes,
    edge: str,
    word: str,
    covered: float,
    free: tuple[float, float, float, float],
    outline: _DrawnOutline,
    scale: float,
) -> None:
    """An edge: the line where the vibrating part ends, hatching if it is clamped, and the word for its support."""
    from matplotlib.patches import Polygon

    length, width = float(outline.x[-1]), outline.width
    low_x, high_x, low_y, high_y = free
    position = {"x0": low_x, "x1": high_x, "y0": low_y, "y1": high_y}[edge]
    along = np.array([position, position]) if edge[0] == "x" else np.unique(np.clip(outline.x, low_x, high_x))
    low, high = outline.at(along)
    low, high = low + low_y, high - (width - high_y)
    line = (along, np.array([low[0], high[0]]) if edge[0] == "x" else low if edge == "y0" else high)
    style, thickness = _EDGE_LINES[word]
    panel.plot(*line, ls=style, lw=thickness, color="black", clip_on=False, zorder=4, label=f"edge {edge} {word}")
    band = max(covered, _HATCH / scale)
    start = position - band if edge[1] == "0" else position
    if word == "clamped":
        if edge[0] == "x":
            across = start + band * np.linspace(0.0, 1.0, _N_POINTS)
            low, high = outline.at(across)
            corners = np.column_stack([[*across, *across[::-1]], [*low, *high[::-1]]])
        else:
            corners = np.array([[0.0, start], [length, start], [length, start + band], [0.0, start + band]])
        panel.add_patch(
            Polygon(corners, hatch="/////", facecolor="none", edgecolor=GREY, lw=0.0, clip_on=False, zorder=3)
        )
    offset = 0.05 / scale + (0.0 if covered or word != "clamped" else band)
    label = f"{word}, {covered * 1e3:.3g} mm" if covered else word
    places = {
        "x0": (-offset, width / 2, 90, "right", "center"),
        "x1": (length + offset, width / 2, 90, "left", "center"),
        "y0": (length / 2, -offset, 0, "center", "top"),
        "y1": (length / 2, width + offset, 0, "center", "bottom"),
    }
    x, y, rotation, ha, va = places[edge]
    panel.text(x, y, label, rotation=rotation, ha=ha, va=va, fontsize=SMALL_SIZE, color=DARK, rotation_mode="default")


def _dimension(panel: Axes, start: tuple[float, float], end: tuple[float, float], text: str, *, below: bool) -> None:
    """A double arrow and its length in words."""
    arrow: Any = {"arrowstyle": "<|-|>", "lw": 0.7, "color": DARK, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 7}
    panel.annotate("", start, end, arrowprops=arrow, annotation_clip=False)
    middle = ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2)
    offset, rotation = ((0, -4), 0) if below else ((-4, 0), 90)
    ha, va = ("center", "top") if below else ("right", "center")
    panel.annotate(
        text, middle, offset, textcoords="offset points", ha=ha, va=va, rotation=rotation, fontsize=TEXT_SIZE,
        annotation_clip=False,
    )  # fmt: skip


def _draw_items(panel: Axes, setup: Setup, outline: _DrawnOutline) -> dict[str, Any]:
    """Hammer and attached items at their places from the corner of x0 and y0; legend handles by name."""
    corner = outline.low[0]
    places: dict[str, list[tuple[float, float]]] = {}
    for item in setup.attached:
        places.setdefault(item.kind, []).extend(item.places)
    if setup.hammer is not None:
        places["hammer"] = [setup.hammer]
    handles: dict[str, Any] = {}
    for kind, positions in places.items():
        if positions:
            x, y = np.transpose(positions)
            face = "white" if kind == "hammer" else VERMILLION
            handles[kind] = panel.plot(x, y + corner, marker=_MARKERS[kind], label=kind, mfc=face, **_MARKER_STYLE)[0]
    return handles


def _is_warped(board: Board) -> bool:
    return any(rise.mean for rise in board.warp.values())


def _draw_warp(panel: Axes, board: Board, length: float, width: float) -> dict[str, Any]:
    """The measured warp, as bent lines through the middle and a lifted corner; legend handles by name."""
    rises = {name: rise.mean for name, rise in board.warp.items() if rise.mean}
    bends = {name: rise for name, rise in rises.items() if name != "twist"}
    handles: dict[str, Any] = {}
    if bends:
        largest = max(abs(rise) for rise in bends.values())
        magnification = float(f"{_BEND_HEIGHT * min(length, width) / largest:.1g}")
        s = np.linspace(0.0, 1.0, _N_POINTS)
        arch = magnification * 4.0 * s * (1.0 - s)
        lines = {"cup": (length / 2 + arch * bends.get("cup", 0.0), width * s)}
        lines["bow"] = (length * s, width / 2 + arch * bends.get("bow", 0.0))
        for name, style in (("cup", (0, (4, 2))), ("bow", (0, (1, 1.5)))):
            if name in bends:
                label = f"{name} {bends[name] * 1e3:.3g} mm"
                handles[name] = panel.plot(*lines[name], color=VERMILLION, lw=1.3, ls=style, label=label, zorder=5)[0]
    if "twist" in rises:
        label = f"twist {rises['twist'] * 1e3:.3g} mm"
        marker = {**_MARKER_STYLE, "ms": 8, "marker": "^", "mfc": VERMILLION}
        handles["twist"] = panel.plot([length], [width], label=label, **marker)[0]
    return handles


def _length_direction(board: Board) -> str:
    return "along x" if board.isotropic else "along the grain"


def _alt_text(board: Board, values: Values, outlines: Sequence[_DrawnOutline]) -> str:
    size = f"{float(values['length_x']) * 1e3:.4g} mm {_length_direction(board)}, {outlines[0].across()}"
    setup_texts = []
    for setup in board.setups:
        words = ", ".join(f"{edge} {word}" for edge, word in setup.edges.items())
        free = " by ".join(f"{float(side) * 1e3:.4g}" for side in vibrating_lengths(values, setup))
        setup_texts.append(f"setup {setup.name}: {words}; the part that vibrates is {free} mm")
    kind = "rectangular board" if all(outline.is_rectangle for outline in outlines) else "board whose width varies"
    rises = ", ".join(f"{name} {rise.mean * 1e3:.3g} mm" for name, rise in board.warp.items() if rise.mean)
    return ". ".join([f"A {kind}, {size}", *setup_texts, *([f"Not flat: {rises}"] if rises else [])]) + "."
