"""The figure of a spectrum: measured peaks above, predicted modes below, and lines for what belongs together."""

from __future__ import annotations

from bayesplate.report.style import BLUE, GREY, ORANGE, Picture, hertz_axis, stacked, upright_names
from bayesplate.results.peaks import UNNAMED, Spectrum
from bayesplate.results.summary import Summary

_PEAKS_AT, _MODES_AT = 1.0, 0.0
_LEAST_SEEN = 0.5


def spectrum_pictures(summary: Summary) -> list[Picture]:
    """One picture per setup with peaks whose label is not sure."""
    return [_picture(summary, one) for one in summary.spectra]


def _picture(summary: Summary, spectrum: Spectrum) -> Picture:
    """Measured peaks over predicted modes of a setup."""
    peaks = [peak for peak in summary.peaks if peak.setup == spectrum.setup]
    several = len(summary.spectra) > 1
    figure, (panel,) = stacked([2.6], left=0.2, right=0.2, bottom=0.4, top=0.1)
    highest = max(peak.hz for peak in peaks)
    shown = [mode for mode in spectrum.modes if mode.predicted_hz.mean < 1.05 * highest]
    lowest = min([*(peak.hz for peak in peaks), *(mode.predicted_hz.mean for mode in shown)])
    hertz_axis(panel, 0.93 * lowest, 1.07 * highest)
    panel.set(ylim=(-0.62, 1.42), yticks=[])
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
    upright_names(
        panel, [mode.predicted_hz.mean for mode in shown], [short_label(mode.label) for mode in shown], 0.28, 0.22
    )
    upright_names(panel, [peak.hz for peak in peaks], [f"{peak.hz:.4g}" for peak in peaks], 0.82, 0.88)
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


def short_label(label: str) -> str:
    """A label as figures have it, where a mode without a name is a question mark."""
    return "?" if label == UNNAMED else label
