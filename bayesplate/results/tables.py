"""A table of values, rendered for terminal, page and notebook, CSV and LaTeX."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from bayesplate.results.layout import lay_out_table
from bayesplate.results.words import GPA, MISSING, MODULUS_WORDS, Interval, Value, interval, narrow_name, plus_minus

if TYPE_CHECKING:
    from markupsafe import Markup

Cell = str | float | int | Value | None
Row = tuple[Cell, ...]
Medium = Literal["terminal", "html", "csv", "latex"]


@dataclass(frozen=True)
class Table:
    """A table of values."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    keys: tuple[str, ...] = ()  # names of the columns for programs, where they differ

    @property
    def texts(self) -> tuple[tuple[str, ...], ...]:
        """The rows as texts for people."""
        return tuple(tuple(map(_cell_text, row)) for row in self.rows)


def table_by_constant(
    title: str,
    columns: Mapping[str, Callable[[str], Cell]],
    *,
    isotropic: bool = False,
    names: Iterable[str] = MODULUS_WORDS,
) -> Table:
    """A table with a row for each modulus; a column is its heading and a function from the modulus to its cell."""
    rows = (
        (narrow_name(name, isotropic=isotropic), *(make_cell(name) for make_cell in columns.values())) for name in names
    )
    return Table(title, ("constant", *columns), tuple(rows))


def constants_table(
    title: str,
    moduli: Mapping[str, Interval],
    more: Mapping[str, Callable[[str], Cell]] | None = None,
    *,
    isotropic: bool = False,
) -> Table:
    """Moduli in GPa: mean ± sd, 90 % interval, and further columns as of `table_by_constant`."""
    columns: dict[str, Callable[[str], Cell]] = {
        "mean ± sd": lambda name: plus_minus(moduli[name], GPA),
        "90 % interval": lambda name: interval(moduli[name], GPA),
    }
    return table_by_constant(title, columns | dict(more or {}), isotropic=isotropic)


def render(content: Table | str, medium: Medium, *, width: int = 80, styled: bool = False, kind: str = "") -> str:
    """A table, or a sentence, rendered for a medium; every text in it is escaped.

    CSV has full precision: a number with its uncertainty has two columns, and so has an interval. `kind` holds classes
    of an HTML table; `styled` terminals show bold letters.
    """
    if medium == "terminal":
        return _terminal_text(content, width, styled=styled)
    if isinstance(content, str):
        return f"<p>{escape(content, medium)}</p>" if medium == "html" else escape(content, medium)
    if medium == "html":
        return str(_html_table(content, kind))
    return csv_text(*_csv_columns(content)) if medium == "csv" else _latex_table(content)


def notebook_html(heading: str, sentences: Iterable[str], tables: Iterable[Table]) -> str:
    """A result as HTML for notebooks: a heading, sentences and tables."""
    paragraphs, table_texts = ([render(item, "html") for item in items] for items in (sentences, tables))
    return "\n".join([f"<h3>{escape(heading, 'html')}</h3>", *paragraphs, *table_texts])


_SYMBOL = r"\b(?P<letter>E|G|D|L|nu)_(?P<index>xy|xz|yz|x|y|s)\b"
SYMBOL = re.compile(_SYMBOL)
"""A symbol of the package, whose index is set lower where a medium can."""
GREEK = {"nu": ("ν", r"\nu")}
_POWER = re.compile(r"(?<=[a-z])\^(-?\d)")
_SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_UNBREAKABLE_SPACE = re.compile(r"(?<=[\d±]) (?=[±%])|(?<=±) (?=\d)")
_FORMULA_STARTS = ("=", "+", "-", "@")
_LATEX_ESCAPES = {
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
    "±": r"$\pm$",
    "–": "--",
    "\N{NARROW NO-BREAK SPACE}": r"\,",
}
_LATEX_PATTERN = re.compile(
    "|".join([_SYMBOL, r"(?P<signed>(?<![\w.])[+-]\d[\d.]*)", r"(?<=\d) %", *map(re.escape, _LATEX_ESCAPES)])
)
JOINERS = "\u200c\u200d"
"""Zero-width characters that shape letters and join emoji; they are kept."""


def strip_control_characters(text: str) -> str:
    """A text without control characters and direction marks."""
    if text.isprintable():
        return text
    characters = (character if character not in "\t\n\r" else " " for character in text)
    return "".join(
        c for c in characters if unicodedata.category(c) not in {"Cc", "Cf", "Cs", "Co", "Cn"} or c in JOINERS
    )


def escape(text: str, medium: Medium) -> str:
    """Any text, made safe for a medium: control characters are removed, and nothing is read as markup or a command.

    A terminal keeps the line ends. HTML sets symbols of the package with lowered indices and units with raised powers,
    LaTeX sets symbols and signed numbers as mathematics, and a spreadsheet does not read a CSV cell as a formula.
    """
    if medium == "terminal":
        return "\n".join(map(strip_control_characters, text.split("\n")))
    text = strip_control_characters(text)
    if medium == "html":
        return _escaped_html(text)
    text = " ".join(text.split())
    if medium == "csv":
        return f"'{text}" if text.startswith(_FORMULA_STARTS) else text
    return _LATEX_PATTERN.sub(_latex_escape, text)


