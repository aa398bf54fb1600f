"""The figure of the fitted modes: where sand gathers at each, with the measured and the predicted frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.system import Limits
from bayesplate.plate.setup import Setup
from bayesplate.report.chladni import board_panel, caption, draw_sand
from bayesplate.report.style import WIDTH, Picture
from bayesplate.results.modes import ModeRow

_SIDE, _GAP = 0.22, 0.26
_CAPTION, _TALLEST = 0.6, 2.4
_MARGIN = 0.14
_N_COLUMNS = 3

CAPTION = (
    "Black lines stay at rest, so sand gathers there; white and grey parts move against each other. The grain runs "
    "from left to right. The predicted frequency is the posterior mean."
)


def fitted_modes_picture(
    setup: Setup,
    modes: Sequence[ModeRow],
    shapes: Mapping[str, NDArray[np.float64]],
    aspect_ratio: float,
    name: str = "modes",
    limits: Limits | None = None,
) -> Picture:
    """Draw the fitted modes of one setup in the order of frequency.

    Parameters
    ----------
    setup : Setup
    modes : sequence of ModeRow
        Its rows of the summary.
    shapes : dict of (n_x, n_y) array
        By label.
    aspect_ratio : float
        L_x / L_y of the part that vibrates, L_y where it is widest.
    name : str
        Stem of the picture's files.
    limits : ((n_x,) array, (n_x,) array), optional
        Where the board begins and ends along y, as fractions of its widest width.

    Returns
    -------
    Picture
    """
    from matplotlib.figure import Figure

    cell = (WIDTH - 2 * _SIDE + _GAP) / _N_COLUMNS
    side = min(cell - _GAP, _TALLEST * aspect_ratio)
    size = (side, side / aspect_ratio)
    n_rows = -(-len(modes) // _N_COLUMNS)
    row = size[1] + _CAPTION
    height = n_rows * row + _MARGIN
    figure = Figure(figsize=(WIDTH, height))
    ordered = sorted(modes, key=lambda mode: mode.measured_hz)
    for i, mode in enumerate(ordered):
        at_row, column = divmod(i, _N_COLUMNS)
        left = _SIDE + column * cell + (cell - _GAP - side) / 2
        bottom = height - _MARGIN - at_row * row - size[1]
        panel = board_panel(figure, (left, bottom), size, setup.edges, limits)
        draw_sand(panel, shapes[mode.label], limits)
        measured, predicted = f"measured {mode.measured_hz:.6g} Hz", f"predicted {mode.predicted_hz.mean:.1f} Hz"
        caption(panel, mode.label, measured, predicted)
    told = "; ".join(
        f"{mode.label} measured {mode.measured_hz:.6g} Hz, predicted {mode.predicted_hz.mean:.1f} Hz"
        for mode in ordered
    )
    title = f"Chladni figures of the fitted modes, setup {setup.name}"
    return Picture(name, title, f"Nodal lines of {len(ordered)} modes: {told}.", CAPTION, figure)
