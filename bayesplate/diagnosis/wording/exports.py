"""Errors and constants before and after a diagnosis, as CSV and LaTeX for other programs."""

from __future__ import annotations

from pathlib import Path

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.words import MERITS
from bayesplate.results.exports import Cell, csv_text, latex, tabular
from bayesplate.results.folder import BEFORE_AFTER, write_text

_GPA = 1e-9


def write_before_after(folder: Path, diagnosis: Diagnosis, title: str) -> tuple[Path, ...]:
    """Write both tables into a folder that is there.

    Parameters
    ----------
    folder : Path
    diagnosis : Diagnosis
    title : str
        Of the board; any text.

    Returns
    -------
    tuple of Path
    """
    texts = dict(zip(BEFORE_AFTER, (before_after_csv(diagnosis), before_after_tex(diagnosis, title)), strict=True))
    for name, text in texts.items():
        write_text(folder / name, text)
    return tuple(folder / name for name in texts)


def before_after_csv(diagnosis: Diagnosis) -> str:
    """Figures of merit before and after, then the moduli in GPa, at full precision."""
    rows: list[list[Cell]] = [["quantity", "before", "after", "shift_in_sd"]]
    rows += [[one.title, one.of(diagnosis.before), one.of(diagnosis.after), None] for one in MERITS]
    rows += [
        [f"{name}, GPa", one.before * _GPA, one.after * _GPA, one.shift_in_sd]
        for name, one in diagnosis.elastic_shift.items()
    ]
    return csv_text(rows)


def before_after_tex(diagnosis: Diagnosis, title: str) -> str:
    """The same as a tabular that needs no package."""
    rows = [
        [latex(one.title), _rounded(one.of(diagnosis.before)), _rounded(one.of(diagnosis.after)), ""] for one in MERITS
    ]
    rows += [
        [
            f"${name[0]}_{{{name[2:]}}}$, GPa",
            f"{one.before * _GPA:.3f}",
            f"{one.after * _GPA:.3f}",
            f"${one.shift_in_sd:+.1f}$",
        ]
        for name, one in diagnosis.elastic_shift.items()
    ]
    source = f"% Before and after, {latex(title)}; verdict: {latex(diagnosis.verdict)}"
    return tabular(source, ["", "before", "after", "shift in sd"], rows)


def _rounded(value: float | None) -> str:
    return "--" if value is None else f"{value:.2f}"
