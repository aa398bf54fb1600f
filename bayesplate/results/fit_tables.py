"""The tables of a fit: constants with plus-minus, modes in cents, peaks; the constants as CSV and LaTeX."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bayesplate.files import write_text
from bayesplate.frequencies.laws import cents
from bayesplate.results.contract import ByConstant, Spread
from bayesplate.results.folder import CONSTANTS_FILES
from bayesplate.results.modes import LEAST_MODE_PROBABILITY, ModeRow
from bayesplate.results.summary import Percentile, PercentileValue, Summary
from bayesplate.results.tables import Row, Table, constants_table, render
from bayesplate.results.words import GPA, Value, decimals, mode_name, number, probabilities_text, two_digits

_LABEL_MARKS = {"card": "", "doubtful": " ?", "proposed": " *"}
_MARK_WORDS = {"doubtful": "; ? label in doubt", "proposed": "; * label proposed here"}
MOST_MODES_OF_PEAK = 3
"""Modes listed for one peak."""
_NO_PERCENTILE = PercentileValue(None, None)


def fitted_constants(summary: Summary) -> Table:
    """The constants of a fit, with weighted least squares beside them."""

    def weighted(name: str) -> Value:
        return number(summary.weighted_least_squares[name], decimals(summary.elastic[name].sd * GPA), factor=GPA)

    def share(name: str) -> Value:
        return two_digits(summary.elastic[name].sd / summary.elastic[name].mean, 100)

    return constants_table(
        f"Elastic constants of {summary.name}, GPa",
        summary.elastic,
        {"sd, %": share, "weighted least squares": weighted},
        isotropic=summary.model.isotropic,
    )


def compared_constants(summary: Summary, title: str) -> Table:
    """The constants with the older methods beside them, for the page and LaTeX."""

    def point(estimate: ByConstant[float | None], name: str) -> Value:
        return number(estimate[name], decimals(summary.elastic[name].sd * GPA), factor=GPA)

    return constants_table(
        title,
        summary.elastic,
        {
            "paper's least squares": lambda name: point(summary.least_squares, name),
            "weighted least squares": lambda name: point(summary.weighted_least_squares, name),
            "percentile method": lambda name: _percentile_cell(summary.percentile, name),
        },
        isotropic=summary.model.isotropic,
    )


def _percentile_cell(percentile: Percentile | None, name: str) -> Value:
    """Mean and spread of the percentile method, GPa."""
    if percentile is None or (mean := percentile[name].mean) is None:
        return Value()
    share = percentile[name].sd_percent
    return number(mean, 3, factor=GPA) if share is None else Value(mean * GPA, mean * GPA * share / 100)


def exported_constants(summary: Summary) -> Table:
    """The table of constants.csv: spread of moduli (GPa) and rigidities (N m), and the older methods' estimates."""
    statistics = ("mean", "sd", "q05", "q25", "q50", "q75", "q95")
    rows: list[Row] = []
    groups: tuple[tuple[ByConstant[Spread], str, float], ...] = (
        (summary.elastic, "GPa", GPA),
        (summary.rigidity, "N m", 1.0),
    )
    for group, unit, factor in groups:
        for name, spread in group.items():
            trimmed = summary.percentile[name] if summary.percentile and group is summary.elastic else _NO_PERCENTILE
            points = (summary.least_squares[name], summary.weighted_least_squares[name], trimmed.mean)
            numbers = (*(getattr(spread, end) for end in statistics), *points)
            scaled = (None if value is None else value * factor for value in numbers)
            rows.append((name, unit, *scaled, trimmed.sd_percent))
    older = ("least_squares", "weighted_least_squares", "percentile_mean", "percentile_sd_percent")
    return Table("constants", ("constant", "unit", *statistics, *older), tuple(rows))


