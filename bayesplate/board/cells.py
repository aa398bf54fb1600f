"""Cells of a table as values of a card."""

from __future__ import annotations

from typing import Any

Cell = str | float | int | None


def is_empty(cell: Cell) -> bool:
    """Whether a cell says nothing."""
    return cell is None or (isinstance(cell, str) and not cell.strip())


def word(cell: Cell) -> str | None:
    """A cell of text as a card has it: 101 is a name, and so is 101.0 where a column of numbers lost one."""
    if is_empty(cell):
        return None
    return str(int(cell) if isinstance(cell, float) and cell.is_integer() else cell).strip()


def value(cell: Cell) -> Any:
    """A cell as a card has it: a number, several with semicolons between them as readings, otherwise a text."""
    if not isinstance(cell, str):
        return cell
    stripped = cell.strip()
    if not stripped:
        return None
    parts = [_number(part) for part in stripped.split(";")]
    if any(part is None for part in parts):
        return stripped
    return parts[0] if len(parts) == 1 else parts


def _number(part: str) -> float | None:
    try:
        return None if "_" in part else float(part)
    except ValueError:
        return None
