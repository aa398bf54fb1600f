"""Errors and constants before and after a diagnosis, and with known effects, as CSV and LaTeX for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from bayesplate.board.material import MODULI
from bayesplate.board.parameter import unit_of_people
from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.known import KnownModel, known_table, known_titles
from bayesplate.diagnosis.wording.words import MERITS
from bayesplate.effects.words import effect_name
from bayesplate.files import write_text
from bayesplate.results.exports import Cell, csv_text, latex, tabular
from bayesplate.results.folder import BEFORE_AFTER, KNOWN_EFFECTS
from bayesplate.results.words import MISSING

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


def write_known(folder: Path, diagnosis: Diagnosis, title: str) -> tuple[Path, ...]:
    """Write the table of known effects into a folder that is there, twice; nothing where there are none to compute."""
    known = diagnosis.known
    if len(known) < 2:
        return ()
    texts = dict(zip(KNOWN_EFFECTS, (known_csv(known), known_tex(known, title)), strict=True))
    for name, text in texts.items():
        write_text(folder / name, text)
    return tuple(folder / name for name in texts)


def known_csv(known: Sequence[KnownModel]) -> str:
    """Errors in cents and changes of the moduli in percent at full precision, model by model."""
    header = ["model", "in_sample_rms_cents", "leave_one_out_rms_cents", *(f"{name}_percent" for name in MODULI)]
    rows: list[list[Cell]] = [list(header)]
    for words, one in zip(known_titles(known), known, strict=True):
        errors = (one.in_sample_rms_cents, one.leave_one_out_rms_cents)
        rows.append([words, *errors, *one.change_percent.values()])
    return csv_text(rows)


def known_tex(known: Sequence[KnownModel], title: str) -> str:
    """The same rounded, as a tabular that needs no package; errors in cents."""
    table = known_table(known)
    assert table is not None
    columns = [f"${name[0]}_{{{name[2:]}}}$, \\%" for name in MODULI]
    cells = [["--" if cell == MISSING else latex(cell) for cell in row] for row in table.rows]
    return tabular(f"% {latex(table.title)}; {latex(title)}", [*table.columns[:3], *columns], cells)


def before_after_csv(diagnosis: Diagnosis) -> str:
    """Errors, moduli in GPa and sizes at full precision; what is after stands there only if something was added."""
    added = diagnosis.is_refitted
    rows: list[list[Cell]] = [["quantity", "before", "after", "shift_in_sd", "averaged", "averaged_sd"]]
    rows += [[one.title, one.of(diagnosis.before), one.of(diagnosis.after), None, None, None] for one in MERITS]
    for name, one in diagnosis.elastic_shift.items():
        averaged = diagnosis.elastic_averaged[name]
        before, after, mean, sd = (value * _GPA for value in (one.before, one.after, averaged.mean, averaged.sd))
        rows.append([f"{name}, GPa", before, after, one.shift_in_sd, mean, sd])
    if added:
        rows += [[name, None, mean, None, None, None] for name, mean in _sizes(diagnosis)]
        return csv_text(rows)
    return csv_text([[row[0], row[1], *row[4:]] for row in rows])


def _sizes(diagnosis: Diagnosis) -> list[tuple[str, float]]:
    """Name with unit, and mean, of each size of what was added."""
    found = []
    for one in diagnosis.finalists:
        for owner, effects in one.sizes.items() if one.effects == diagnosis.refitted else ():
            for effect, parameters in effects.items():
                for parameter, spread in parameters.items():
                    factor, unit = unit_of_people(spread.unit)
                    words = f"{effect_name(effect)} {parameter}, {owner}" + f", {unit}" * bool(unit)
                    found.append((words, spread.mean * factor))
    return found


def before_after_tex(diagnosis: Diagnosis, title: str) -> str:
    """Errors and moduli as a tabular that needs no package, with the same columns but the averaged ones."""
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
    header = ["", "before", "after", "shift in sd"]
    n_columns = len(header) if diagnosis.is_refitted else 2
    source = f"% Before and after, {latex(title)}; verdict: {latex(diagnosis.verdict)}"
    return tabular(source, header[:n_columns], [row[:n_columns] for row in rows])


def _rounded(value: float | None) -> str:
    return "--" if value is None else f"{value:.2f}"
