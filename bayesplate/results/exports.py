"""Tables for other programs: the constants as CSV and as LaTeX, and what any such table needs."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from bayesplate.files import write_text
from bayesplate.results.contract import ByConstant, Spread
from bayesplate.results.folder import CONSTANTS
from bayesplate.results.summary import Percentile, Summary
from bayesplate.results.words import GPA, decimals, interval

_STARTS_A_FORMULA = ("=", "+", "-", "@")
_LATEX = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "$": r"\$",
    "&": r"\&",
    "#": r"\#",
    "%": r"\%",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
    "|": r"\textbar{}",
    '"': r"\textquotedbl{}",
}

Cell = str | float | int | None


def write_exports(folder: Path, summary: Summary, title: str) -> tuple[Path, ...]:
    """Write the tables of a fit.

    Parameters
    ----------
    folder : Path
        Must be there.
    summary : Summary
    title : str
        Of the board; any text.

    Returns
    -------
    tuple of Path
    """
    texts = dict(zip(CONSTANTS, (constants_csv(summary), constants_tex(summary, title)), strict=True))
    for name, text in texts.items():
        write_text(folder / name, text)
    return tuple(folder / name for name in texts)


def constants_csv(summary: Summary) -> str:
    """Moduli in GPa and rigidities in N m: mean, sd, quantiles, and the older methods' estimates, at full precision."""
    header = ["constant", "unit", "mean", "sd", "q05", "q25", "q50", "q75", "q95"]
    header += ["least_squares", "weighted_least_squares", "percentile_mean", "percentile_sd_percent"]
    rows: list[list[Cell]] = [list(header)]
    groups: tuple[tuple[ByConstant[Spread], str, float], ...] = (
        (summary.elastic, "GPa", GPA),
        (summary.rigidity, "N m", 1.0),
    )
    for group, unit, factor in groups:
        for name, one in group.items():
            spread = [value * factor for value in (one.mean, one.sd, one.q05, one.q25, one.q50, one.q75, one.q95)]
            both = (summary.least_squares, summary.weighted_least_squares)
            points = [_scaled(estimate[name], factor) for estimate in both]
            rows.append([name, unit, *spread, *points, *_trimmed(summary.percentile, name)])
    return csv_text(rows)


def _trimmed(percentile: Percentile | None, name: str) -> tuple[float | None, float | None]:
    """Mean (GPa) and spread (per cent) of the percentile method, which estimates moduli alone."""
    if percentile is None or name not in percentile.NAMES:
        return None, None
    return _scaled(percentile[name].mean, GPA), percentile[name].sd_percent


def constants_tex(summary: Summary, title: str) -> str:
    """The moduli as a table to paste into a paper: a tabular that needs no package."""
    rows = []
    for name, entry in summary.elastic.items():
        digits = decimals(entry.sd * GPA)
        symbol = f"${name[0]}_{{{name[2:]}}}$"
        both = (summary.least_squares, summary.weighted_least_squares)
        points = [_rounded(estimate[name], digits) for estimate in both]
        spread = rf"${entry.mean * GPA:.{digits}f} \pm {entry.sd * GPA:.{digits}f}$"
        rows.append([symbol, spread, interval(entry, GPA), *points])
    header = ["GPa", r"mean $\pm$ sd", r"90\,\% interval", "paper's least squares", "weighted"]
    source = f"% Elastic constants of {latex(title)}, seed {summary.seed}, {len(summary.modes)} modes"
    return tabular(source, header, rows)


def csv_text(rows: Sequence[Sequence[Cell]]) -> str:
    """Rows as CSV with full precision, texts on one line; what looks like a formula begins with an apostrophe."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerows([_cell(value) for value in row] for row in rows)
    return stream.getvalue()


def latex(text: str) -> str:
    """A text as LaTeX prints it: its special characters escaped, all on one line."""
    return "".join(_LATEX.get(character, character) for character in " ".join(text.split()))


def tabular(comment: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A tabular of finished cells under a comment."""
    lines = [" & ".join(row) + r" \\" for row in (header, *rows)]
    columns = "l" + "r" * (len(header) - 1)
    body = [lines[0], r"\hline", *lines[1:], r"\hline"]
    return "\n".join([comment, rf"\begin{{tabular}}{{{columns}}}", r"\hline", *body, r"\end{tabular}", ""])


def _cell(value: Cell) -> str:
    if value is None:
        return ""
    if isinstance(value, str):
        line = " ".join(value.split())
        return f"'{line}" if line.startswith(_STARTS_A_FORMULA) else line
    return repr(value)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _rounded(value: float | None, digits: int, factor: float = GPA) -> str:
    return "--" if value is None else f"{value * factor:.{digits}f}"
