"""The tables of a grading: constants, makers' figures, limits, pairs, doubts; and grading.csv."""

from __future__ import annotations

import math
from pathlib import Path

from bayesplate.board.material import MODULI
from bayesplate.files import write_text
from bayesplate.grading.figures import FIGURES, LogFigure, limit_text
from bayesplate.grading.matching import Grading
from bayesplate.results.tables import Cell, Row, Table, csv_text
from bayesplate.results.words import Value, number, percent

GRADING_FILE = "grading.csv"
MOST_LISTED, MOST_ON_TERMINAL = 100, 20
"""Boards listed in a table for people; grading.csv has all of them."""
_DOUBT_MARK = "?"


def rank_boards(graded: Grading) -> list[int]:
    """Indices of the boards by the probability of meeting the limits, without limits by E_x; boards in doubt last."""
    score = graded.log_mean[:, 0] if graded.all_limits_probability is None else graded.all_limits_probability
    return sorted(range(len(graded.names)), key=lambda i: (bool(graded.doubts[i]), -float(score[i]), graded.names[i]))


def grading_tables(graded: Grading, most: int = MOST_LISTED) -> dict[str, Table]:
    """The tables for people by name, each with at most `most` boards or pairs; empty tables are left out."""
    if not graded.names:
        return {}
    order = rank_boards(graded)
    listed, excerpt = order[:most], _excerpt_note(most, len(order))
    moduli = {name: FIGURES[name] for name in MODULI}
    tables = {
        "constants": _figures_table(graded, listed, f"Constants, median ± sd{excerpt}", moduli),
        "makers": _figures_table(graded, listed, f"What makers compare, median ± sd{excerpt}", graded.request.figures),
    }
    trusted = [i for i in order if not graded.doubts[i]]
    if graded.all_limits_probability is not None and trusted:
        tables["limits"] = _limits_table(graded, trusted[:most], _excerpt_note(most, len(trusted)))
    if graded.pairs:
        tables["pairs"] = _pairs_table(graded, most)
    doubtful = order[len(trusted) :]
    if doubtful:
        rows = tuple((graded.names[i], graded.doubts[i]) for i in doubtful[:most])
        tables["doubts"] = Table(f"Boards in doubt{_excerpt_note(most, len(doubtful))}", ("board", "doubt"), rows)
    return tables


def doubts_sentence(graded: Grading) -> str:
    """How many boards are in doubt, and that they are neither paired nor counted; empty where none is."""
    n = len(graded.names) - len(graded.trusted)
    if not n:
        return ""
    subject = "1 board is" if n == 1 else f"{n} boards are"
    return f"{subject} in doubt, as told beside each: neither paired nor counted among those that meet limits"


def _excerpt_note(most: int, n: int) -> str:
    return "" if n <= most else f"; the first {most} of {n}"


def _figures_table(graded: Grading, boards: list[int], title: str, figures: dict[str, LogFigure]) -> Table:
    columns = [_figure_column(graded, boards, figure) for figure in figures.values()]
    rows = tuple((marked_name(graded, i), *cells) for i, *cells in zip(boards, *columns, strict=True))
    headings = (_column_heading(name, figure) for name, figure in figures.items())
    note = f"; {_DOUBT_MARK} in doubt" if any(graded.doubts[i] for i in boards) else ""
    return Table(f"{title}{note}", ("board", *headings), rows)


def marked_name(graded: Grading, place: int) -> str:
    """The name of a board, with a question mark if it is in doubt."""
    return graded.names[place] + (f" {_DOUBT_MARK}" if graded.doubts[place] else "")


def _column_heading(name: str, figure: LogFigure) -> str:
    symbol = f"{name}, " if name in MODULI else ""
    return f"{symbol}{figure.words}" + ("" if figure.unit == "1" else f", {figure.unit}")


def _figure_column(graded: Grading, boards: list[int], figure: LogFigure) -> list[Value]:
    medians = graded.spread(figure, boards)[0]
    relative_sds = graded.log(figure, boards)[1]
    return [
        Value(float(median), float(median * relative_sd))
        for median, relative_sd in zip(medians, relative_sds, strict=True)
    ]


def _limits_table(graded: Grading, boards: list[int], excerpt: str) -> Table:
    assert graded.all_limits_probability is not None
    limits = [limit_text(name, limit) for name, limit in graded.request.limits.items()]
    probabilities = list(graded.limit_probabilities.values())
    if len(limits) > 1:
        limits, probabilities = [*limits, "all of them"], [*probabilities, graded.all_limits_probability]
    rows: list[Row] = [(graded.names[i], *(percent(float(p[i])) for p in probabilities)) for i in boards]
    return Table(f"Probability that a board meets the limits{excerpt}", ("board", *limits), tuple(rows))


def _pairs_table(graded: Grading, most: int) -> Table:
    pairs = graded.pairs[:most]
    rows: list[Row] = []
    for pair in pairs:
        differences = [_constant_difference(graded, pair.first, pair.second, name) for name in MODULI]
        rows.append((graded.names[pair.first], graded.names[pair.second], percent(pair.probability), *differences))
    title = f"Pairs that may match{_excerpt_note(most, len(graded.pairs))}"
    return Table(title, ("board", "partner", "probability", *MODULI), tuple(rows))


def _constant_difference(graded: Grading, first: int, second: int, name: str) -> str:
    """Difference of a constant of the second board from that of the first, per cent, with its standard deviation."""
    mean, sd = graded.log(FIGURES[name], [first, second])
    ratio = math.exp(mean[1] - mean[0])
    difference = number(ratio - 1.0, 0, signed=True, factor=100.0)
    return f"{difference} ± {100.0 * ratio * math.hypot(*sd):.0f} %"


def write_grading(folder: Path, graded: Grading) -> None:
    """Write grading.csv, SI units."""
    figures = {**{name: FIGURES[name] for name in MODULI}, **graded.request.figures}
    columns: dict[str, list[Cell]] = {"name": list(graded.names)}
    for name, figure in figures.items():
        for quantile, values in zip(("q50", "q05", "q95"), graded.spread(figure), strict=True):
            columns[f"{name}_{quantile}"] = (values * figure.per_unit).tolist()
    for name, probability in graded.limit_probabilities.items():
        columns[f"probability_{name}"] = probability.tolist()
    if graded.all_limits_probability is not None:
        columns["probability_all_limits"] = graded.all_limits_probability.tolist()
    partners = graded.partners
    matches = [partners.get(i, (None, None)) for i in range(len(graded.names))]
    columns["partner"] = [None if partner is None else graded.names[partner] for partner, _ in matches]
    columns["probability_of_match"] = [probability for _, probability in matches]
    columns["doubt"] = list(graded.doubts)
    write_text(folder / GRADING_FILE, csv_text(list(columns), list(zip(*columns.values(), strict=True))))
