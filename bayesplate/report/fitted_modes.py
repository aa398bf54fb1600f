"""The figures of the fitted modes: where sand gathers at each, with the measured and the predicted frequency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Values, vibrating_lengths
from bayesplate.estimates.shapes import N_POINTS, labelled_shapes
from bayesplate.estimates.sheet import points
from bayesplate.frequencies.model import SetupModel
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.posterior.inference import Inference
from bayesplate.report.chladni import board_panel, caption, draw_sand
from bayesplate.report.style import WIDTH, Picture
from bayesplate.results.modes import ModeRow
from bayesplate.results.summary import Summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SIDE, _GAP = 0.22, 0.26
_CAPTION, _TALLEST = 0.6, 2.4
_MARGIN = 0.14
_N_COLUMNS = 3


def modes_pictures(inference: Inference, draws: Draws, summary: Summary) -> list[Picture]:
    """One picture a setup."""
    problem = inference.problem
    shapes = labelled_shapes(problem.posterior.models, posterior_mean_values(problem, draws))
    caption = (
        "Black lines stay at rest, so sand gathers there; white and grey parts move against each other. "
        f"{'x' if problem.board.isotropic else 'The grain'} runs from left to right. The predicted frequency is the "
        "posterior mean."
    )
    pictures = []
    for model in problem.posterior.models:
        setup = model.setup.name
        modes = [mode for mode in summary.modes if mode.setup == setup]
        modes.sort(key=lambda mode: mode.measured_hz)
        told = "; ".join(f"{mode.label} {', '.join(_hertz(mode))}" for mode in modes)
        name = "modes" if len(problem.board.setups) == 1 else f"modes-{setup}"
        title = f"Chladni figures of the fitted modes, setup {setup}"
        figure = _figure(model, problem.board.nominal(), modes, shapes[setup])
        pictures.append(Picture(name, title, f"Nodal lines of {len(modes)} modes: {told}.", caption, figure))
    return pictures


def _figure(
    model: SetupModel, values: Values, modes: Sequence[ModeRow], shapes: Mapping[str, NDArray[np.float64]]
) -> Figure:
    """The modes of a setup, their shapes by label."""
    from matplotlib.figure import Figure

    system = model.system
    length_x, length_y = vibrating_lengths(system.adjusted(values), model.setup)
    limits = system.limits(points(N_POINTS))
    cell = (WIDTH - 2 * _SIDE + _GAP) / _N_COLUMNS
    side = min(cell - _GAP, _TALLEST * float(length_x / length_y))
    size = (side, side * float(length_y / length_x))
    row = size[1] + _CAPTION
    height = -(-len(modes) // _N_COLUMNS) * row + _MARGIN
    figure = Figure(figsize=(WIDTH, height))
    for i, mode in enumerate(modes):
        at_row, column = divmod(i, _N_COLUMNS)
        left = _SIDE + column * cell + (cell - _GAP - side) / 2
        bottom = height - _MARGIN - at_row * row - size[1]
        panel = board_panel(figure, (left, bottom), size, model.setup.edges, limits)
        draw_sand(panel, shapes[mode.label], limits)
        caption(panel, mode.label, *_hertz(mode))
    return figure


def _hertz(mode: ModeRow) -> tuple[str, str]:
    """Its measured and its predicted frequency in words."""
    return f"measured {mode.measured_hz:.6g} Hz", f"predicted {mode.predicted_hz.mean:.1f} Hz"
