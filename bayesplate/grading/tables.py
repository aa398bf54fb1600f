"""The grading as tables: makers' figures, the limits that a board meets, its partner; grading.csv, and for people."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

from bayesplate.board.material import MODULI
from bayesplate.files import whole_file, writing
from bayesplate.grading.figures import FIGURES, LogFigure, limit_told
from bayesplate.grading.matching import Grading
from bayesplate.grading.storage import write_rows
from bayesplate.results.tables import Cell, Row, Table
from bayesplate.results.words import Value, percent

GRADING = "grading.csv"
MOST_LISTED, MOST_ON_TERMINAL = 100, 20
"""Boards that a table for people has; all of them are in grading.csv."""
_MARK = "?"
_AT_ONCE = 256
"""Boards whose figures are computed together."""


def best_first(graded: Grading) -> list[int]:
    """Places of the boards: by the probability of meeting the limits, otherwise by E_x, the greatest first.

    Those in doubt are the last.
    """
    by = graded.log_mean[:, 0] if graded.meets_all is None else graded.meets_all
    return sorted(range(len(graded.names)), key=lambda i: (bool(graded.doubts[i]), -float(by[i]), graded.names[i]))


def grading_tables(graded: Grading, most: int = MOST_LISTED) -> dict[str, Table]:
    """The tables for people, by what they hold, from "constants" to "doubts"; none that would be empty.

    Parameters
    ----------
    most : int
        Boards, or pairs, in each.
    """
    if not graded.names:
        return {}
    order = best_first(graded)
    some, which = order[:most], _which(most, len(order))
    moduli = {name: FIGURES[name] for name in MODULI}
    tables = {
        "constants": _figures_table(graded, some, f"Constants, median ± sd{which}", moduli),
        "makers": _figures_table(graded, some, f"Figures of makers, median ± sd{which}", graded.request.figures),
    }
    trusted = [i for i in order if not graded.doubts[i]]
    if graded.meets_all is not None and trusted:
        tables["limits"] = _limits_table(graded, trusted[:most], _which(most, len(trusted)))
    if graded.pairs:
        tables["pairs"] = _pairs_table(graded, most)
    doubted = order[len(trusted) :]
    if doubted:
        rows = tuple((graded.names[i], graded.doubts[i]) for i in doubted[:most])
        tables["doubts"] = Table(f"Boards in doubt{_which(most, len(doubted))}", ("board", "doubt"), rows)
    return tables


def doubts_sentence(graded: Grading) -> str:
    """How many boards are in doubt, and what is made of them; empty where none is."""
    n = len(graded.names) - len(graded.trusted)
    if not n:
        return ""
    found = "1 board is" if n == 1 else f"{n} boards are"
    return (
        f"{found} in doubt, for the fit itself says that the constants are not to be trusted: neither paired nor "
        "counted among those that meet limits"
    )


def _which(most: int, n: int) -> str:
    return "" if n <= most else f"; the first {most} of {n}"


def _figures_table(graded: Grading, some: list[int], title: str, figures: dict[str, LogFigure]) -> Table:
    columns = [_column(graded, some, figure) for figure in figures.values()]
    rows = tuple((marked(graded, i), *cells) for i, *cells in zip(some, *columns, strict=True))
    heads = (_head(name, figure) for name, figure in figures.items())
    told = f"; {_MARK} in doubt" if any(graded.doubts[i] for i in some) else ""
    return Table(f"{title}{told}", ("board", *heads), rows)


def marked(graded: Grading, place: int) -> str:
    """The name of a board, with a question mark if it is in doubt."""
    return graded.names[place] + (f" {_MARK}" if graded.doubts[place] else "")


def _head(name: str, figure: LogFigure) -> str:
    told = f"{name}, " if name in MODULI else ""
    return f"{told}{figure.words}" + ("" if figure.unit == "1" else f", {figure.unit}")


def _column(graded: Grading, some: list[int], figure: LogFigure) -> list[Value]:
    middle = graded.spread(figure, some)[0]
    sd = figure.log(graded.log_mean[some], graded.triangles[some])[1]
    return [Value(float(one), float(one * share)) for one, share in zip(middle, sd, strict=True)]


def _limits_table(graded: Grading, some: list[int], which: str) -> Table:
    assert graded.meets_all is not None
    limits = [limit_told(name, limit) for name, limit in graded.request.limits.items()]
    each = list(graded.meets.values())
    rows: list[Row] = [
        (graded.names[i], *(percent(float(one[i])) for one in each), percent(float(graded.meets_all[i]))) for i in some
    ]
    return Table(f"Probability that a board meets the limits{which}", ("board", *limits, "all of them"), tuple(rows))


def _pairs_table(graded: Grading, most: int) -> Table:
    some = graded.pairs[:most]
    rows: list[Row] = []
    for pair in some:
        apart = [_apart(graded, pair.first, pair.second, name) for name in MODULI]
        rows.append((graded.names[pair.first], graded.names[pair.second], percent(pair.probability), *apart))
    title = f"Pairs that may match{_which(most, len(graded.pairs))}"
    return Table(title, ("board", "partner", "probability", *MODULI), tuple(rows))


def _apart(graded: Grading, first: int, second: int, name: str) -> str:
    """By how much a constant of the second board differs from the first one's, with the standard deviation."""
    both = [first, second]
    mean, sd = FIGURES[name].log(graded.log_mean[both], graded.triangles[both])
    ratio = math.exp(mean[1] - mean[0])
    return f"{100.0 * (ratio - 1.0):+.0f} ± {100.0 * ratio * math.hypot(*sd):.0f} %"


def write_grading(folder: Path, graded: Grading) -> Path:
    """Write the table of the grading, SI units, completely or not at all."""
    path = folder / GRADING
    with writing(path), whole_file(path) as stream:
        write_rows(stream, _header(graded), _rows(graded))
    return path


def _header(graded: Grading) -> list[Cell]:
    figures = (*MODULI, *graded.request.figures)
    limits = (f"probability_{name}" for name in graded.meets)
    whole = [] if graded.meets_all is None else ["probability_all_limits"]
    ends = (f"{name}_{end}" for name in figures for end in ("q50", "q05", "q95"))
    return ["name", *ends, *limits, *whole, "partner", "probability_of_match", "doubt"]


def _rows(graded: Grading) -> Iterator[list[Cell]]:
    figures = [*(FIGURES[name] for name in MODULI), *graded.request.figures.values()]
    partner, probability = graded.partners
    for start in range(0, len(graded.names), _AT_ONCE):
        places = range(start, min(start + _AT_ONCE, len(graded.names)))
        spreads = [end * one.per_unit for one in figures for end in graded.spread(one, places)]
        for i in places:
            numbers = [float(end[i - start]) for end in spreads]
            limits = [float(one[i]) for one in graded.meets.values()]
            whole = [] if graded.meets_all is None else [float(graded.meets_all[i])]
            match = [None, None] if partner[i] < 0 else [graded.names[partner[i]], float(probability[i])]
            yield [graded.names[i], *numbers, *limits, *whole, *match, graded.doubts[i]]
