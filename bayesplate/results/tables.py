"""The tables that people read of a fit: constants with plus-minus, modes in cents; text cells only, no layout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.frequencies.laws import cents
from bayesplate.results.modes import ModeRow
from bayesplate.results.peaks import LEAST
from bayesplate.results.summary import Summary
from bayesplate.results.words import (
    CONSTANTS,
    GPA,
    MISSING,
    chances,
    decimals,
    interval,
    mode_name,
    narrow_name,
    number,
    plus_minus,
    two_digits,
)

_MARKS = {"card": "", "doubtful": " ?", "proposed": " *"}
_MARKED = {"doubtful": "; ? label in doubt", "proposed": "; * label proposed here"}
MOST_LISTED = 3
"""Modes that a table gives for one peak."""


@dataclass(frozen=True)
class Table:
    """A table of text.

    Attributes
    ----------
    title : str
    columns : tuple of str
    rows : tuple of tuple of str
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def constants_table(summary: Summary) -> Table:
    """The elastic constants of a fit: mean, plus-minus, 90 % interval, beside weighted least squares."""
    rows = []
    for name in CONSTANTS:
        entry = summary.elastic[name]
        least_squares = number(summary.weighted_least_squares[name], decimals(entry.sd * GPA), factor=GPA)
        share = two_digits(entry.sd / entry.mean, 100)
        told = narrow_name(name, isotropic=summary.model.isotropic)
        rows.append((told, plus_minus(entry, GPA), interval(entry, GPA), share, least_squares))
    return Table(
        f"Elastic constants of {summary.name}, GPa",
        ("constant", "mean ± sd", "90 % interval", "sd, %", "weighted"),
        tuple(rows),
    )


def modes_table(summary: Summary) -> Table:
    """Each labelled mode: measured, predicted, the one over the other with its interval, and the error left out.

    The rounding interval stands beside the error where it is wider than the noise: there it decides.
    """
    several = len({mode.setup for mode in summary.modes}) > 1
    halves = [rounding_that_decides(summary, mode) for mode in summary.modes]
    is_rounded = any(half is not None for half in halves)
    rows = []
    for mode, half in zip(summary.modes, halves, strict=True):
        low, high = mode.residual_interval_cents
        rounding = (MISSING if half is None else f"± {half:.1f}",) if is_rounded else ()
        rows.append(
            (
                mode_name(mode.label, mode.setup, several=several) + _MARKS[mode.label_origin],
                f"{mode.measured_hz:.6g}",
                f"{mode.predicted_hz.mean:.1f}",
                number(mode.residual_cents, 1, signed=True),
                f"{number(low, 1, signed=True)} to {number(high, 1, signed=True)}",
                *rounding,
                number(mode.left_out_cents, 1, signed=True),
            )
        )
    rounded = ("rounding",) if is_rounded else ()
    marked = "".join(
        words for origin, words in _MARKED.items() if origin in {mode.label_origin for mode in summary.modes}
    )
    return Table(
        f"Modes, Hz; errors, cents (17 cents are about 1 %){marked}",
        ("mode", "measured", "predicted", "error", "90 % interval", *rounded, "left out"),
        tuple(rows),
    )


def rounding_that_decides(summary: Summary, mode: ModeRow) -> float | None:
    """Half the width of a reading's rounding interval, cents, where that is wider than the noise; None elsewhere."""
    if mode.rounding_cents is None:
        return None
    width = mode.rounding_cents[1] - mode.rounding_cents[0]
    return 0.5 * width if width > noise_cents(summary, mode) else None


def noise_cents(summary: Summary, mode: ModeRow) -> float:
    """Standard deviation of the noise of a mode's setup, cents."""
    return float(cents(np.asarray(summary.noise[mode.setup].q50)))


def peaks_table(summary: Summary) -> Table | None:
    """Peaks whose label is not sure beside the modes that they may be; None if there are none."""
    if not summary.peaks:
        return None
    several = len(summary.spectra) > 1
    rows = []
    for peak in summary.peaks:
        found = {one.label: one.probability for one in peak.assignments[:MOST_LISTED]}
        if peak.spurious_probability >= LEAST:
            found["no mode"] = peak.spurious_probability
        name = f"{peak.hz:.6g}" + (f" {peak.setup}" if several else "")
        miss = number(peak.residual_cents, 1, signed=True)
        rows.append((name, peak.stated or MISSING, chances(found), f"{peak.predicted_hz.mean:.1f}", miss))
    return Table(
        "Peaks and the modes that they may be",
        ("peak, Hz", "on the card", "probability", "predicted, Hz", "cents"),
        tuple(rows),
    )
