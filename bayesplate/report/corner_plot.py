"""The corner plot of chosen draws by the `corner` package, for scripts; the report's own fits a phone."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.report.saving import drawing, save_figure
from bayesplate.report.style import BLUE, ORANGE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_INCHES = 1.9
_HELD = (0.5, 0.9)


def corner_figure(
    columns: Mapping[str, NDArray[np.float64]], marked: Mapping[str, float | None] | None = None
) -> Figure:
    """Every pair of columns against each other.

    Parameters
    ----------
    columns : dict of array of any shape
        Draws by what stands at their axis, units included; all of one size.
    marked : dict of float, optional
        Values to mark by a line, such as the least squares, by the same words.

    Returns
    -------
    matplotlib.figure.Figure
    """
    import corner
    from matplotlib.figure import Figure

    side = _INCHES * len(columns)
    truths = None if marked is None else [marked.get(name) for name in columns]
    figure = Figure(figsize=(side, side))
    corner.corner(
        np.column_stack([np.ravel(values) for values in columns.values()]),
        fig=figure,
        labels=list(columns),
        levels=_HELD,
        smooth=1.0,
        color=BLUE,
        truths=None if len(columns) == 1 else truths,
        truth_color=ORANGE,
    )
    if len(columns) == 1 and truths is not None and truths[0] is not None:  # which corner marks in pairs only
        figure.axes[0].axvline(truths[0], color=ORANGE)
    return figure


@drawing()
def write_corner_plot(
    path: Path, columns: Mapping[str, NDArray[np.float64]], marked: Mapping[str, float | None] | None = None
) -> None:
    """Write the figure by the ending of the path, PNG or SVG; further parameters as of `corner_figure`."""
    save_figure(corner_figure(columns, marked), path)
