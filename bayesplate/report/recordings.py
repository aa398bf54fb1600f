"""recordings.html: spectra of all pairs of places, the picked modes, and the peaks that were set aside."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.recordings.modes_found import StabilityPath as FoundPath
from bayesplate.recordings.picking import PickedModes
from bayesplate.recordings.spectra import Spectra
from bayesplate.report.modes import short_label
from bayesplate.report.page import render_page, save_page
from bayesplate.report.saving import matplotlib_defaults
from bayesplate.report.style import (
    BLUE,
    DARK,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    SMALL_SIZE,
    VERMILLION,
    Picture,
    draw_legend,
    draw_upright_names,
    drawable_text,
    legend_entry,
    panel_with_rows,
    set_hertz_axis,
    shorten,
    stacked_panels,
)
from bayesplate.results.tables import Table
from bayesplate.results.words import Value, percent, probabilities_text

MOST_PLACES = 8
_CURVE_STEP_DB = 30.0
"""dB between the curves of two pairs of places."""
_LEAST_DB = -75.0
_LINE_STYLES = {True: "-", False: ":"}
"""Line styles of peaks that are likely a mode, and of the others."""
_ERROR_PARTS = (
    ("noise_hz", BLUE, "noise"),
    ("scatter_hz", ORANGE, "between hits and places"),
    ("window_hz", SKY, "choice of lines"),
)


class AveragedResponse(NamedTuple):
    """The response between two places over frequency in Hz, averaged over hits, and their coherence, 0 to 1."""

    name: str
    frequency: Floats
    level: Floats
    coherence: Floats | None


def averaged_responses(spectra: Spectra) -> tuple[AveragedResponse, ...]:
    """Magnitude of H1 for each pair of places; without a force, rms of the spectra, each normalised by its rms.

    H1 is the sum over hits of the conjugate of the force times the response, over the sum of the force's power: noise
    of the response averages out of it. The coherence is the share of the response's power that the force explains.
    """
    responses = []
    for place in range(len(spectra.place_pairs)):
        of_place = spectra.places == place
        y, coherence = spectra.values[:, of_place], None
        if spectra.force is None:
            y = y / np.maximum(np.sqrt(np.mean(np.abs(y) ** 2, axis=0)), 1e-300)
            level = np.sqrt(np.mean(np.abs(y) ** 2, axis=1))
        else:
            f = spectra.force[:, of_place]
            power = np.maximum(np.sum(np.abs(f) ** 2, axis=1), 1e-300)
            cross = np.abs(np.sum(f.conj() * y, axis=1))
            level = cross / power
            if of_place.sum() > 1:
                coherence = cross**2 / power / np.maximum(np.sum(np.abs(y) ** 2, axis=1), 1e-300)
        name = spectra.file_names[int(np.flatnonzero(of_place)[0])]
        responses.append(AveragedResponse(name, spectra.frequency, level, coherence))
    return tuple(responses)


def spectra_picture(report: PickReport, averaged: Sequence[AveragedResponse]) -> Picture:
    """The averaged response of every pair of places with the picked modes, and the coherence."""
    responses = averaged[:MOST_PLACES]
    coherent = [response for response in responses if response.coherence is not None]
    heights = [1.2 + 0.55 * len(responses), *([0.8] if coherent else [])]
    figure, panels = stacked_panels(heights, left=0.25, right=0.2, bottom=0.62, top=0.75, gap=0.25)
    panel = panels[0]
    set_hertz_axis(panel, report.lowest_hz, report.highest_hz)
    for i, response in enumerate(responses):
        in_band = (response.frequency >= report.lowest_hz) & (response.frequency <= report.highest_hz)
        level = 20.0 * np.log10(np.maximum(response.level[in_band] / response.level[in_band].max(), 1e-12))
        panel.plot(response.frequency[in_band], np.maximum(level, _LEAST_DB) - _CURVE_STEP_DB * i, color=BLUE, lw=0.6)
        if len(responses) > 1:
            height = level[0] - _CURVE_STEP_DB * i - 1.0
            name = shorten(drawable_text(response.name), 24)
            panel.text(
                report.lowest_hz, height, name, fontsize=SMALL_SIZE - 1.5, va="top", color=DARK, parse_math=False
            )
    low, high = panel.get_ylim()
    for peak in report.peaks:
        panel.axvline(
            peak.hz, color=ORANGE if peak.is_likely else GREY, lw=0.5, ls=_LINE_STYLES[peak.is_likely], zorder=0
        )
    panel.set(ylim=(low, high), yticks=[])
    panel.spines["left"].set_visible(False)
    draw_upright_names(
        panel, [peak.hz for peak in report.likely], [_peak_name(peak) for peak in report.likely], 1.0, 1.04
    )
    if coherent:
        lower_panel = panels[1]
        for response in coherent:
            lower_panel.plot(response.frequency, np.asarray(response.coherence), color=GREEN, lw=0.4, alpha=0.8)
        set_hertz_axis(lower_panel, report.lowest_hz, report.highest_hz)
        lower_panel.set(ylim=(0.0, 1.05), yticks=[0, 1])
        lower_panel.text(0.0, 1.07, "coherence", transform=lower_panel.transAxes, fontsize=SMALL_SIZE, va="bottom")
        panel.tick_params(labelbottom=False)
        panel.set(xlabel="")
    entries = [
        legend_entry("response, dB", BLUE),
        legend_entry("mode", ORANGE),
        legend_entry("set aside", GREY, ls=_LINE_STYLES[False]),
    ]
    draw_legend(figure, 4, *entries, *([legend_entry("coherence", GREEN)] if coherent else []))
    details = (
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
    return Picture("spectra", "What was heard, and the modes in it", details, caption.strip(), figure)


def errors_picture(report: PickReport) -> Picture:
    """Parts of the standard error of each mode, in per cent of its frequency."""
    peaks = report.likely
    names = [f"{peak.hz:.1f}" for peak in peaks]
    figure, panel = panel_with_rows(names, row=0.16, size=SMALL_SIZE - 1, left=0.75, right=0.2, bottom=0.82, top=0.05)
    rows = np.arange(len(peaks))
    for k, (part, colour, words) in enumerate(_ERROR_PARTS):
        values = [max(100.0 * getattr(peak, part) / peak.hz, 1e-12) for peak in peaks]
        panel.barh(rows + 0.24 * (k - 1), values, height=0.22, color=colour, label=words)
    totals = [100.0 * peak.sd_hz / peak.hz for peak in peaks]
    panel.plot(totals, rows, "|", color="black", ms=8, label="all together")
    least, most = min(totals, default=0.01), max(totals, default=0.01)
    panel.set(xscale="log", xlim=(0.1 * least, 3.0 * most), xlabel="standard error, % of the frequency")
    draw_legend(figure, 2)
    details = f"Standard errors from {least:.2g} to {most:.2g} %." if peaks else "No modes."
    caption = (
        "How well each frequency (Hz, at the left) is known, and why not better. Noise falls with more hits; what hits "
        "and places scatter beyond it falls with steadier hits and supports; the choice of lines counts where a peak "
        "is not simple."
    )
    return Picture("errors", "How well the frequencies are known", details, caption, figure)


def stability_picture(report: PickReport, paths: Sequence[FoundPath]) -> Picture:
    """Stability diagram: frequencies of the fits with one mode in a window, with two, and so on."""
    figure, (panel,) = stacked_panels([2.2], left=0.55, right=0.2, bottom=0.75, top=0.05)
    widths = sorted({path.width for path in paths}, reverse=True)
    entries = []
    for width, colour, marker in zip(widths, (BLUE, VERMILLION), ("o", "x"), strict=False):
        style: Any = {"color": colour, "mew": 0.7, "mfc": "none"}
        for path in (path for path in paths if path.width == width):
            for order, hertz in enumerate(path.orders, start=1):
                panel.plot(hertz, np.full(len(hertz), order), marker, ms=2.4, **style)
        entries.append(legend_entry(f"windows of {width:g} Hz", marker=marker, mec=colour, ms=4, ls="", **style))
    for peak in report.peaks:
        panel.axvline(peak.hz, color=ORANGE if peak.is_likely else LIGHT, lw=0.6, zorder=0)
    set_hertz_axis(panel, report.lowest_hz, report.highest_hz)
    panel.set(ylabel="modes in the fit")
    draw_legend(figure, 3, *entries, legend_entry("mode", ORANGE, lw=1.2))
    caption = (
        "Each row of marks is a fit with one mode more, in windows of two widths. A mode stands in one upright line: "
        "it is found again whatever else is fitted. Marks that wander, or that one width of window alone shows, "
        "are of noise or of a peak that is not simple."
    )
    return Picture(
        "stability", "Whether the modes stay where they are", f"{len(report.peaks)} peaks examined.", caption, figure
    )


def _peak_name(peak: PickedRow) -> str:
    """Frequency of a peak in Hz, and its label where one has a probability above one half."""
    likeliest = peak.labels[0] if peak.labels else None
    return f"{peak.hz:.1f}" + (f" {short_label(likeliest.label)}" if likeliest and likeliest.probability > 0.5 else "")


@matplotlib_defaults()
def write_recordings_page(folder: Path, report: PickReport, picked: PickedModes) -> Path:
    """Write the page and its figures as PNG and SVG; returns the path of the page."""
    set_aside = [peak for peak in report.peaks if not peak.is_likely]
    responses = averaged_responses(picked.spectra)
    pictures = [spectra_picture(report, responses), errors_picture(report), stability_picture(report, picked.paths)]
    return save_page(
        folder / "recordings.html",
        {"every": pictures},
        lambda pictures: render_page(
            "recordings.html",
            title=", ".join(report.files[:3]) + (" and others" if len(report.files) > 3 else ""),
            sentences=recordings_sentences(report),
            remarks=report.remarks,
            pictures=pictures["every"],
            modes_table=picked_modes_table(report),
            aside_table=aside_table(set_aside) if set_aside else None,
            fragment=report.fragment.splitlines(),
        ),
    )


def recordings_sentences(report: PickReport) -> tuple[str, ...]:
    hits = "One ring-down" if report.n_hits == 1 else f"{report.n_hits} ring-downs"
    places = "one pair of places" if report.n_places == 1 else f"{report.n_places} pairs of places"
    sentences = [
        f"{hits} of {report.seconds:.1f} s between {places} show {len(report.likely)} modes between "
        f"{report.lowest_hz:g} and {report.highest_hz:g} Hz."
    ]
    if report.likely:
        share = sorted(peak.sd_hz / peak.hz for peak in report.likely)
        doubt = sum(peak.spurious_probability for peak in report.likely)
        sentences.append(
            f"Half of the frequencies are known to {100.0 * share[len(share) // 2]:.2g} % or better, the worst to "
            f"{100.0 * share[-1]:.2g} %. Of these peaks, {doubt:.1f} are expected to be no mode of the board."
        )
    if report.polarity:
        sentences.append(
            f"Force and response have {'one polarity' if report.polarity == 'same' else 'opposite polarities'}."
        )
    if report.board:
        sentences.append(f"The labels are those of the board {report.board}; the fit weighs them anew.")
    return tuple(sentences)


def picked_modes_table(report: PickReport) -> Table:
    """The table of likely modes; without signs where none is known, without labels where no card was given."""
    has_signs, has_labels = (any(getattr(peak, key) for peak in report.likely) for key in ("sign", "labels"))
    rows = tuple(
        (
            Value(peak.hz, peak.sd_hz, unit=" Hz"),
            Value(peak.damping_percent, peak.damping_sd_percent),
            *([peak.sign or None] if has_signs else []),
            f"{peak.amplitude:.3f}",
            percent(peak.spurious_probability, 1),
            *([probabilities_text(peak.may_be(3))] if has_labels else []),
        )
        for peak in report.likely
    )
    signs, labels = (["sign"] if has_signs else []), (["mode, if it is one"] if has_labels else [])
    return Table("Modes", ("frequency", "damping, %", *signs, "strength", "no mode", *labels), rows)


def aside_table(aside: list[PickedRow]) -> Table:
    rows = tuple(
        (f"{peak.hz:.2f}", peak.kind or None, f"{peak.amplitude:.3f}", percent(peak.spurious_probability, 1))
        for peak in aside
    )
    return Table("Set aside", ("Hz", "taken for", "strength", "no mode"), rows)
