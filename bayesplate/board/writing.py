"""Cards as TOML text, and their files."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bayesplate.errors import Fault, InputError, plain
from bayesplate.files import whole_file

_MOST_IN_A_LINE = 4
_MOST_BITS = 10_000


def toml_text(content: Mapping[str, Any]) -> str:
    """A whole table as TOML, as the reader of TOML would return it again.

    A table within a section stands on one line if it is short, { mean = 3.0, sd = 0.05 }, otherwise below a header.
    """
    return "\n".join(_lines(content, ())).lstrip("\n") + "\n"


def _lines(content: Mapping[str, Any], above: tuple[str, ...]) -> Iterator[str]:
    headed = {key: value for key, value in content.items() if _has_header(value, len(above))}
    for key, value in content.items():
        if key not in headed:
            yield f"{_key(key)} = {toml_value(value)}"
    for key, value in headed.items():
        inside = (*above, _key(key))
        name = ".".join(inside)
        is_list = isinstance(value, list | tuple)
        for one in value if is_list else [value]:
            yield from ("", f"[[{name}]]" if is_list else f"[{name}]", *_lines(one, inside))


def _has_header(value: Any, depth: int) -> bool:
    if isinstance(value, list | tuple):
        return depth < 2 and bool(value) and all(isinstance(one, Mapping) for one in value)
    return isinstance(value, Mapping) and depth < 2 and (depth == 0 or len(value) > _MOST_IN_A_LINE)


def toml_value(value: Any) -> str:
    """A value on one line."""
    if isinstance(value, Mapping):
        entries = ", ".join(f"{_key(key)} = {toml_value(one)}" for key, one in value.items())
        return f"{{ {entries} }}" if entries else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        # JSON escapes it the same way, but for one character that TOML does not let through
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):  # one of thousands of digits, which Python does not write in tens, TOML may have too
        return str(value) if value.bit_length() < _MOST_BITS else hex(value)
    return value.isoformat() if hasattr(value, "isoformat") else repr(value)


def _key(key: str) -> str:
    return key if key.isascii() and key.replace("_", "").replace("-", "").isalnum() else toml_value(key)


def write_card(path: Any, name: str, content: str, *, force: bool) -> None:
    """Write a card to NAME.toml, completely or not at all; raises InputError where it may not or cannot be."""
    path = Path(path)
    shown = plain(str(path))
    if path.name != f"{name}.toml":
        raise InputError(Fault(shown, f"{name}.toml, the name of the card", plain(path.name)))
    if os.path.exists(path) and not force:
        raise InputError(Fault(shown, "a new file", "one that exists", "force=True replaces it"))
    try:
        with whole_file(path) as stream:
            stream.write(content.encode("utf-8"))
    except OSError as error:
        raise InputError(Fault(shown, "a place for the card", error.strerror or str(error))) from None