def write_constants(folder: Path, summary: Summary, title: str) -> tuple[Path, ...]:
    """Write constants.csv and constants.tex into an existing folder; the title of the board may be any text."""
    n = len(summary.modes)
    heading = f"Elastic constants of {title}, GPa; seed {summary.seed}, {n} mode{'s' * (n != 1)}"
    return write_tables(folder, CONSTANTS_FILES, exported_constants(summary), compared_constants(summary, heading))


def write_tables(folder: Path, names: tuple[str, str], number_table: Table, printed_table: Table) -> tuple[Path, ...]:
    """Write a table for programs as CSV and one for people as LaTeX, under these names."""
    paths = tuple(folder / name for name in names)
    write_text(paths[0], render(number_table, "csv"))
    write_text(paths[1], render(printed_table, "latex"))
    return paths


def modes_table(summary: Summary) -> Table:
    """Each labelled mode: measured and predicted frequency, residual with its interval, and leave-one-out error.

    The half-width of the rounding interval is given where the interval is wider than the noise.
    """
    several = len({mode.setup for mode in summary.modes}) > 1
    half_widths = [deciding_rounding(summary, mode) for mode in summary.modes]
    is_rounded = any(half_width is not None for half_width in half_widths)
    rows: list[Row] = []
    for mode, half_width in zip(summary.modes, half_widths, strict=True):
        rounding = (None if half_width is None else f"± {half_width:.1f}",) if is_rounded else ()
        rows.append(
            (
                mode_name(mode.label, mode.setup, several=several) + _LABEL_MARKS[mode.label_origin],
                mode.measured_hz,
                number(mode.predicted_hz.mean, max(decimals(mode.predicted_hz.q95 - mode.predicted_hz.q05) - 1, 1)),
                number(mode.residual_cents, 1, signed=True),
                Value(ends=mode.residual_interval_cents, digits=1, signed=True),
                *rounding,
                number(mode.left_out_cents, 1, signed=True),
            )
        )
    rounded = ("rounding",) if is_rounded else ()
    mark_notes = "".join(
        words for origin, words in _MARK_WORDS.items() if origin in {mode.label_origin for mode in summary.modes}
    )
    return Table(
        f"Modes, Hz; errors, cents (17 cents are about 1 %){mark_notes}",
        ("mode", "measured", "predicted", "error", "90 % interval", *rounded, "left out"),
        tuple(rows),
    )


def deciding_rounding(summary: Summary, mode: ModeRow) -> float | None:
    """Half the width of a reading's rounding interval, cents, where the interval is wider than the noise; else None."""
    if mode.rounding_cents is None:
        return None
    width = mode.rounding_cents[1] - mode.rounding_cents[0]
    return 0.5 * width if width > noise_cents(summary, mode) else None


def noise_cents(summary: Summary, mode: ModeRow) -> float:
    """Standard deviation of the noise of a mode's setup, cents."""
    return float(cents(np.asarray(summary.noise[mode.setup].q50)))


def peaks_table(summary: Summary) -> Table | None:
    """Peaks whose label is not sure, with the modes that they may be; None without such peaks."""
    if not summary.peaks:
        return None
    several = len(summary.spectra) > 1
    rows: list[Row] = []
    for peak in summary.peaks:
        probabilities: dict[str, float] = {}
        for assignment in peak.assignments[:MOST_MODES_OF_PEAK]:  # several may be modes without a clear label
            probabilities[assignment.label] = probabilities.get(assignment.label, 0.0) + assignment.probability
        if peak.spurious_probability >= LEAST_MODE_PROBABILITY:
            probabilities["no mode"] = peak.spurious_probability
        name = f"{peak.hz:.6g}" + (f" {peak.setup}" if several else "")
        miss = number(peak.residual_cents, 1, signed=True)
        rows.append((name, peak.stated, probabilities_text(probabilities), number(peak.predicted_hz.mean, 1), miss))
    return Table(
        "Peaks and the modes that they may be",
        ("peak, Hz", "on the card", "probability", "predicted, Hz", "cents"),
        tuple(rows),
    )
