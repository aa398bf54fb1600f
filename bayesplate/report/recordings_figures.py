"""Figures of picked recordings: spectra of all places with the modes, what their errors are made of, stability."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.recordings.modes_found import Path
from bayesplate.recordings.responses import Averaged
from bayesplate.report.spectrum import short_label
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL,
    VERMILLION,
    Picture,
    drawable,
    legend_below,
    moved_apart,
    short,
    stacked,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_PLACES = 8
_STEP = 30.0
"""dB between the curves of two places."""
_APART = 0.024
_LEAST_DB = -75.0


def every_picture(report: PickReport, averaged: Sequence[Averaged], paths: Sequence[Path]) -> list[Picture]:
    """All figures of the page."""
    return [spectra_picture(report, averaged), errors_picture(report), stability_picture(report, paths)]


def spectra_picture(report: PickReport, averaged: Sequence[Averaged]) -> Picture:
    """The averaged response of every pair of places with the modes that were picked, and the coherence.

    Parameters
    ----------
    report : PickReport
    averaged : sequence of Averaged

    Returns
    -------
    Picture
    """
    shown = averaged[:MOST_PLACES]
    coherent = [one for one in shown if one.coherence is not None]
    heights = [1.2 + 0.55 * len(shown), *([0.8] if coherent else [])]
    figure, panels = stacked(heights, left=0.25, right=0.2, bottom=0.62, top=0.75, gap=0.25)
    panel = panels[0]
    _limits(panel, report)
    for i, one in enumerate(shown):
        inside = (one.frequency >= report.lowest_hz) & (one.frequency <= report.highest_hz)
        level = 20.0 * np.log10(np.maximum(one.level[inside] / one.level[inside].max(), 1e-12))
        panel.plot(one.frequency[inside], np.maximum(level, _LEAST_DB) - _STEP * i, color=BLUE, lw=0.6)
        if len(shown) > 1:
            at = level[0] - _STEP * i - 1.0
            name = short(drawable(one.name), 24)
            panel.text(report.lowest_hz, at, name, fontsize=SMALL - 1.5, va="top", color=DARK, parse_math=False)
    low, high = panel.get_ylim()
    for peak in report.peaks:
        panel.axvline(
            peak.hz, color=ORANGE if peak.is_likely else GREY, lw=0.5, ls="-" if peak.is_likely else ":", zorder=0
        )
    panel.set_ylim(low, high)
    panel.set_yticks([])
    panel.spines["left"].set_visible(False)
    _names(panel, report.likely)
    if coherent:
        lower = panels[1]
        for one in coherent:
            lower.plot(one.frequency, np.asarray(one.coherence), color=GREEN, lw=0.4, alpha=0.8)
        _limits(lower, report)
        lower.set(ylim=(0.0, 1.05), yticks=[0, 1])
        lower.text(0.0, 1.07, "coherence", transform=lower.transAxes, fontsize=SMALL, va="bottom")
        panel.set_xticklabels([])
        panel.set_xlabel("")
    handles = [_line(BLUE, "response, dB"), _line(ORANGE, "mode"), _line(GREY, "set aside", ":")]
    legend_below(figure, handles + ([_line(GREEN, "coherence")] if coherent else []), 4)
    told = (
        f"{len(report.likely)} modes between {report.likely[0].hz:.0f} and {report.likely[-1].hz:.0f} Hz."
        if report.likely
        else "No modes."
    )
    caption = (
        "One curve for each pair of places, averaged over the hits; the upright number above each line is the picked "
        "frequency in Hz, with its likeliest mode where a card was given (? where that has no name). "
        + (
            "The coherence is the share of the response that the force explains: it falls where only noise is heard."
            if coherent
            else ""
        )
        + (f" {len(averaged) - MOST_PLACES} more places are not drawn." if len(averaged) > MOST_PLACES else "")
    )
    return Picture("spectra", "What was heard, and the modes in it", told, caption.strip(), figure)


def errors_picture(report: PickReport) -> Picture:
    """What the standard error of each mode is made of, in per cent of its frequency."""
    peaks = report.likely
    figure, (panel,) = stacked([max(0.5, 0.16 * len(peaks))], left=0.75, right=0.2, bottom=0.75, top=0.05)
    parts = (
        ("noise_hz", BLUE, "noise"),
        ("scatter_hz", ORANGE, "between hits and places"),
        ("window_hz", SKY, "choice of lines"),
    )
    y = np.arange(len(peaks))
    largest = max((peak.sd_hz / peak.hz for peak in peaks), default=1e-4)
    least = max(min((peak.sd_hz / peak.hz for peak in peaks), default=1e-6) * 10.0, 1e-5)
    for k, (name, colour, _) in enumerate(parts):
        values = np.array([100.0 * getattr(peak, name) / peak.hz for peak in peaks])
        panel.barh(y + 0.24 * (k - 1), np.maximum(values, 1e-12), height=0.22, color=colour)
    panel.plot([100.0 * peak.sd_hz / peak.hz for peak in peaks], y, "|", color="black", ms=8)
    panel.set(xscale="log", xlim=(least, 300.0 * largest), yticks=y)
    panel.set_yticklabels([f"{peak.hz:.1f}" for peak in peaks], fontsize=SMALL - 1)
    panel.invert_yaxis()
    panel.set_xlabel("standard error, % of the frequency", fontsize=SMALL)
    panel.grid(axis="x", color=LIGHT, lw=0.5)
    panel.set_axisbelow(True)
    handles = [_bar(colour, words) for _, colour, words in parts]
    legend_below(figure, [*handles, _line("black", "all together")], 2)
    told = f"Standard errors from {100 * min((p.sd_hz / p.hz for p in peaks), default=0):.2g} to {100 * largest:.2g} %."
    caption = (
        "How well each frequency (Hz, at the left) is known, and why not better. Noise falls with more hits; what hits "
        "and places scatter beyond it falls with steadier hits and supports; the choice of lines counts where a peak "
        "is not simple."
    )
    return Picture("errors", "How well the frequencies are known", told, caption, figure)


def stability_picture(report: PickReport, paths: Sequence[Path]) -> Picture:
    """Where the search found modes with one mode in a window, with two, and so on."""
    figure, (panel,) = stacked([2.2], left=0.55, right=0.2, bottom=0.75, top=0.05)
    widths = sorted({path.width for path in paths}, reverse=True)
    for width, colour, mark in zip(widths, (BLUE, VERMILLION), ("o", "x"), strict=False):
        for path in (one for one in paths if one.width == width):
            for order, hertz in enumerate(path.orders, start=1):
                panel.plot(hertz, np.full(len(hertz), order), mark, color=colour, ms=2.4, mew=0.7, mfc="none")
    for peak in report.peaks:
        panel.axvline(peak.hz, color=ORANGE if peak.is_likely else LIGHT, lw=0.6, zorder=0)
    _limits(panel, report)
    panel.set_ylabel("modes in the fit", fontsize=SMALL)
    names = [
        _mark(c, m, f"windows of {w:g} Hz") for w, c, m in zip(widths, (BLUE, VERMILLION), ("o", "x"), strict=False)
    ]
    legend_below(figure, [*names, _line(ORANGE, "mode")], 3)
    caption = (
        "Each row of marks is a fit with one mode more, in windows of two widths. A mode stands in one upright line: "
        "it is found again whatever else is fitted. Marks that wander, or that one width of window alone shows, "
        "are of noise or of a peak that is not simple."
    )
    return Picture(
        "stability", "Whether the modes stay where they are", f"{len(report.peaks)} peaks examined.", caption, figure
    )


def _limits(panel: Axes, report: PickReport) -> None:
    panel.set_xscale("log")
    panel.set_xlim(report.lowest_hz, report.highest_hz)
    ticks = [t for t in (20, 50, 100, 200, 500, 1000, 2000, 5000, 10_000) if report.lowest_hz <= t <= report.highest_hz]
    panel.set_xticks(ticks, [str(tick) for tick in ticks])
    panel.minorticks_off()
    panel.set_xlabel("Hz", fontsize=SMALL)


def _names(panel: Axes, peaks: Sequence[PickedRow]) -> None:
    """Frequencies and labels upright above the panel, moved apart where they would overlap."""
    if not peaks:
        return
    low, high = np.log(panel.get_xlim())
    wanted = (np.log([peak.hz for peak in peaks]) - low) / (high - low)
    for place, true, peak in zip(moved_apart(wanted, _APART), wanted, peaks, strict=True):
        panel.plot([true, place], [1.0, 1.04], transform=panel.transAxes, color=DARK, lw=0.4, clip_on=False)
        label = f" {short_label(peak.labels[0].label)}" if peak.labels and peak.labels[0].probability > 0.5 else ""
        words = f"{peak.hz:.1f}{label}"
        at: dict[str, Any] = {"transform": panel.transAxes, "rotation": 90, "ha": "center", "va": "bottom"}
        panel.text(place, 1.05, words, fontsize=SMALL - 1.5, **at)


def _line(colour: str, words: str, style: str = "-") -> object:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, lw=1.2, ls=style, label=words)


def _bar(colour: str, words: str) -> object:
    from matplotlib.patches import Patch

    return Patch(color=colour, label=words)


def _mark(colour: str, mark: str, words: str) -> object:
    from matplotlib.lines import Line2D

    return Line2D([], [], color=colour, ls="", marker=mark, ms=4, mfc="none", label=words)
