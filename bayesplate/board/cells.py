"""Cells of a table as values of a card, and a card of such values as text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from bayesplate.board.writing import array, number, table, text, whole

Cell = str | float | int | None
_BARE = re.compile(r"[A-Za-z0-9_-]+")


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


def card_text(content: Mapping[str, Any]) -> str:
    """A card as TOML, one line for each of its keys."""
    return "".join(f"{_key(key)} = {_toml(value)}\n" for key, value in content.items())


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else text(key)


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, Mapping):
        return table({_key(key): _toml(one) for key, one in value.items()})
    if isinstance(value, list | tuple):
        return array([_toml(one) for one in value])
    return text(value if isinstance(value, str) else str(value))
