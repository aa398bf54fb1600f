"""Figures mode by mode: Chladni figures, residuals, predictive distributions, energy shares, peaks without a label."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values, vibrating_lengths
from bayesplate.estimates.identifiability import Identifiability
from bayesplate.estimates.sheet import N_POINTS, grid_points, labelled_shapes
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import SetupModel
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.report.chladni import board_panel, draw_caption, draw_sand
from bayesplate.report.style import (
    BLUE,
    DARK,
    FIGURE_WIDTH,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SMALL_SIZE,
    TEXT_SIZE,
    Picture,
    draw_legend,
    draw_upright_names,
    mathtext,
    panel_with_rows,
    set_hertz_axis,
    shorten,
    stacked_panels,
)
from bayesplate.results.checking import CheckedMode, CheckReport
from bayesplate.results.fit_tables import noise_cents
from bayesplate.results.modes import UNNAMED_MODE, ModeRow, Spectrum
from bayesplate.results.summary import Summary
from bayesplate.results.words import mode_name

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


_LEFT, _BETWEEN = 0.22, 0.26
_CAPTION, _TALLEST = 0.6, 2.4
_MARGIN = 0.14
_N_COLUMNS = 3


def modes_pictures(draws: Draws, summary: Summary) -> list[Picture]:
    problem = draws.problem
    shapes = labelled_shapes(problem.posterior.models, posterior_mean_values(draws))
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
        details = "; ".join(f"{mode.label} {', '.join(_hertz_texts(mode))}" for mode in modes)
        name = "modes" if len(problem.board.setups) == 1 else f"modes-{setup}"
        title = f"Chladni figures of the fitted modes, setup {setup}"
        figure = _sand_figure(model, problem.board.nominal(), modes, shapes[setup])
        pictures.append(Picture(name, title, f"Nodal lines: {details}.", caption, figure))
    return pictures


def _sand_figure(model: SetupModel, values: Values, modes: Sequence[ModeRow], shapes: Mapping[str, Floats]) -> Figure:
    from matplotlib.figure import Figure

    system = model.system
    length_x, length_y = vibrating_lengths(system.adjusted(values), model.setup)
    limits = system.limits(grid_points(N_POINTS))
    cell = (FIGURE_WIDTH - 2 * _LEFT + _BETWEEN) / _N_COLUMNS
    side = min(cell - _BETWEEN, _TALLEST * float(length_x / length_y))
    size = (side, side * float(length_y / length_x))
    row_height = size[1] + _CAPTION
    height = -(-len(modes) // _N_COLUMNS) * row_height + _MARGIN
    figure = Figure(figsize=(FIGURE_WIDTH, height))
    for i, mode in enumerate(modes):
        row, column = divmod(i, _N_COLUMNS)
        left = _LEFT + column * cell + (cell - _BETWEEN - side) / 2
        bottom = height - _MARGIN - row * row_height - size[1]
        panel = board_panel(figure, (left, bottom), size, model.setup.edges, limits)
        draw_sand(panel, shapes[mode.label], limits)
        draw_caption(panel, mode.label, *_hertz_texts(mode))
    return figure


def _hertz_texts(mode: ModeRow) -> tuple[str, str]:
    return f"measured {mode.measured_hz:.6g} Hz", f"predicted {mode.predicted_hz.mean:.1f} Hz"


_QUANTILES = (0.05, 0.25, 0.75, 0.95)


def residuals_picture(summary: Summary) -> Picture:
    """Residual of each mode, and its error if it is left out of the fit."""
    modes = summary.modes
    residual = np.array([mode.residual_cents for mode in modes])
    low, high = np.array([mode.residual_interval_cents for mode in modes]).T
    below, above = _rounding_ends(modes)
    left_out = np.array([np.nan if mode.left_out_cents is None else mode.left_out_cents for mode in modes])
    noise = np.array([noise_cents(summary, mode) for mode in modes])
    figure, panel = _panel_of_modes(modes)
    rows = np.arange(len(modes))
    panel.barh(rows, 2 * noise, left=-noise, height=0.9, color=LIGHT, label="noise, ± its sd")
    if (above > below).any():
        panel.hlines(rows, residual + below, residual + above, color=ORANGE, lw=5, label="what rounding may hide")
    panel.hlines(rows, low, high, color=BLUE, lw=1.4, label="error of the fit, 90 %")
    panel.plot(residual, rows, "o", color=BLUE, ms=6, mec="black", mew=0.6, label="error of the fit")
    panel.plot(left_out, rows, "D", mfc="white", mec="black", ms=5, label="error if left out of the fit")
    panel.axvline(0, color=DARK, lw=0.8)
    panel.set(xlabel="measured above (+) or below (-) the fit, cents")
    draw_legend(figure, 2)
    details = "; ".join(f"{mode.label} {mode.residual_cents:+.0f}" for mode in modes)
    caption = (
        "17 cents are about 1 % of a frequency, 100 cents are a semitone. An open diamond beyond the grey band is a "
        "mode that the others do not foretell. Where two modes lie close together, the two kinds of error can differ "
        "much."
    )
    return Picture("residuals", "How far each mode is missed", f"Errors of the fit, cents: {details}.", caption, figure)


def predictive_picture(summary: Summary, predictive: Floats) -> Picture:
    """Predictive distributions, from (..., n_modes) draws of the next reading in Hz, beside the readings."""
    modes = summary.modes
    measured = np.array([mode.measured_hz for mode in modes])
    draws = cents(np.log(np.maximum(predictive.reshape(-1, len(modes)), 1e-9) / measured))
    below, above = _rounding_ends(modes)
    bars = np.quantile(draws, _QUANTILES, axis=0)
    q05, q25, q75, q95 = bars + np.array(
        [below, below, above, above]
    )  # a reading stands for all frequencies that round to it
    figure, panel = _panel_of_modes(modes)
    rows = np.arange(len(modes))
    panel.hlines(rows, q05, q95, color=BLUE, alpha=0.35, lw=9, label="expected, 90 %")
    panel.hlines(rows, q25, q75, color=BLUE, lw=9, label="expected, 50 %")
    panel.plot(np.zeros(len(modes)), rows, "o", color="white", mec="black", mew=1.0, ms=5, label="the reading")
    panel.axvline(0, color=GREY, lw=0.7, zorder=0)
    panel.set(xlabel="above (+) or below (-) the reading, cents")
    draw_legend(figure, 2)
    n_inside = int(np.sum((q05 <= 0) & (q95 >= 0)))
    alt = (
        f"Bars of the readings that the model expects. {n_inside} of {len(modes)} readings lie in their 90 % bars, "
        "which count their rounding."
    )
    caption = (
        "If the model holds, nine readings in ten or more lie within their pale bars, and half of them or more within "
        "the dark ones, which reach as far as rounding may hide. The model has seen these readings: a good picture is "
        "needed, but proves little; the open diamonds in the figure of the errors are the harder test."
    )
    return Picture("predictive", "What the model would expect you to read", alt, caption, figure)


def _rounding_ends(modes: Sequence[ModeRow]) -> tuple[Floats, Floats]:
    """Ends of the rounding interval of each reading, cents over it: two (n_modes,) arrays."""
    below, above = np.array([mode.rounding_cents or (0.0, 0.0) for mode in modes]).T
    return below, above


def _panel_of_modes(modes: Sequence[ModeRow]) -> tuple[Any, Axes]:
    """A panel with a row per mode, the first on top; where there are several setups, rows have their names too."""
    setups = list(dict.fromkeys(mode.setup for mode in modes))
    several = len(setups) > 1
    names = [mode_name(mode.label, mode.setup, several=several) for mode in modes]
    left = 0.62 if not several else min(1.6, 0.62 + 0.075 * (1 + max(len(name) for name in setups)))
    short_names = [shorten(name, 22) for name in names]
    return panel_with_rows(short_names, size=SMALL_SIZE if several else TEXT_SIZE, left=left, bottom=0.95)


_SHARE_STYLES = {
    "E_x": (BLUE, "", "bending along the grain, E_x"),
    "E_y": (ORANGE, "////", "bending across it, E_y"),
    "G_xy": (GREEN, "..", "twisting, G_xy"),
    "effects": (GREY, "xx", "effects"),
}
_SHARE_STYLES_OF_ISOTROPIC = {"E_x": (BLUE, "", "bending along x"), "E_y": (ORANGE, "////", "bending along y")}
_SHARE_ROW = 0.27


def shares_picture(summary: Summary | CheckReport, identifiability: Identifiability) -> Picture:
    """Energy shares and leverage of each mode; the identifiability is that of the modes of the summary."""
    modes: Sequence[ModeRow | CheckedMode] = summary.modes
    several = len({mode.setup for mode in modes}) > 1
    names = [mode_name(mode.label, shorten(mode.setup, 14), several=several) for mode in modes]
    left = 0.62 if not several else min(1.6, 0.3 + 0.075 * max(len(name) for name in names))
    shares = np.column_stack([identifiability.shares, 1.0 - identifiability.shares.sum(axis=1)])
    if np.abs(shares[:, 3]).max() < 0.005:
        shares = shares[:, :3]
    figure, panel = panel_with_rows(names, row=_SHARE_ROW, size=TEXT_SIZE, left=left, right=0.75, top=0.28, bottom=0.98)
    rows = np.arange(len(modes))
    start = np.zeros(len(modes))
    styles = _SHARE_STYLES | (_SHARE_STYLES_OF_ISOTROPIC if identifiability.symmetry.is_isotropic else {})
    for share, (colour, hatch, label) in zip(shares.T, styles.values(), strict=False):
        widths = np.maximum(share, 0.0)
        panel.barh(
            rows, 100 * widths, left=100 * start, height=0.72, color=colour, hatch=hatch, edgecolor="white", lw=0.6,
            label=mathtext(label),
        )  # fmt: skip
        start = start + widths
    for row, words in [(-0.85, "leverage"), *((row, f"{mode.leverage:.2f}") for row, mode in enumerate(modes))]:
        panel.text(102, row, words, fontsize=SMALL_SIZE, va="center", color=DARK, clip_on=False)
    panel.set(xlim=(0, 100), xlabel="energy of the mode, %")
    draw_legend(figure, 2)
    return Picture("shares", "What each mode tells", _shares_alt_text(names, identifiability), _SHARES_CAPTION, figure)


_SHARES_CAPTION = (
    "A constant is well known if some mode has most of its energy in it. Leverage says how much of a mode's own "
    "reading stands in its prediction: near 1, nothing checks that reading."
)


def _shares_alt_text(names: list[str], identifiability: Identifiability) -> str:
    texts = []
    for constant, column in zip(("E_x", "E_y", "G_xy"), identifiability.shares.T, strict=True):
        best = int(np.argmax(column))
        texts.append(f"{constant}: most in mode {names[best]} with {min(100 * column[best], 100):.0f} %")
    return "Share of each constant in the energy of each mode. " + "; ".join(texts) + "."


_PEAKS_HEIGHT, _MODES_HEIGHT = 1.0, 0.0
_LEAST_LIKELY = 0.5


def spectrum_pictures(summary: Summary) -> list[Picture]:
    """One picture per setup with peaks whose label is not sure."""
    return [_spectrum_picture(summary, spectrum) for spectrum in summary.spectra]


def _spectrum_picture(summary: Summary, spectrum: Spectrum) -> Picture:
    peaks = [peak for peak in summary.peaks if peak.setup == spectrum.setup]
    several = len(summary.spectra) > 1
    figure, (panel,) = stacked_panels([2.6], left=0.2, right=0.2, bottom=0.4, top=0.1)
    highest = max(peak.hz for peak in peaks)
    modes = [mode for mode in spectrum.modes if mode.predicted_hz.mean < 1.05 * highest]
    lowest = min([*(peak.hz for peak in peaks), *(mode.predicted_hz.mean for mode in modes)])
    set_hertz_axis(panel, 0.93 * lowest, 1.07 * highest)
    panel.set(ylim=(-0.62, 1.42), yticks=[])
    panel.spines["left"].set_visible(False)
    shown = {mode.predicted_hz.mean for mode in modes}
    for peak in peaks:
        for assignment in peak.assignments:
            if assignment.predicted_hz in shown:
                ends = [peak.hz, assignment.predicted_hz]
                panel.plot(
                    ends, [_PEAKS_HEIGHT, _MODES_HEIGHT], color=BLUE, lw=0.4 + 1.6 * assignment.probability, alpha=0.9
                )
        is_spurious = peak.spurious_probability > _LEAST_LIKELY
        panel.plot(peak.hz, _PEAKS_HEIGHT, "v", color=ORANGE if is_spurious else "black", ms=5)
    for mode in modes:
        is_seen = mode.seen_probability > _LEAST_LIKELY
        ends = [mode.predicted_hz.q05, mode.predicted_hz.q95]
        panel.plot(ends, [_MODES_HEIGHT] * 2, color=BLUE if is_seen else GREY, lw=5, solid_capstyle="butt")
        face = BLUE if is_seen else "white"
        panel.plot(mode.predicted_hz.mean, _MODES_HEIGHT, "o", mfc=face, mec=BLUE if is_seen else GREY, ms=4)
    draw_upright_names(
        panel, [mode.predicted_hz.mean for mode in modes], [short_label(mode.label) for mode in modes], 0.28, 0.22
    )
    draw_upright_names(panel, [peak.hz for peak in peaks], [f"{peak.hz:.4g}" for peak in peaks], 0.82, 0.88)
    spurious_peaks = [peak for peak in peaks if peak.spurious_probability > _LEAST_LIKELY]
    missed_labels = [mode.label for mode in modes if mode.seen_probability <= _LEAST_LIKELY]
    details = f"{len(peaks)} peaks, {len(peaks) - len(spurious_peaks)} of them likely a mode of the plate. "
    if not modes:
        details += "Every mode of the plate up to there has a label that is sure."
    else:
        details += (
            f"Modes without a likely peak: {', '.join(missed_labels)}."
            if missed_labels
            else "Every mode has a likely peak."
        )
    caption = (
        "Above, triangles: the peaks that were read, orange where a peak is likely no mode of the plate. Below, with "
        "their 90 % intervals: the modes that the fitted plate has, hollow where no peak is likely theirs. A line "
        "joins a peak to a mode that it may be, the thicker the more probable."
    )
    if any(mode.label == UNNAMED_MODE for mode in modes):
        caption += " A question mark: a mode whose figure fits no label."
    title = "Which mode each peak is" + (f", {spectrum.setup}" if several else "")
    name = f"spectrum_{spectrum.setup}" if several else "spectrum"
    return Picture(name, title, details, caption, figure)


def short_label(label: str) -> str:
    """A label for figures: a question mark for a mode without a clear label."""
    return "?" if label == UNNAMED_MODE else label
