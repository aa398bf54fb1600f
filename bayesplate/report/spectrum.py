"""The figure of a spectrum: measured peaks above, predicted modes below, and lines for what belongs together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from bayesplate.report.style import BLUE, DARK, GREY, ORANGE, SMALL, Picture, moved_apart, stacked
from bayesplate.results.peaks import UNNAMED, Spectrum
from bayesplate.results.summary import Summary

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PEAKS_AT, _MODES_AT = 1.0, 0.0
_LEAST_SEEN = 0.5
_APART = 0.026
"""Share of the width that two labels of modes need."""


def spectrum_pictures(summary: Summary) -> list[Picture]:
    """One picture per setup with peaks whose label is not sure."""
    return [spectrum_picture(summary, one) for one in summary.spectra]


def spectrum_picture(summary: Summary, spectrum: Spectrum) -> Picture:
    """Measured peaks over predicted modes of a setup.

    Parameters
    ----------
    summary : Summary
    spectrum : Spectrum
        Of one of its setups.

    Returns
    -------
    Picture
    """
    peaks = [peak for peak in summary.peaks if peak.setup == spectrum.setup]
    several = len(summary.spectra) > 1
    figure, (panel,) = stacked([2.6], left=0.2, right=0.2, bottom=0.4, top=0.1)
    highest = max(peak.hz for peak in peaks)
    shown = [mode for mode in spectrum.modes if mode.predicted_hz.mean < 1.05 * highest]
    lowest = min([*(peak.hz for peak in peaks), *(mode.predicted_hz.mean for mode in shown)])
    panel.set(xscale="log", xlim=(0.93 * lowest, 1.07 * highest), ylim=(-0.62, 1.42), yticks=[])
    panel.spines["left"].set_visible(False)
    hertz = {mode.label: mode.predicted_hz.mean for mode in shown}
    for peak in peaks:
        for one in peak.assignments:
            if one.label in hertz:
                ends = [peak.hz, hertz[one.label]]
                panel.plot(ends, [_PEAKS_AT, _MODES_AT], color=BLUE, lw=0.4 + 1.6 * one.probability, alpha=0.9)
        is_lonely = peak.spurious_probability > _LEAST_SEEN
        panel.plot(peak.hz, _PEAKS_AT, "v", color=ORANGE if is_lonely else "black", ms=5)
    for mode in shown:
        is_seen = mode.seen_probability > _LEAST_SEEN
        ends = [mode.predicted_hz.q05, mode.predicted_hz.q95]
        panel.plot(ends, [_MODES_AT] * 2, color=BLUE if is_seen else GREY, lw=5, solid_capstyle="butt")
        face = BLUE if is_seen else "white"
        panel.plot(mode.predicted_hz.mean, _MODES_AT, "o", mfc=face, mec=BLUE if is_seen else GREY, ms=4)
    _write(panel, [mode.predicted_hz.mean for mode in shown], [short_label(mode.label) for mode in shown], -0.1, "top")
    _write(panel, [peak.hz for peak in peaks], [f"{peak.hz:.4g}" for peak in peaks], 1.1, "bottom")
    ticks = [tick for tick in (20, 50, 100, 200, 500, 1000, 2000, 5000) if 0.93 * lowest < tick < 1.07 * highest]
    panel.set_xticks(ticks, [str(tick) for tick in ticks])
    panel.minorticks_off()
    panel.set_xlabel("Hz", fontsize=SMALL)
    alone = [peak for peak in peaks if peak.spurious_probability > _LEAST_SEEN]
    missed = [mode.label for mode in shown if mode.seen_probability <= _LEAST_SEEN]
    told = f"{len(peaks)} peaks, {len(peaks) - len(alone)} of them likely a mode of the plate. "
    if not shown:
        told += "Every mode of the plate up to there has a label that is sure."
    else:
        told += f"Modes without a likely peak: {', '.join(missed)}." if missed else "Every mode has a likely peak."
    caption = (
        "Above, triangles: the peaks that were read, orange where a peak is likely no mode of the plate. Below, with "
        "their 90 % intervals: the modes that the fitted plate has, hollow where no peak is likely theirs. A line "
        "joins a peak to a mode that it may be, the thicker the more probable."
    )
    if any(mode.label == UNNAMED for mode in shown):
        caption += " A question mark: a mode whose figure fits no label."
    title = "Which mode each peak is" + (f", {spectrum.setup}" if several else "")
    name = f"spectrum_{spectrum.setup}" if several else "spectrum"
    return Picture(name, title, told, caption, figure)


def _write(panel: Axes, at: Sequence[float], names: Sequence[str], height: float, side: str) -> None:
    """Names upright at their frequencies, moved apart where they would overlap."""
    low, high = np.log(panel.get_xlim())
    order = np.argsort(at, kind="stable")
    wanted = (np.log(np.array(at)[order]) - low) / (high - low)
    placed = moved_apart(wanted, _APART)
    for place, true, i in zip(placed, wanted, order, strict=True):
        x, x_true = np.exp(low + (high - low) * np.array([place, true]))
        inner = height - 0.05 * np.sign(height)
        outer = height + 0.08 * np.sign(height)
        panel.plot([x_true, x], [inner, outer], color=DARK, lw=0.4)
        panel.text(x, outer, names[i], rotation=90, ha="center", va=side, fontsize=SMALL - 1.5)


def short_label(label: str) -> str:
    """A label as figures have it, where a mode without a name is a question mark."""
    return "?" if label == UNNAMED else label
