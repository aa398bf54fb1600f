"""Tables for other programs: the constants as CSV and as LaTeX, and what any such table needs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bayesplate.results.folder import CONSTANTS, write_text
from bayesplate.results.tables import decimals

_PA_TO_GPA = 1e-9
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


def write_exports(folder: Path, summary: Mapping[str, Any], title: str) -> tuple[Path, ...]:
    """Write the tables of a fit.

    Parameters
    ----------
    folder : Path
        Must be there.
    summary : dict
        As in summary.json.
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


def constants_csv(summary: Mapping[str, Any]) -> str:
    """Moduli in GPa and rigidities in N m: mean, sd, quantiles, and the older methods' estimates, at full precision."""
    header = ["constant", "unit", "mean", "sd", "q05", "q25", "q50", "q75", "q95"]
    header += ["least_squares", "weighted_least_squares", "percentile_mean", "percentile_sd_percent"]
    rows: list[list[Cell]] = [list(header)]
    for place, unit, factor in (("elastic", "GPa", _PA_TO_GPA), ("rigidity", "N m", 1.0)):
        for name, entry in summary[place].items():
            spread = [entry[key] * factor for key in header[2:9]]
            points = [_scaled(summary[method][name], factor) for method in header[9:11]]
            trimmed = (summary["percentile"] or {}).get(name) or {"mean": None, "sd_percent": None}
            rows.append([name, unit, *spread, *points, _scaled(trimmed["mean"], factor), trimmed["sd_percent"]])
    return csv_text(rows)


def constants_tex(summary: Mapping[str, Any], title: str) -> str:
    """The moduli as a table to paste into a paper: a tabular that needs no package."""
    rows = []
    for name, entry in summary["elastic"].items():
        mean, sd, low, high = (entry[key] * _PA_TO_GPA for key in ("mean", "sd", "q05", "q95"))
        digits = decimals(sd)
        symbol = f"${name[0]}_{{{name[2:]}}}$"
        points = [_rounded(summary[method][name], digits) for method in ("least_squares", "weighted_least_squares")]
        spread = rf"${mean:.{digits}f} \pm {sd:.{digits}f}$"
        rows.append([symbol, spread, f"{low:.{digits}f} to {high:.{digits}f}", *points])
    header = ["GPa", r"mean $\pm$ sd", r"90\,\% interval", "least squares", "weighted"]
    source = f"% Elastic constants of {latex(title)}, seed {summary['seed']}, {len(summary['modes'])} modes"
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


def _rounded(value: float | None, digits: int, factor: float = _PA_TO_GPA) -> str:
    return "--" if value is None else f"{value * factor:.{digits}f}"
