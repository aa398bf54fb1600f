"""A table of values, and each medium that shows it: terminal, page and notebook, CSV, LaTeX."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from bayesplate.results.layout import laid_out
from bayesplate.results.words import CONSTANTS, GPA, MISSING, Interval, Value, interval, narrow_name, plus_minus

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
    keys: tuple[str, ...] = ()  # what programs call the columns, where that differs

    @property
    def texts(self) -> tuple[tuple[str, ...], ...]:
        """The rows as people read them."""
        return tuple(tuple(map(_text, row)) for row in self.rows)


def by_constant(
    title: str,
    columns: Mapping[str, Callable[[str], Cell]],
    *,
    isotropic: bool = False,
    names: Iterable[str] = CONSTANTS,
) -> Table:
    """A row for each modulus among the names; a column is its heading and what it holds of a modulus."""
    rows = ((narrow_name(name, isotropic=isotropic), *(held(name) for held in columns.values())) for name in names)
    return Table(title, ("constant", *columns), tuple(rows))


def constants_table(
    title: str,
    moduli: Mapping[str, Interval],
    more: Mapping[str, Callable[[str], Cell]] | None = None,
    *,
    isotropic: bool = False,
) -> Table:
    """Moduli in GPa: mean ± sd, 90 % interval, and further columns as of `by_constant`."""
    shown: dict[str, Callable[[str], Cell]] = {
        "mean ± sd": lambda name: plus_minus(moduli[name], GPA),
        "90 % interval": lambda name: interval(moduli[name], GPA),
    }
    return by_constant(title, shown | dict(more or {}), isotropic=isotropic)


def render(shown: Table | str, medium: Medium, *, width: int = 80, styled: bool = False, kind: str = "") -> str:
    """A table, or a sentence, as a medium shows it; every text in it is escaped.

    Programs read CSV at full precision: a number with its uncertainty has two columns, and so has an interval. `kind`
    are classes of a table of HTML, `styled` terminals know bold letters.
    """
    if medium == "terminal":
        return _printed(shown, width, styled=styled)
    if isinstance(shown, str):
        return f"<p>{escape(shown, medium)}</p>" if medium == "html" else escape(shown, medium)
    if medium == "html":
        return str(_html(shown, kind))
    return csv_text(*_columns_of_numbers(shown)) if medium == "csv" else _latex(shown)


def notebook(heading: str, sentences: Iterable[str], tables: Iterable[Table]) -> str:
    """A result as a notebook shows it: a heading, sentences and tables in HTML."""
    told, shown = ([render(one, "html") for one in some] for some in (sentences, tables))
    return "\n".join([f"<h3>{escape(heading, 'html')}</h3>", *told, *shown])


_SYMBOL = r"\b(?P<letter>E|G|D|L|nu)_(?P<index>xy|xz|yz|x|y|s)\b"
SYMBOL = re.compile(_SYMBOL)
"""A symbol of ours: every medium that can sets its index lower."""
GREEK = {"nu": ("ν", r"\nu")}
_POWER = re.compile(r"(?<=[a-z])\^(-?\d)")
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_TOGETHER = re.compile(r"(?<=[\d±]) (?=[±%])|(?<=±) (?=\d)")
_STARTS_A_FORMULA = ("=", "+", "-", "@")
_IN_LATEX = {
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
_OF_LATEX = re.compile(
    "|".join([_SYMBOL, r"(?P<signed>(?<![\w.])[+-]\d[\d.]*)", r"(?<=\d) %", *map(re.escape, _IN_LATEX)])
)
JOINERS = "\u200c\u200d"
"""Format characters that shape letters and join emoji; they steer nothing."""


def visible(text: str) -> str:
    """A text without what steers the way it runs: control characters and direction marks are removed."""
    if text.isprintable():
        return text
    kept = (character if character not in "\t\n\r" else " " for character in text)
    return "".join(c for c in kept if unicodedata.category(c) not in {"Cc", "Cf", "Cs", "Co", "Cn"} or c in JOINERS)


def escape(text: str, medium: Medium) -> str:
    """A text, whatever stands in it, as a medium shows it: what steers is removed, and nothing is taken for a command.

    A terminal keeps the ends of lines. A page sets our symbols with lowered indices and units with raised powers, LaTeX
    the symbols and signed numbers as mathematics. A spreadsheet does not take it for a formula.
    """
    if medium == "terminal":
        return "\n".join(map(visible, text.split("\n")))
    text = visible(text)
    if medium == "html":
        return _escaped_html(text)
    text = " ".join(text.split())
    if medium == "csv":
        return f"'{text}" if text.startswith(_STARTS_A_FORMULA) else text
    return _OF_LATEX.sub(_latex_of, text)


def _escaped_html(text: str) -> Markup:
    from markupsafe import Markup
    from markupsafe import escape as escaped

    together = _TOGETHER.sub("\N{NO-BREAK SPACE}", str(escaped(text)))
    lowered = SYMBOL.sub(
        lambda found: f"<i>{GREEK.get(found['letter'], found['letter'])[0]}</i><sub>{found['index']}</sub>", together
    )
    raised = _POWER.sub(lambda found: found[1].translate(_RAISED), lowered)
    return Markup(raised)  # what was escaped, and tags of our own


def _latex_of(found: re.Match[str]) -> str:
    if found["letter"]:
        return f"${GREEK.get(found['letter'], ('', found['letter']))[1]}_{{{found['index']}}}$"
    return f"${found[0]}$" if found["signed"] else _IN_LATEX.get(found[0], r"\,\%")


def _text(cell: Cell) -> str:
    if cell is None:
        return MISSING
    return f"{cell:.6g}" if isinstance(cell, float) else str(cell)


def _printed(shown: Table | str, width: int, *, styled: bool) -> str:
    from io import StringIO

    from rich.console import Console
    from rich.text import Text

    stream = StringIO()
    console = Console(file=stream, width=width, force_terminal=styled, soft_wrap=False, highlight=False)
    if isinstance(shown, str):
        console.print(Text(escape(shown, "terminal")))
    else:
        title, *texts = (escape(text, "terminal") for text in (shown.title, *shown.columns, *sum(shown.texts, ())))
        n = len(shown.columns)
        columns, *rows = (texts[i : i + n] for i in range(0, len(texts), n))
        console.print(laid_out(title, columns, rows, width))
    return stream.getvalue()


def _html(table: Table, kind: str) -> Markup:
    from markupsafe import Markup

    def html(text: str) -> Markup:
        return Markup(escape(text, "html"))

    heads = [html(column) for column in table.columns]
    rows = []
    for first, *others in table.texts:
        cells = zip(heads[1:], others, strict=True)
        named = (Markup('<td data-name="{}"><bdi>{}</bdi></td>').format(h.striptags(), html(text)) for h, text in cells)
        row = Markup('<tr><th scope="row"><bdi>{}</bdi></th>{}</tr>')
        rows.append(row.format(html(first), Markup("").join(named)))
    return Markup(
        '\n<div class="table"><table{}>\n<caption>{}</caption>\n<thead><tr>{}</tr></thead>\n'
        "<tbody>\n{}\n</tbody></table></div>"
    ).format(
        Markup(' class="{}"').format(kind) if kind else "",
        html(table.title),
        Markup("").join(Markup('<th scope="col">{}</th>').format(head) for head in heads),
        Markup("\n").join(rows),
    )


def _columns_of_numbers(table: Table) -> tuple[list[str], list[list[Cell]]]:
    """Names and cells of plain numbers and texts: what has an uncertainty or is an interval takes two columns."""
    names: list[str] = []
    columns: list[Sequence[Cell]] = []
    for name, cells in zip(table.keys or table.columns, zip(*table.rows, strict=True), strict=True):
        values = [one if isinstance(one, Value) else None for one in cells]
        if any(one is not None and one.ends for one in values):
            names += [f"{name}_q05", f"{name}_q95"]
            columns += zip(*(one.ends if one and one.ends else (None, None) for one in values), strict=True)
            continue
        names.append(name)
        columns.append([one.mean if isinstance(one, Value) else one for one in cells])
        if any(one is not None and one.sd is not None for one in values):
            names.append(f"{name}_sd")
            columns.append([one and one.sd for one in values])
    return names, [list(row) for row in zip(*columns, strict=True)]


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """CSV with full precision of plain numbers and texts; without a header its line is left out."""
    from pandas import DataFrame

    def safe(cells: Sequence[Any]) -> list[Any]:
        return [escape(cell, "csv") if isinstance(cell, str) else cell for cell in cells]

    frame = DataFrame(list(map(safe, rows)), columns=safe(header) or None, dtype=object)
    return frame.to_csv(index=False, header=bool(header), lineterminator="\n")


def _latex(table: Table) -> str:
    """A tabular under its title as a comment; it needs no package."""
    from pandas import DataFrame

    cells = [[escape(text, "latex") for text in row] for row in table.texts]
    frame = DataFrame(cells, columns=[escape(column, "latex") for column in table.columns])
    rules = [{"selector": rule, "props": ":hline;"} for rule in ("toprule", "midrule", "bottomrule")]
    styled = frame.style.hide(axis="index").set_table_styles(rules)
    body = styled.to_latex(column_format="l" + "r" * (len(table.columns) - 1))
    return f"% {escape(table.title, 'latex')}\n{body}"
