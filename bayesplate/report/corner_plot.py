"""The corner plot, by the package corner: every pair of quantities, for the page and for scripts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI
from bayesplate.libraries import load_arviz
from bayesplate.posterior.draws import Draws
from bayesplate.report.posterior import input_words
from bayesplate.report.saving import matplotlib_defaults, save_figure
from bayesplate.report.style import (
    BLACK,
    FIGURE_WIDTH,
    ORANGE,
    POSTERIOR_COLOUR,
    SMALL_SIZE,
    Picture,
    axis_range,
    is_symbol,
    mathtext,
    shorten,
)
from bayesplate.results.budget import input_shares
from bayesplate.results.words import GPA

if TYPE_CHECKING:
    from matplotlib.figure import Figure


MOST_COLUMNS = 6
"""Columns of the corner plot of a report; more cannot be read on a phone."""

_CONTOUR_LEVELS = (0.5, 0.9)
_LEFT, _BOTTOM, _TOP, _RIGHT, _GAP = 0.72, 0.72, 0.08, 0.12, 0.07
_TICK_RANGE = np.array([[0.92, 0.08], [0.08, 0.92]])
"""Range of the ticks of a panel, from its ends: tick labels of adjacent panels do not overlap."""
_STRONG_CORRELATION = 0.5
_CHARACTERS_AN_INCH = 17
_BRIEF_NAMES = {
    "length along the grain": "length",
    "length across the grain": "width",
    " profile": "",
    " of transverse shear": "",
    "Poisson ratio ": "",
}


def corner_figure(
    columns: Mapping[str, Floats], marked: Mapping[str, float | None] | None = None, labels: Sequence[str] | None = None
) -> Figure:
    """Every pair of columns of draws against each other; the contours hold half and nine tenths of the draws.

    The names of the columns are their axis labels, unless `labels` are given; values of `marked`, by the same names,
    get a line.
    """
    load_arviz()  # before corner imports it, to suppress its warnings
    import corner
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    marks = [(marked or {}).get(name) for name in columns]
    ranges = [
        axis_range(values, () if mark is None else [mark]) for values, mark in zip(columns.values(), marks, strict=True)
    ]
    side = panel_side(len(columns))
    width = _LEFT + len(columns) * (side + _GAP) - _GAP + _RIGHT
    height = width - _LEFT - _RIGHT + _BOTTOM + _TOP
    figure = Figure(figsize=(width, height))
    with rc_context({"axes.formatter.useoffset": False}):
        corner.corner(
            np.column_stack([np.ravel(values) for values in columns.values()]),
            fig=figure,
            labels=list(labels or columns),
            label_kwargs={"fontsize": SMALL_SIZE - 1},
            labelpad=0.42 / side - 0.3,  # of corner's own 0.3 sides
            range=ranges,
            bins=40,
            smooth=1.6,
            levels=_CONTOUR_LEVELS,
            color=POSTERIOR_COLOUR,
            fill_contours=True,
            no_fill_contours=True,
            plot_datapoints=False,
            plot_density=False,
            contour_kwargs={"colors": BLACK, "linewidths": 0.7},
            hist_kwargs={"histtype": "stepfilled", "alpha": 0.4},
            truths=marks if len(marks) > 1 else None,
            truth_color=ORANGE,
            max_n_ticks=int(np.clip(4 * side, 3, 5)),
            quiet=True,
        )
    figure.subplots_adjust(
        left=_LEFT / width, right=1 - _RIGHT / width, bottom=_BOTTOM / height, top=1 - _TOP / height,
        wspace=_GAP / side, hspace=_GAP / side,
    )  # fmt: skip
    for panel in figure.axes:
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(labelsize=SMALL_SIZE - 1.5, labelrotation=45, length=3)
        for axis in (panel.xaxis, panel.yaxis):
            low, high = np.sort(axis.get_view_interval()) @ _TICK_RANGE
            ticks = axis.get_major_locator().tick_values(low, high)
            axis.set_ticks([tick for tick in ticks if low <= tick <= high])
    if len(marks) == 1 and marks[0] is not None:  # which corner marks in pairs only
        figure.axes[0].axvline(marks[0], color=ORANGE)
    return figure


@matplotlib_defaults()
def write_corner_plot(
    path: Path, columns: Mapping[str, Floats], marked: Mapping[str, float | None] | None = None
) -> None:
    save_figure(corner_figure(columns, marked), path)


def corner_picture(draws: Draws) -> Picture:
    """The constants, the noise and the inputs that matter most against each other."""
    columns = corner_columns(draws)
    alt = f"Draws in pairs of {', '.join(name.partition(',')[0] for name in columns)}. {_correlation_sentence(columns)}"
    caption = (
        "Each square shows two quantities at once; the lines hold half and nine tenths of the probability. A slanted "
        "shape means that an error in one would be made up for by the other."
    )
    figure = corner_figure(columns, labels=axis_labels(list(columns)))
    return Picture("corner", "Which quantities hang together", alt, caption, figure)


def panel_side(n_columns: int) -> float:
    """Side of a panel in inches: up to `MOST_COLUMNS` the figure has the width of the others of a report."""
    n = min(n_columns, MOST_COLUMNS)
    return (FIGURE_WIDTH - _LEFT - _RIGHT - (n - 1) * _GAP) / n


def axis_labels(names: Sequence[str]) -> list[str]:
    """Axis labels of columns, in two lines where there is no room for one."""
    return [axis_label(name, panel_side(len(names))) for name in names]


def axis_label(name: str, side: float) -> str:
    """A name and its unit, in lines no longer than the side of a panel in inches.

    A symbol of the package is set as mathtext, nothing else is.
    """
    for words, brief in _BRIEF_NAMES.items():
        name = name.replace(words, brief)
    longest = int(_CHARACTERS_AN_INCH * side)
    first, comma, below = name.rpartition(", ") if ", " in name else name.partition(" of ")
    if len(name) > longest:
        name = f"{shorten(first, longest)}{',' if comma else ''}\n{shorten(below, longest)}".strip()
    return mathtext(name) if is_symbol(first) else name.replace("$", r"\$")


def corner_columns(draws: Draws) -> dict[str, Floats]:
    """Moduli in GPa, the noise of each setup in %, and the inputs with the largest share in the moduli's variance."""
    columns, board = {f"{name}, GPa": values * GPA for name, values in draws.moduli.items()}, draws.problem.board
    setups = board.setups
    for i, setup in enumerate(setups[: MOST_COLUMNS - len(columns) - 1]):
        columns["noise, %" if len(setups) == 1 else f"noise {setup.name}, %"] = 100.0 * draws.noise[..., i]
    shares = input_shares(draws)
    largest_share = {name: max(by_input[name] for by_input in shares.values()) for name in draws.inputs}
    inputs = [parameter.name for parameter in board.uncertain if parameter.is_listed]
    for name in sorted(inputs, key=lambda name: -largest_share[name])[: MOST_COLUMNS - len(columns)]:
        words, factor = words_and_factor(name, board)
        columns[words] = draws.inputs[name] * factor
    return columns


def words_and_factor(name: str, board: Board) -> tuple[str, float]:
    """Axis label of a modulus, a rigidity or an input, and the factor from SI to its unit."""
    if name not in board.inputs:
        return (f"{name}, GPa", GPA) if name in MODULI else (f"{name}, N m", 1.0)
    words, factor, unit = input_words(board.parameter(name), board)
    return f"{words}, {unit}" if unit else words, factor


def _correlation_sentence(columns: Mapping[str, Floats]) -> str:
    names = [name.partition(",")[0] for name in columns]
    matrix = np.corrcoef([values.ravel() for values in columns.values()])
    strong_pairs = [(i, j) for i in range(len(names)) for j in range(i) if abs(matrix[i, j]) > _STRONG_CORRELATION]
    details = "; ".join(f"{names[j]} with {names[i]} ({matrix[i, j]:+.2f})" for i, j in strong_pairs)
    return f"Correlated: {details}." if strong_pairs else "No pair hangs together strongly."
