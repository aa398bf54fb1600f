"""recordings.html: the spectra of all places, the modes in them, what is known of each, and what was set aside."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.recordings.modes_found import Path as FoundPath
from bayesplate.recordings.picking import Picked
from bayesplate.recordings.spectra import Spectra
from bayesplate.report.modes import short_label
from bayesplate.report.page import from_template, save_page
from bayesplate.report.saving import drawing
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
    hertz_axis,
    in_rows,
    key,
    legend_below,
    short,
    stacked,
    upright_names,
)
from bayesplate.results.tables import Table
from bayesplate.results.words import Value, chances, percent

MOST_PLACES = 8
_STEP = 30.0
"""dB between the curves of two places."""
_LEAST_DB = -75.0
_LINES = {True: "-", False: ":"}
"""Of peaks that are likely a mode, and of the others."""
_PARTS = (
    ("noise_hz", BLUE, "noise"),
    ("scatter_hz", ORANGE, "between hits and places"),
    ("window_hz", SKY, "choice of lines"),
)


class Averaged(NamedTuple):
    """The response between two places over frequency in Hz, averaged over hits, and their coherence, 0 to 1."""

    name: str
    frequency: Floats
    level: Floats
    coherence: Floats | None


def averaged(spectra: Spectra) -> tuple[Averaged, ...]:
    """The magnitude of H1 for each pair of places; without a force that of the spectra, each over its own strength.

    H1 is the sum over hits of the conjugate of the force times the response, over the sum of the force's power: noise
    of the response averages out of it. The coherence is the share of the response's power that the force explains.
    """
    found = []
    for place in range(len(spectra.between)):
        own = spectra.places == place
        y, coherence = spectra.values[:, own], None
        if spectra.force is None:
            y = y / np.maximum(np.sqrt(np.mean(np.abs(y) ** 2, axis=0)), 1e-300)
            level = np.sqrt(np.mean(np.abs(y) ** 2, axis=1))
        else:
            f = spectra.force[:, own]
            power = np.maximum(np.sum(np.abs(f) ** 2, axis=1), 1e-300)
            cross = np.abs(np.sum(f.conj() * y, axis=1))
            level = cross / power
            if own.sum() > 1:
                coherence = cross**2 / power / np.maximum(np.sum(np.abs(y) ** 2, axis=1), 1e-300)
        name = spectra.names[int(np.flatnonzero(own)[0])].rpartition(" hit ")[0] or spectra.names[0]
        found.append(Averaged(name, spectra.frequency, level, coherence))
    return tuple(found)


def spectra_picture(report: PickReport, averaged: Sequence[Averaged]) -> Picture:
    """The averaged response of every pair of places with the modes that were picked, and the coherence."""
    shown = averaged[:MOST_PLACES]
    coherent = [one for one in shown if one.coherence is not None]
    heights = [1.2 + 0.55 * len(shown), *([0.8] if coherent else [])]
    figure, panels = stacked(heights, left=0.25, right=0.2, bottom=0.62, top=0.75, gap=0.25)
    panel = panels[0]
    hertz_axis(panel, report.lowest_hz, report.highest_hz)
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
        panel.axvline(peak.hz, color=ORANGE if peak.is_likely else GREY, lw=0.5, ls=_LINES[peak.is_likely], zorder=0)
    panel.set(ylim=(low, high), yticks=[])
    panel.spines["left"].set_visible(False)
    upright_names(panel, [peak.hz for peak in report.likely], [_name(peak) for peak in report.likely], 1.0, 1.04)
    if coherent:
        lower = panels[1]
        for one in coherent:
            lower.plot(one.frequency, np.asarray(one.coherence), color=GREEN, lw=0.4, alpha=0.8)
        hertz_axis(lower, report.lowest_hz, report.highest_hz)
        lower.set(ylim=(0.0, 1.05), yticks=[0, 1])
        lower.text(0.0, 1.07, "coherence", transform=lower.transAxes, fontsize=SMALL, va="bottom")
        panel.tick_params(labelbottom=False)
        panel.set(xlabel="")
    keys = [key("response, dB", BLUE), key("mode", ORANGE), key("set aside", GREY, ls=_LINES[False])]
    legend_below(figure, 4, *keys, *([key("coherence", GREEN)] if coherent else []))
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
    names = [f"{peak.hz:.1f}" for peak in peaks]
    figure, panel = in_rows(names, row=0.16, size=SMALL - 1, left=0.75, right=0.2, bottom=0.82, top=0.05)
    rows = np.arange(len(peaks))
    for k, (part, colour, words) in enumerate(_PARTS):
        values = [max(100.0 * getattr(peak, part) / peak.hz, 1e-12) for peak in peaks]
        panel.barh(rows + 0.24 * (k - 1), values, height=0.22, color=colour, label=words)
    whole = [100.0 * peak.sd_hz / peak.hz for peak in peaks]
    panel.plot(whole, rows, "|", color="black", ms=8, label="all together")
    least, most = min(whole, default=0.01), max(whole, default=0.01)
    panel.set(xscale="log", xlim=(0.1 * least, 3.0 * most), xlabel="standard error, % of the frequency")
    legend_below(figure, 2)
    told = f"Standard errors from {least:.2g} to {most:.2g} %." if peaks else "No modes."
    caption = (
        "How well each frequency (Hz, at the left) is known, and why not better. Noise falls with more hits; what hits "
        "and places scatter beyond it falls with steadier hits and supports; the choice of lines counts where a peak "
        "is not simple."
    )
    return Picture("errors", "How well the frequencies are known", told, caption, figure)


def stability_picture(report: PickReport, paths: Sequence[FoundPath]) -> Picture:
    """The modes that the search found with one mode in a window, with two, and so on."""
    figure, (panel,) = stacked([2.2], left=0.55, right=0.2, bottom=0.75, top=0.05)
    widths = sorted({path.width for path in paths}, reverse=True)
    keys = []
    for width, colour, mark in zip(widths, (BLUE, VERMILLION), ("o", "x"), strict=False):
        style: Any = {"color": colour, "mew": 0.7, "mfc": "none"}
        for path in (one for one in paths if one.width == width):
            for order, hertz in enumerate(path.orders, start=1):
                panel.plot(hertz, np.full(len(hertz), order), mark, ms=2.4, **style)
        keys.append(key(f"windows of {width:g} Hz", marker=mark, mec=colour, ms=4, ls="", **style))
    for peak in report.peaks:
        panel.axvline(peak.hz, color=ORANGE if peak.is_likely else LIGHT, lw=0.6, zorder=0)
    hertz_axis(panel, report.lowest_hz, report.highest_hz)
    panel.set(ylabel="modes in the fit")
    legend_below(figure, 3, *keys, key("mode", ORANGE, lw=1.2))
    caption = (
        "Each row of marks is a fit with one mode more, in windows of two widths. A mode stands in one upright line: "
        "it is found again whatever else is fitted. Marks that wander, or that one width of window alone shows, "
        "are of noise or of a peak that is not simple."
    )
    return Picture(
        "stability", "Whether the modes stay where they are", f"{len(report.peaks)} peaks examined.", caption, figure
    )


def _name(peak: PickedRow) -> str:
    """Its frequency in Hz, and its likeliest mode where there is one."""
    likeliest = peak.labels[0] if peak.labels else None
    return f"{peak.hz:.1f}" + (f" {short_label(likeliest.label)}" if likeliest and likeliest.probability > 0.5 else "")


@drawing()
def write_recordings_page(folder: Path, report: PickReport, picked: Picked) -> Path:
    """Write the page and its figures as PNG and SVG; returns the path of the page."""
    aside = [peak for peak in report.peaks if not peak.is_likely]
    responses = averaged(picked.spectra)
    every = [spectra_picture(report, responses), errors_picture(report), stability_picture(report, picked.paths)]
    return save_page(
        folder / "recordings.html",
        {"every": every},
        lambda pictures: from_template(
            "recordings.html",
            title=", ".join(report.files[:3]) + (" and others" if len(report.files) > 3 else ""),
            sentences=sentences(report),
            remarks=report.remarks,
            pictures=pictures["every"],
            modes_table=modes_table(report),
            aside_table=aside_table(aside) if aside else None,
            fragment=report.fragment.splitlines(),
        ),
    )


def sentences(report: PickReport) -> tuple[str, ...]:
    hits = "One ring-down" if report.n_hits == 1 else f"{report.n_hits} ring-downs"
    places = "one pair of places" if report.n_places == 1 else f"{report.n_places} pairs of places"
    told = [
        f"{hits} of {report.seconds:.1f} s between {places} show {len(report.likely)} modes between "
        f"{report.lowest_hz:g} and {report.highest_hz:g} Hz."
    ]
    if report.likely:
        share = sorted(peak.sd_hz / peak.hz for peak in report.likely)
        doubt = sum(peak.spurious_probability for peak in report.likely)
        told.append(
            f"Half of the frequencies are known to {100.0 * share[len(share) // 2]:.2g} % or better, the worst to "
            f"{100.0 * share[-1]:.2g} %. Of these peaks, {doubt:.1f} are expected to be no mode of the board."
        )
    if report.polarity:
        told.append(
            f"Force and response have {'one polarity' if report.polarity == 'same' else 'opposite polarities'}."
        )
    if report.board:
        told.append(f"The labels are those of the board {report.board}; the fit weighs them anew.")
    return tuple(told)


def modes_table(report: PickReport) -> Table:
    """Each likely mode; without signs where none is known, and without labels where no card was given."""
    has_signs, has_labels = (any(getattr(peak, key) for peak in report.likely) for key in ("sign", "labels"))
    rows = tuple(
        (
            Value(peak.hz, peak.sd_hz, unit=" Hz"),
            Value(peak.damping_percent, peak.damping_sd_percent),
            *([peak.sign or None] if has_signs else []),
            f"{peak.amplitude:.3f}",
            percent(peak.spurious_probability, 1),
            *([chances(peak.may_be(3))] if has_labels else []),
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
