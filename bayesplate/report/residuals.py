"""Two figures of the errors, mode by mode in cents: the residuals with rounding bars, and the posterior predictive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.laws import cents
from bayesplate.plate.board import Board
from bayesplate.plate.readings import ReadingErrors
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREY,
    LIGHT,
    ORANGE,
    SMALL,
    WORDS,
    Picture,
    legend_below,
    short,
    stacked,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_ROW = 0.235
_QUANTILES = (0.05, 0.25, 0.75, 0.95)


def residuals_picture(board: Board, summary: Mapping[str, Any]) -> Picture:
    """What the best fit leaves of each mode, with and without having seen it.

    Parameters
    ----------
    board : Board
    summary : dict
        As in summary.json.

    Returns
    -------
    Picture
    """
    modes = summary["modes"]
    below, above = rounding_cents(board)
    residual = np.array([mode["residual_cents"] for mode in modes])
    left_out = np.array([np.nan if m["left_out_cents"] is None else m["left_out_cents"] for m in modes], dtype=float)
    noise = np.array([cents(summary["noise"][mode["setup"]]["q50"]) for mode in modes])
    figure, panel = _rows(modes)
    rows = np.arange(len(modes))
    panel.barh(rows, 2 * noise, left=-noise, height=0.9, color=LIGHT, label="noise, ± its sd")
    if (above > below).any():
        panel.hlines(rows, residual + below, residual + above, color=ORANGE, lw=5, label="what rounding may hide")
    panel.plot(residual, rows, "o", color=BLUE, ms=6, mec="black", mew=0.6, label="error of the fit")
    panel.plot(left_out, rows, "D", mfc="white", mec="black", ms=5, label="error if left out of the fit")
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set_xlabel("measured above (+) or below (-) the fit, cents", fontsize=SMALL)
    legend_below(figure, panel.get_legend_handles_labels()[0], 2)
    told = "; ".join(f"{mode['label']} {value:+.0f}" for mode, value in zip(modes, residual, strict=True))
    caption = (
        "17 cents are about 1 % of a frequency, 100 cents are a semitone. An open diamond beyond the grey band is a "
        "mode that the others do not foretell. Where two modes lie close together, the two kinds of error can differ "
        "much."
    )
    return Picture("residuals", "How far each mode is missed", f"Errors of the fit, cents: {told}.", caption, figure)


def predictive_picture(board: Board, summary: Mapping[str, Any], predictive: NDArray[np.float64]) -> Picture:
    """What the model expects to be read, beside what was read.

    Parameters
    ----------
    board : Board
    summary : dict
    predictive : (..., n_modes) array, Hz
        Draws of the next reading.

    Returns
    -------
    Picture
    """
    modes = summary["modes"]
    measured = np.array([mode["measured_hz"] for mode in modes])
    draws = cents(np.log(np.maximum(predictive.reshape(-1, len(modes)), 1e-9) / measured))
    q05, q25, q75, q95 = np.quantile(draws, _QUANTILES, axis=0)
    below, above = rounding_cents(board)
    figure, panel = _rows(modes)
    rows = np.arange(len(modes))
    panel.hlines(rows, q05, q95, color=BLUE, alpha=0.35, lw=9, label="expected, 90 %")
    panel.hlines(rows, q25, q75, color=BLUE, lw=9, label="expected, 50 %")
    if (above > below).any():
        panel.hlines(rows, below, above, color=ORANGE, lw=3.5, label="rounding of the reading")
    panel.plot(np.zeros(len(modes)), rows, "o", color="white", mec="black", mew=1.0, ms=5, label="the reading")
    panel.axvline(0, color=GREY, lw=0.7, zorder=0)
    panel.set_xlabel("above (+) or below (-) the reading, cents", fontsize=SMALL)
    legend_below(figure, panel.get_legend_handles_labels()[0], 2)
    inside = int(np.sum((q05 - above <= 0) & (q95 - below >= 0)))
    alt = (
        f"Bars of the readings that the model expects. {inside} of {len(modes)} readings lie in their 90 % bars, "
        "counting their rounding."
    )
    caption = (
        "If the model holds, about nine readings in ten lie within their pale bars. It has seen these readings: a good "
        "picture here is needed, but proves little; the open diamonds of the figure before are the harder test."
    )
    return Picture("predictive", "What the model would expect you to read", alt, caption, figure)


def rounding_cents(board: Board) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far below and above each reading its rounding interval reaches: two (n_modes,) arrays, cents."""
    readings = [ReadingErrors.of(setup) for setup in board.setups]
    below = np.concatenate([cents(one.log_low - one.log_frequency) for one in readings])
    above = np.concatenate([cents(one.log_high - one.log_frequency) for one in readings])
    return below, above


def _rows(modes: Sequence[Mapping[str, Any]]) -> tuple[Any, Axes]:
    """A panel with a row a mode, the first on top; a long list of setups has their names beside the labels."""
    setups = list(dict.fromkeys(mode["setup"] for mode in modes))
    several = len(setups) > 1
    names = [f"{mode['label']} {mode['setup']}" if several else mode["label"] for mode in modes]
    left = 0.62 if not several else min(1.6, 0.62 + 0.075 * (1 + max(len(name) for name in setups)))
    figure, (panel,) = stacked([_ROW * len(modes) + 0.1], left=left, bottom=0.95)
    panel.set(ylim=(len(modes) - 0.5, -0.5))
    panel.set_yticks(range(len(modes)), [short(name, 22) for name in names], fontsize=WORDS if not several else SMALL)
    panel.tick_params(axis="y", length=0)
    panel.spines["left"].set_visible(False)
    panel.grid(axis="x", color="0.9", lw=0.6)
    panel.set_axisbelow(True)
    return figure, panel
