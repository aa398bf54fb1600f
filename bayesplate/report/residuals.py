"""Two figures of the errors, mode by mode in cents: the residuals with rounding bars, and the posterior predictive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.laws import cents
from bayesplate.report.style import BLUE, DARK, GREY, LIGHT, ORANGE, SMALL, WORDS, Picture, in_rows, legend_below, short
from bayesplate.results.fit_tables import noise_cents
from bayesplate.results.modes import ModeRow
from bayesplate.results.summary import Summary
from bayesplate.results.words import mode_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_QUANTILES = (0.05, 0.25, 0.75, 0.95)


def residuals_picture(summary: Summary) -> Picture:
    """How far the fitted model misses each reading, and a refit that has not seen it."""
    modes = summary.modes
    residual = np.array([mode.residual_cents for mode in modes])
    low, high = np.array([mode.residual_interval_cents for mode in modes]).T
    below, above = _rounding(modes)
    left_out = np.array([np.nan if mode.left_out_cents is None else mode.left_out_cents for mode in modes])
    noise = np.array([noise_cents(summary, mode) for mode in modes])
    figure, panel = _rows(modes)
    rows = np.arange(len(modes))
    panel.barh(rows, 2 * noise, left=-noise, height=0.9, color=LIGHT, label="noise, ± its sd")
    if (above > below).any():
        panel.hlines(rows, residual + below, residual + above, color=ORANGE, lw=5, label="what rounding may hide")
    panel.hlines(rows, low, high, color=BLUE, lw=1.4, label="its 90 % interval")
    panel.plot(residual, rows, "o", color=BLUE, ms=6, mec="black", mew=0.6, label="error of the fit")
    panel.plot(left_out, rows, "D", mfc="white", mec="black", ms=5, label="error if left out of the fit")
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="measured above (+) or below (-) the fit, cents")
    legend_below(figure, 2)
    told = "; ".join(f"{mode.label} {mode.residual_cents:+.0f}" for mode in modes)
    caption = (
        "17 cents are about 1 % of a frequency, 100 cents are a semitone. An open diamond beyond the grey band is a "
        "mode that the others do not foretell. Where two modes lie close together, the two kinds of error can differ "
        "much."
    )
    return Picture("residuals", "How far each mode is missed", f"Errors of the fit, cents: {told}.", caption, figure)


def predictive_picture(summary: Summary, predictive: NDArray[np.float64]) -> Picture:
    """What the model expects to be read, beside what was read.

    Parameters
    ----------
    summary : Summary
    predictive : (..., n_modes) array, Hz
        Draws of the next reading.

    Returns
    -------
    Picture
    """
    modes = summary.modes
    measured = np.array([mode.measured_hz for mode in modes])
    draws = cents(np.log(np.maximum(predictive.reshape(-1, len(modes)), 1e-9) / measured))
    below, above = _rounding(modes)
    bars = np.quantile(draws, _QUANTILES, axis=0)
    q05, q25, q75, q95 = bars + np.array([below, below, above, above])  # a reading stands for all that round to it
    figure, panel = _rows(modes)
    rows = np.arange(len(modes))
    panel.hlines(rows, q05, q95, color=BLUE, alpha=0.35, lw=9, label="expected, 90 %")
    panel.hlines(rows, q25, q75, color=BLUE, lw=9, label="expected, 50 %")
    panel.plot(np.zeros(len(modes)), rows, "o", color="white", mec="black", mew=1.0, ms=5, label="the reading")
    panel.axvline(0, color=GREY, lw=0.7, zorder=0)
    panel.set(xlabel="above (+) or below (-) the reading, cents")
    legend_below(figure, 2)
    inside = int(np.sum((q05 <= 0) & (q95 >= 0)))
    alt = (
        f"Bars of the readings that the model expects. {inside} of {len(modes)} readings lie in their 90 % bars, which "
        "count their rounding."
    )
    caption = (
        "If the model holds, nine readings in ten or more lie within their pale bars, and half of them or more within "
        "the dark ones, which reach as far as rounding may hide. The model has seen these readings: a good picture is "
        "needed, but proves little; the open diamonds in the figure of the errors are the harder test."
    )
    return Picture("predictive", "What the model would expect you to read", alt, caption, figure)


def _rounding(modes: Sequence[ModeRow]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How far below and above each reading its rounding interval reaches: two (n_modes,) arrays, cents."""
    below, above = np.array([mode.rounding_cents or (0.0, 0.0) for mode in modes]).T
    return below, above


def _rows(modes: Sequence[ModeRow]) -> tuple[Any, Axes]:
    """A panel with a row per mode, the first on top; a long list of setups has their names beside the labels."""
    setups = list(dict.fromkeys(mode.setup for mode in modes))
    several = len(setups) > 1
    names = [mode_name(mode.label, mode.setup, several=several) for mode in modes]
    left = 0.62 if not several else min(1.6, 0.62 + 0.075 * (1 + max(len(name) for name in setups)))
    shown = [short(name, 22) for name in names]
    return in_rows(shown, size=SMALL if several else WORDS, left=left, bottom=0.95)
