"""recordings.html: the spectra of all places, the modes in them, what is known of each, and what was set aside."""

from __future__ import annotations

from pathlib import Path

from bayesplate.recordings.contract import PickedRow, PickReport
from bayesplate.recordings.picking import Picked
from bayesplate.recordings.responses import averaged
from bayesplate.report.page import from_template, save_page
from bayesplate.report.recordings_figures import every_picture
from bayesplate.report.saving import drawing
from bayesplate.results.tables import Table
from bayesplate.results.words import MISSING, chances, percent, two_digits

RECORDINGS_PAGE = "recordings.html"


@drawing()
def write_recordings_page(folder: Path, report: PickReport, picked: Picked) -> Path:
    """Write the page and its figures as PNG and SVG.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    report : PickReport
    picked : Picked

    Returns
    -------
    Path
        Of recordings.html.
    """
    aside = [peak for peak in report.peaks if not peak.is_likely]
    return save_page(
        folder / RECORDINGS_PAGE,
        {"every": every_picture(report, averaged(picked.spectra), picked.paths)},
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
    """The page in short."""
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
            f"{100.0 * share[-1]:.2g} %. Of these modes, {doubt:.1f} are expected to be none."
        )
    if report.polarity:
        told.append(
            f"Force and response have {'one polarity' if report.polarity == 'same' else 'opposite polarities'}."
        )
    if report.board:
        told.append(f"The labels are those of the board {report.board}; the fit weighs them anew.")
    return tuple(told)


def modes_table(report: PickReport) -> Table:
    """Every likely mode."""
    rows = tuple(
        (
            f"{peak.hz:.3f} ± {two_digits(peak.sd_hz)}",
            f"{peak.damping_percent:.3f} ± {two_digits(peak.damping_sd_percent)}",
            peak.sign or MISSING,
            f"{peak.amplitude:.3f}",
            percent(peak.spurious_probability, 1),
            chances(peak.may_be(3)),
        )
        for peak in report.likely
    )
    return Table("Modes", ("frequency, Hz", "damping, %", "sign", "strength", "no mode", "label"), rows)


def aside_table(aside: list[PickedRow]) -> Table:
    """What was set aside, and why."""
    rows = tuple(
        (f"{peak.hz:.2f}", peak.kind or MISSING, f"{peak.amplitude:.3f}", percent(peak.spurious_probability, 1))
        for peak in aside
    )
    return Table("Set aside", ("Hz", "taken for", "strength", "no mode"), rows)
