"""The grading as tables: makers' figures, the limits that a board meets, its partner; grading.csv, and for people."""

from __future__ import annotations

import math
from pathlib import Path

from bayesplate.board.material import MODULI
from bayesplate.files import write_text
from bayesplate.grading.figures import FIGURES, LogFigure, limit_told
from bayesplate.grading.matching import Grading
from bayesplate.results.tables import Cell, Row, Table, csv_text
from bayesplate.results.words import Value, number, percent

GRADING = "grading.csv"
MOST_LISTED, MOST_ON_TERMINAL = 100, 20
"""Boards that a table for people has; all of them are in grading.csv."""
_MARK = "?"


def best_first(graded: Grading) -> list[int]:
    """Places of the boards by the probability of meeting the limits, otherwise by E_x; those in doubt are last."""
    by = graded.log_mean[:, 0] if graded.meets_all is None else graded.meets_all
    return sorted(range(len(graded.names)), key=lambda i: (bool(graded.doubts[i]), -float(by[i]), graded.names[i]))


def grading_tables(graded: Grading, most: int = MOST_LISTED) -> dict[str, Table]:
    """The tables for people, with at most so many boards or pairs, by what they hold; none that would be empty."""
    if not graded.names:
        return {}
    order = best_first(graded)
    some, which = order[:most], _which(most, len(order))
    moduli = {name: FIGURES[name] for name in MODULI}
    tables = {
        "constants": _figures_table(graded, some, f"Constants, median ± sd{which}", moduli),
        "makers": _figures_table(graded, some, f"What makers compare, median ± sd{which}", graded.request.figures),
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
    sd = graded.log(figure, some)[1]
    return [Value(float(one), float(one * share)) for one, share in zip(middle, sd, strict=True)]


def _limits_table(graded: Grading, some: list[int], which: str) -> Table:
    assert graded.meets_all is not None
    limits = [limit_told(name, limit) for name, limit in graded.request.limits.items()]
    each = list(graded.meets.values())
    if len(limits) > 1:
        limits, each = [*limits, "all of them"], [*each, graded.meets_all]
    rows: list[Row] = [(graded.names[i], *(percent(float(one[i])) for one in each)) for i in some]
    return Table(f"Probability that a board meets the limits{which}", ("board", *limits), tuple(rows))


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
    mean, sd = graded.log(FIGURES[name], [first, second])
    ratio = math.exp(mean[1] - mean[0])
    apart = number(ratio - 1.0, 0, signed=True, factor=100.0)
    return f"{apart} ± {100.0 * ratio * math.hypot(*sd):.0f} %"


def write_grading(folder: Path, graded: Grading) -> None:
    """Write grading.csv, SI units."""
    figures = {**{name: FIGURES[name] for name in MODULI}, **graded.request.figures}
    columns: dict[str, list[Cell]] = {"name": list(graded.names)}
    for name, figure in figures.items():
        for end, values in zip(("q50", "q05", "q95"), graded.spread(figure), strict=True):
            columns[f"{name}_{end}"] = (values * figure.per_unit).tolist()
    for name, probability in graded.meets.items():
        columns[f"probability_{name}"] = probability.tolist()
    if graded.meets_all is not None:
        columns["probability_all_limits"] = graded.meets_all.tolist()
    partners = graded.partners
    matches = [partners.get(i, (None, None)) for i in range(len(graded.names))]
    columns["partner"] = [None if partner is None else graded.names[partner] for partner, _ in matches]
    columns["probability_of_match"] = [probability for _, probability in matches]
    columns["doubt"] = list(graded.doubts)
    write_text(folder / GRADING, csv_text(list(columns), list(zip(*columns.values(), strict=True))))
