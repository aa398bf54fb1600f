"""What `pick` prints: the table of modes, what was set aside and why, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence

from bayesplate.commands.printout import Printout
from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.recordings.plausibility import UNLIKE_HITS
from bayesplate.results.tables import Cell, Row, Table
from bayesplate.results.words import Value, percent, probabilities_text

MOST_SET_ASIDE = 8
_LOUD_AMPLITUDE, _RINGING_DECAYS, _MANY_PEAKS = 0.1, 1.0, 3
"""Strength over the strongest, decay rate times duration, and number of peaks from which on it is likelier that hits
were at several places than that all of these are no modes."""


def show_pick(report: PickReport) -> Printout:
    """The report of `bayesplate.commands.pick.pick` for a person."""
    set_aside = [peak for peak in report.peaks if not peak.is_likely]
    remarks = [f"set aside: {_set_aside_text(peak)}" for peak in set_aside[:MOST_SET_ASIDE]]
    if len(set_aside) > MOST_SET_ASIDE:
        remarks.append(f"and {len(set_aside) - MOST_SET_ASIDE} more, which the page and --json list")
    hits = "1 ring-down" if report.n_hits == 1 else f"{report.n_hits} ring-downs"
    places = "one pair of places" if report.n_places == 1 else f"{report.n_places} pairs of places"
    closing = (
        f"{len(report.likely)} modes between {report.lowest_hz:g} and {report.highest_hz:g} Hz, from {hits} of "
        f"{report.seconds:.1f} s between {places}."
    )
    if not report.likely:
        closing += " Is the board among what was recorded? --highest looks further up."
    return Printout((picked_table(report),), tuple(remarks), report.remarks, closing)


def moved_hit_remarks(peaks: Sequence[PickedRow], seconds: float) -> list[str]:
    """A question where several loud peaks ring down and differ from hit to hit; `seconds` is the length of a decay."""
    loud_peaks = [
        f"{peak.hz:.1f}"
        for peak in peaks
        if peak.kind == UNLIKE_HITS
        and peak.amplitude > _LOUD_AMPLITUDE
        and peak.damping_percent / 100.0 * peak.hz * seconds > _RINGING_DECAYS
        and not peak.is_likely
    ]
    if len(loud_peaks) < _MANY_PEAKS:
        return []
    hertz = ", ".join(loud_peaks[:4]) + " Hz" + " and more" * (len(loud_peaks) > 4)
    return [
        f"{len(loud_peaks)} loud peaks ring down but are {UNLIKE_HITS}, {hertz}: were all hits of a file at one place, "
        "and heard at one? They are set aside, and labels cannot be trusted: record one file for each place, or give "
        "the places"
    ]


def picked_table(report: PickReport) -> Table:
    """Each likely mode: frequency with its standard error, damping, sign, doubt, label."""
    has_signs = any(peak.sign for peak in report.likely)
    has_labels = any(peak.labels for peak in report.likely)
    rows: list[Row] = []
    for peak in report.likely:
        cells: list[Cell] = [
            Value(peak.hz, peak.sd_hz),
            Value(peak.damping_percent, peak.damping_sd_percent),
            *([peak.sign or None] if has_signs else []),
            percent(peak.spurious_probability),
            *([probabilities_text(peak.may_be(2))] if has_labels else []),
        ]
        rows.append(tuple(cells))
    signs, labels = (("sign",) if has_signs else ()), (("mode, if it is one",) if has_labels else ())
    return Table("Picked modes", ("frequency, Hz", "damping, %", *signs, "no mode", *labels), tuple(rows))


def _set_aside_text(peak: PickedRow) -> str:
    reason = "no stronger than noise" if peak.kind == "noise" else peak.kind
    return f"{peak.hz:.1f} Hz, {reason} (no mode: {percent(peak.spurious_probability)})"
