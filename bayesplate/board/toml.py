"""A file becomes a table: regular, small, UTF-8, TOML, not deeply nested; otherwise a fault that says where."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, NoReturn

from bayesplate.board.syntax import syntax_remedy
from bayesplate.board.words import quoted
from bayesplate.errors import Fault, InputError, plain

LARGEST_FILE = 1_000_000
DEEPEST_NESTING = 20
_POSITION = re.compile(r"^(.*) \(at (?:line (\d+), column \d+|end of document)\)$", re.DOTALL)
_KEY_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART}){{{DEEPEST_NESTING},}}")


def read_file(path: str | Path) -> bytes:
    """The bytes of a card file.

    Parameters
    ----------
    path : str or Path

    Raises
    ------
    InputError
        If it is missing, not a regular file, unreadable or too large. A FIFO or a device is refused without waiting.
    """
    asked = plain(str(path))
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            _refuse(asked, "a regular file", _kind(path))
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(descriptor, "rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except InputError:  # a ValueError too
        raise
    except FileNotFoundError:
        _refuse(asked, "a card", "no such file", f"looked in {plain(str(Path(path).absolute().parent))}")
    except PermissionError:
        _refuse(asked, "a readable file", "permission denied")
    except (OSError, ValueError) as error:
        _refuse(asked, "a readable file", plain(getattr(error, "strerror", None) or str(error)))
    if len(data) > LARGEST_FILE:
        _refuse(asked, f"a file of at most {LARGEST_FILE:,} bytes", "a larger one")
    return data


def read_table(data: bytes, file: str) -> dict[str, Any]:
    """The table that a TOML file holds.

    Parameters
    ----------
    data : bytes
    file : str
        The file's name, as messages show it.

    Raises
    ------
    InputError
        If it is empty, not UTF-8 text, not TOML, or nested deeper than twenty levels.
    """
    text = _text(data, file)
    long_key = _LONG_KEY.search(text)
    if long_key:
        line = text.count("\n", 0, long_key.start()) + 1
        _refuse(f"{file} line {line}", f"a key of at most {DEEPEST_NESTING} parts", "a longer one")
    try:
        table = tomllib.loads(text)
    except RecursionError:
        _refuse_nesting(file)
    except ValueError as error:  # TOMLDecodeError, or an integer too long for int()
        raise InputError(_syntax_fault(str(error), text, file)) from None
    if not table:
        _refuse(file, "a card", "an empty file")
    if _depth_exceeds(table, DEEPEST_NESTING):
        _refuse_nesting(file)
    return table


def _text(data: bytes, file: str) -> str:
    """The text of a file in UTF-8, with or without a byte order mark."""
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or _looks_like_utf16(data):
        _refuse(file, "UTF-8 text", "UTF-16", "save the file as UTF-8")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if b"\0" in data:
        _refuse(file, "a text file", f"binary data, a zero byte at offset {data.index(0)}")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        byte = f"the byte 0x{data[error.start]:02x} at offset {error.start}"
        _refuse(f"{file} line {line}", "UTF-8 text", byte, "save the file as UTF-8")


def _looks_like_utf16(data: bytes) -> bool:
    start = data[:200]
    half = len(start) // 2
    return half > 2 and b"\0\0" not in start and max(start[0::2].count(0), start[1::2].count(0)) >= 0.9 * half


def _syntax_fault(message: str, text: str, file: str) -> Fault:
    """Where the TOML reader stopped, and the line it stopped at."""
    match = _POSITION.match(message)
    lines = text.splitlines() or [""]
    number = int(match[2]) if match and match[2] else len(lines)
    line = lines[min(number, len(lines)) - 1].strip()
    reason = match[1] if match else message
    is_twice = bool(re.match(r"Cannot (overwrite|declare|mutate)", reason))
    wanted = "each key and each table once" if is_twice else "TOML"
    remedy = syntax_remedy(line, file, is_twice=is_twice)
    return Fault(f"{file} line {number}", wanted, f"{quoted(line)}: {plain(reason)}", remedy)


def _depth_exceeds(table: dict[str, Any], limit: int) -> bool:
    """Whether tables and lists are nested deeper than the limit; a loop, because recursion could exhaust the stack."""
    level: list[Any] = [table]
    for _ in range(limit):
        level = [
            inner
            for outer in level
            for inner in (outer.values() if isinstance(outer, dict) else outer)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True


def _kind(path: str | Path) -> str:
    mode = os.stat(path).st_mode
    named = ((stat.S_ISDIR, "a directory"), (stat.S_ISFIFO, "a FIFO"), (stat.S_ISSOCK, "a socket"))
    return next((name for test, name in named if test(mode)), "a device")


def _refuse_nesting(file: str) -> NoReturn:
    _refuse(file, f"tables and lists nested at most {DEEPEST_NESTING} deep", "deeper nesting")


def _refuse(where: str, wanted: str, got: str, remedy: str = "") -> NoReturn:
    raise InputError(Fault(where, wanted, got, remedy)) from None
