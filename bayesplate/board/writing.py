"""Cards as TOML text, and their files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bayesplate.errors import Fault, InputError, printable
from bayesplate.files import whole_file

_MOST_IN_A_LINE = 4
_MOST_BITS = 10_000


def toml_text(content: Mapping[str, Any]) -> str:
    """A table as TOML text, from which the TOML reader returns the same table.

    A table within a section stands on one line if it is short, { mean = 3.0, sd = 0.05 }, otherwise below a header.
    """
    return "\n".join(_toml_lines(content, ())).lstrip("\n") + "\n"


def _toml_lines(content: Mapping[str, Any], parent_keys: tuple[str, ...]) -> Iterator[str]:
    tables = {key: value for key, value in content.items() if _has_header(value, len(parent_keys))}
    for key, value in content.items():
        if key not in tables:
            yield f"{_toml_key(key)} = {toml_value(value)}"
    for key, value in tables.items():
        keys = (*parent_keys, _toml_key(key))
        name = ".".join(keys)
        is_list = isinstance(value, list | tuple)
        for table in value if is_list else [value]:
            yield from ("", f"[[{name}]]" if is_list else f"[{name}]", *_toml_lines(table, keys))


def _has_header(value: Any, depth: int) -> bool:
    if isinstance(value, list | tuple):
        return depth < 2 and bool(value) and all(isinstance(entry, Mapping) for entry in value)
    return isinstance(value, Mapping) and depth < 2 and (depth == 0 or len(value) > _MOST_IN_A_LINE)


def toml_value(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        entries = ", ".join(f"{_toml_key(key)} = {toml_value(entry)}" for key, entry in value.items())
        return f"{{ {entries} }}" if entries else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes it the same way, but for one character that TOML does not let through
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):  # Python writes no integer of thousands of digits in decimal; TOML may have one
        return str(value) if value.bit_length() < _MOST_BITS else hex(value)
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)


def _toml_key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else toml_value(key)


def write_card(path: Any, name: str, content: str, *, force: bool) -> None:
    """Write a card to NAME.toml, completely or not at all; raises InputError where it may not or cannot be."""
    if not isinstance(path, str | os.PathLike):
        raise InputError(Fault("path", f"{name}.toml, or a path to it", repr(path)))
    path = Path(path)
    shown_path = printable(str(path))
    if path.name != f"{name}.toml":
        raise InputError(Fault(shown_path, f"{name}.toml, the name of the card", printable(path.name)))
    if os.path.exists(path) and not force:
        raise InputError(Fault(shown_path, "a new file", "one that exists", "force=True replaces it"))
    try:
        with whole_file(path) as stream:
            stream.write(content.encode("utf-8"))
    except OSError as error:
        raise InputError(Fault(shown_path, "a place for the card", error.strerror or str(error))) from None
