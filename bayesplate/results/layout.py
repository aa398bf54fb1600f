"""Tables on a terminal of any width: columns wrapped between words, or rows below each other; nothing is cut off."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Texts = Sequence[str]

_SENTENCE = 40
"""Characters in a line from which on a cell is a text and no number: it begins at the left."""
_UNBROKEN = 16
"""A number with its uncertainty, or an interval, of at most so many characters stays in one line."""

_RULES = 3
"""Characters of a rule between two columns with its spaces."""


def laid_out(title: str, columns: Texts, rows: Sequence[Texts], width: int) -> Any:
    """A table as rich prints it: as a grid where that fits, otherwise each row as a small list of its own."""
    widths = column_widths(columns, rows, width)
    return _stacked(title, columns, rows) if widths is None else _grid(title, columns, rows, widths)


def column_widths(columns: Texts, rows: Sequence[Texts], width: int) -> list[int] | None:
    """Characters of each column, the longest ones narrowed first; None if no division leaves every number whole."""
    cells = list(zip(columns, *rows, strict=True))
    available = width - _RULES * len(columns) - 1
    natural = [max(map(_longest_line, column)) for column in cells]
    least = [max(map(_least, column)) for column in cells]
    # a name is broken only where nothing else helps
    for narrowest in ([natural[0], *least[1:]], least):
        if sum(narrowest) <= available:
            return _narrowed(natural, narrowest, available)
    return None


def _narrowed(natural: Sequence[int], least: Sequence[int], available: int) -> list[int]:
    """Widths that fit: character by character from the widest column that can still give one."""
    widths = list(natural)
    while sum(widths) > available:
        _, widest = max((one, i) for i, one in enumerate(widths) if one > least[i])
        widths[widest] -= 1
    return widths


def _longest_line(cell: str) -> int:
    return max((len(line) for line in cell.split("\n")), default=0)


def _least(cell: str) -> int:
    """The least width at which a cell stays whole: that of its longest word, or its own if it is a short number."""
    parts = []
    for line in cell.split("\n"):
        parts += [line] if len(line) <= _UNBROKEN and any(map(str.isdigit, line)) else line.split()
    return max(map(len, parts), default=0)


def _grid(title: str, columns: Texts, rows: Sequence[Texts], widths: Sequence[int]) -> Any:
    from rich.table import Table as Grid
    from rich.text import Text

    grid = Grid(title=Text(title), title_justify="left", title_style="bold")
    cells = zip(*rows, strict=True) if rows else [()] * len(columns)
    for i, (column, width, own) in enumerate(zip(columns, widths, cells, strict=True)):
        is_text = i == 0 or any(_longest_line(cell) > _SENTENCE for cell in own)
        grid.add_column(Text(column), justify="left" if is_text else "right", width=width, overflow="fold")
    for row in rows:
        grid.add_row(*map(Text, row))
    return grid


def _stacked(title: str, columns: Texts, rows: Sequence[Texts]) -> Any:
    """Each row under its first cell: the name of a column, and the cell."""
    from rich.console import Group
    from rich.padding import Padding
    from rich.text import Text

    names = [" ".join(column.split()) for column in columns]
    parts: list[Any] = [Text(title, style="bold")]
    for first, *cells in rows:
        parts.append(Text(f"{names[0]} {first}".strip()))
        for name, cell in zip(names[1:], cells, strict=True):
            told = ", ".join(cell.rstrip().split("\n"))
            parts.append(Padding(Text(f"{name}: {told}"), (0, 0, 0, 2), expand=False))
    return Group(*parts)
