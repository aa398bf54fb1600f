"""What `pick` prints: the table of modes, what was set aside and why, and what to do next."""

from __future__ import annotations

from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.results.tables import Table
from bayesplate.results.words import MISSING, chances, percent, two_digits
from bayesplate.workflow.shown import Shown

MOST_SET_ASIDE = 8


def show_pick(report: PickReport) -> Shown:
    """The report of `bayesplate.workflow.pick.pick` for a person."""
    aside = [peak for peak in report.peaks if not peak.is_likely]
    told = [f"set aside: {_aside(peak)}" for peak in aside[:MOST_SET_ASIDE]]
    if len(aside) > MOST_SET_ASIDE:
        told.append(f"and {len(aside) - MOST_SET_ASIDE} more, which the page and --json list")
    hits = "1 ring-down" if report.n_hits == 1 else f"{report.n_hits} ring-downs"
    places = "one pair of places" if report.n_places == 1 else f"{report.n_places} pairs of places"
    closing = (
        f"{len(report.likely)} modes between {report.lowest_hz:g} and {report.highest_hz:g} Hz, from {hits} of "
        f"{report.seconds:.1f} s between {places}."
    )
    if not report.likely:
        closing += " Is the board among what was recorded? --highest looks further up."
    return Shown((picked_table(report),), tuple(told), report.remarks, closing)


def picked_table(report: PickReport) -> Table:
    """Each likely mode: frequency with its standard error, damping, sign, doubt, label."""
    has_signs = any(peak.sign for peak in report.likely)
    has_labels = any(peak.labels for peak in report.likely)
    rows = []
    for peak in report.likely:
        cells = [
            f"{peak.hz:.2f}",
            f"± {two_digits(peak.sd_hz)}",
            f"{peak.damping_percent:.2f}",
            *([peak.sign or MISSING] if has_signs else []),
            percent(peak.spurious_probability),
            *([chances(peak.may_be(2))] if has_labels else []),
        ]
        rows.append(tuple(cells))
    signs, labels = (("sign",) if has_signs else ()), (("mode",) if has_labels else ())
    return Table("Picked modes", ("Hz", "st. error", "damping, %", *signs, "no mode", *labels), tuple(rows))


def _aside(peak: PickedRow) -> str:
    reason = "no stronger than noise" if peak.kind == "noise" else peak.kind
    return f"{peak.hz:.1f} Hz, {reason} (no mode: {percent(peak.spurious_probability)})"
