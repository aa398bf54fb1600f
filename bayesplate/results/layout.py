"""Tables on a terminal of any width: as a grid with wrapped columns, or as a list of rows; nothing is cut off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Texts = Sequence[str]

_SENTENCE_LENGTH = 40
"""Characters in a line beyond which a cell counts as text and is aligned left."""
_LONGEST_UNBROKEN = 16
"""A number with its uncertainty, or an interval, of at most so many characters is not wrapped."""

_RULE_WIDTH = 3
"""Characters of the rule between two columns, spaces included."""


def lay_out_table(title: str, columns: Texts, rows: Sequence[Texts], width: int) -> Any:
    """A table for rich to print: as a grid where it fits, otherwise as a list of rows."""
    widths = column_widths(columns, rows, width)
    return _stacked_rows(title, columns, rows) if widths is None else _grid(title, columns, rows, widths)


def column_widths(columns: Texts, rows: Sequence[Texts], width: int) -> list[int] | None:
    """Width of each column in characters, the widest narrowed first; None if some number would have to be broken."""
    cells = list(zip(columns, *rows, strict=True))
    available = width - _RULE_WIDTH * len(columns) - 1
    natural = [max(map(_longest_line, column)) for column in cells]
    least = [max(map(_least_width, column)) for column in cells]
    # names in the first column are broken only if nothing else fits
    for narrowest in ([natural[0], *least[1:]], least):
        if sum(narrowest) <= available:
            return _narrow_columns(natural, narrowest, available)
    return None


def _narrow_columns(natural: Sequence[int], least: Sequence[int], available: int) -> list[int]:
    """Widths that fit: the widest column that may still shrink loses a character at a time."""
    widths = list(natural)
    while sum(widths) > available:
        _, widest = max((width, i) for i, width in enumerate(widths) if width > least[i])
        widths[widest] -= 1
    return widths


def _longest_line(cell: str) -> int:
    return max((len(line) for line in cell.split("\n")), default=0)


def _least_width(cell: str) -> int:
    """The least width of a cell: that of its longest word, or of a short number as a whole."""
    pieces = []
    for line in cell.split("\n"):
        pieces += [line] if len(line) <= _LONGEST_UNBROKEN and any(map(str.isdigit, line)) else line.split()
    return max(map(len, pieces), default=0)


def _grid(title: str, columns: Texts, rows: Sequence[Texts], widths: Sequence[int]) -> Any:
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid(title=Text(title), title_justify="left", title_style="bold")
    cells = zip(*rows, strict=True) if rows else [()] * len(columns)
    for i, (column, width, column_cells) in enumerate(zip(columns, widths, cells, strict=True)):
        is_text = i == 0 or any(_longest_line(cell) > _SENTENCE_LENGTH for cell in column_cells)
        grid.add_column(Text(column), justify="left" if is_text else "right", width=width, overflow="fold")
    for row in rows:
        grid.add_row(*map(Text, row))
    return grid


def _stacked_rows(title: str, columns: Texts, rows: Sequence[Texts]) -> Any:
    """Each row as a list under its first cell: column name and cell."""
    from rich.console import Group
    from rich.padding import Padding
    from rich.text import Text

    names = [" ".join(column.split()) for column in columns]
    blocks: list[Any] = [Text(title, style="bold")]
    for first, *cells in rows:
        blocks.append(Text(f"{names[0]} {first}".strip()))
        for name, cell in zip(names[1:], cells, strict=True):
            text = ", ".join(cell.rstrip().split("\n"))
            blocks.append(Padding(Text(f"{name}: {text}"), (0, 0, 0, 2), expand=False))
    return Group(*blocks)