def _escaped_html(text: str) -> Markup:
    from markupsafe import Markup
    from markupsafe import escape as escaped

    unbroken = _UNBREAKABLE_SPACE.sub("\N{NO-BREAK SPACE}", str(escaped(text)))
    lowered = SYMBOL.sub(
        lambda match: f"<i>{GREEK.get(match['letter'], match['letter'])[0]}</i><sub>{match['index']}</sub>",
        unbroken,
    )
    raised = _POWER.sub(lambda match: match[1].translate(_SUPERSCRIPTS), lowered)
    return Markup(raised)  # escaped text, and tags added here


def _latex_escape(match: re.Match[str]) -> str:
    if match["letter"]:
        return f"${GREEK.get(match['letter'], ('', match['letter']))[1]}_{{{match['index']}}}$"
    return f"${match[0]}$" if match["signed"] else _LATEX_ESCAPES.get(match[0], r"\,\%")


def _cell_text(cell: Cell) -> str:
    if cell is None:
        return MISSING
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)


def _terminal_text(content: Table | str, width: int, *, styled: bool) -> str:
    from io import StringIO

    from rich.console import Console
    from rich.text import Text

    stream = StringIO()
    console = Console(file=stream, width=width, force_terminal=styled, soft_wrap=False, highlight=False)
    if isinstance(content, str):
        console.print(Text(escape(content, "terminal")))
    else:
        title, *texts = (
            escape(text, "terminal") for text in (content.title, *content.columns, *sum(content.texts, ()))
        )
        n = len(content.columns)
        columns, *rows = (texts[i : i + n] for i in range(0, len(texts), n))
        console.print(lay_out_table(title, columns, rows, width))
    return stream.getvalue()


def _html_table(table: Table, kind: str) -> Markup:
    from markupsafe import Markup

    def html(text: str) -> Markup:
        return Markup(escape(text, "html"))

    heads = [html(column) for column in table.columns]
    rows = []
    for first, *texts in table.texts:
        cells = zip(heads[1:], texts, strict=True)
        data_cells = (
            Markup('<td data-name="{}"><bdi>{}</bdi></td>').format(h.striptags(), html(text)) for h, text in cells
        )
        row = Markup('<tr><th scope="row"><bdi>{}</bdi></th>{}</tr>')
        rows.append(row.format(html(first), Markup("").join(data_cells)))
    return Markup(
        '\n<div class="table"><table{}>\n<caption>{}</caption>\n<thead><tr>{}</tr></thead>\n'
        "<tbody>\n{}\n</tbody></table></div>"
    ).format(
        Markup(' class="{}"').format(kind) if kind else "",
        html(table.title),
        Markup("").join(Markup('<th scope="col">{}</th>').format(head) for head in heads),
        Markup("\n").join(rows),
    )


def _csv_columns(table: Table) -> tuple[list[str], list[list[Cell]]]:
    """Names and cells of plain numbers and texts: a number with uncertainty, or an interval, takes two columns."""
    names: list[str] = []
    columns: list[Sequence[Cell]] = []
    for name, cells in zip(table.keys or table.columns, zip(*table.rows, strict=True), strict=True):
        values = [cell if isinstance(cell, Value) else None for cell in cells]
        if any(value is not None and value.ends for value in values):
            names += [f"{name}_q05", f"{name}_q95"]
            columns += zip(*(value.ends if value and value.ends else (None, None) for value in values), strict=True)
            continue
        names.append(name)
        columns.append([cell.mean if isinstance(cell, Value) else cell for cell in cells])
        if any(value is not None and value.sd is not None for value in values):
            names.append(f"{name}_sd")
            columns.append([value and value.sd for value in values])
    return names, [list(row) for row in zip(*columns, strict=True)]


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """CSV of plain numbers, at full precision, and texts; an empty header is left out."""
    from pandas import DataFrame

    def safe(cells: Sequence[Any]) -> list[Any]:
        return [escape(cell, "csv") if isinstance(cell, str) else cell for cell in cells]

    frame = DataFrame(list(map(safe, rows)), columns=safe(header) or None, dtype=object)
    return frame.to_csv(index=False, header=bool(header), lineterminator="\n")


def _latex_table(table: Table) -> str:
    """A LaTeX tabular, its title as a comment above it; it needs no package."""
    from pandas import DataFrame

    cells = [[escape(text, "latex") for text in row] for row in table.texts]
    frame = DataFrame(cells, columns=[escape(column, "latex") for column in table.columns])
    rules = [{"selector": rule, "props": ":hline;"} for rule in ("toprule", "midrule", "bottomrule")]
    styled = frame.style.hide(axis="index").set_table_styles(rules)
    body = styled.to_latex(column_format="l" + "r" * (len(table.columns) - 1))
    return f"% {escape(table.title, 'latex')}\n{body}"
