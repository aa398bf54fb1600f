"""TOML files read into tables: regular, small, UTF-8, not deeply nested; otherwise a fault names the line."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any, NoReturn

from bayesplate.board.values import comma_ambiguity, number_hint, strange_character_remedy
from bayesplate.board.words import quote_text
from bayesplate.errors import Fault, InputError, printable

LARGEST_FILE = 1_000_000
DEEPEST_NESTING = 20
_POSITION = re.compile(r"^(.*) \(at (?:line (\d+), column \d+|end of document)\)$", re.DOTALL)
_KEY_PART = r"""(?:[A-Za-z0-9_-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![A-Za-z0-9_-]){_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART}){{{DEEPEST_NESTING},}}")

_DECIMAL_COMMA = re.compile(r"=\s*([+-]?[0-9]+,[0-9]+)")
_DECIMAL_COMMA_IN_LIST = re.compile(r"[\[,]\s*[0-9]+,0[0-9]")  # TOML has no numbers like 05
_LABEL = re.compile(r"(\(\s*[0-9]+\s*,\s*[0-9]+\s*\))\s*(?:=\s*(.+))?")
_CURLY_QUOTES = re.compile("[\u201c\u201d\u201e\u2018\u2019\u201a\u00ab\u00bb]")
_NUMBER_WITH_UNIT = re.compile(r"(?:_(mm|g))?\s*=\s*([+-]?[0-9.]+\s*[A-Za-z]+)")
_TEXT_OR_COMMENT = re.compile(r"\"[^\"]*\"|'[^']*'|#.*")


def read_file(path: str | Path) -> bytes:
    """The bytes of a small regular file; InputError for all else, a FIFO or a device without waiting."""
    shown_path = printable(str(path))
    try:
        if not stat.S_ISREG(os.stat(path).st_mode):
            _refuse(shown_path, "a regular file", _file_kind(path))
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
        with open(descriptor, "rb") as file:
            data = file.read(LARGEST_FILE + 1)
    except InputError:  # a ValueError too
        raise
    except FileNotFoundError:
        _refuse(shown_path, "a card", "no such file", f"looked in {printable(str(Path(path).absolute().parent))}")
    except PermissionError:
        _refuse(shown_path, "a readable file", "permission denied")
    except (OSError, ValueError) as error:
        _refuse(shown_path, "a readable file", printable(getattr(error, "strerror", None) or str(error)))
    if len(data) > LARGEST_FILE:
        _refuse(shown_path, f"a file of at most {LARGEST_FILE:,} bytes", "a larger one")
    return data


def parse_toml(data: bytes, file: str) -> dict[str, Any]:
    """The table that a TOML file holds; raises InputError if it is none, or nested deeper than twenty levels."""
    text = _decode_text(data, file)
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


def _decode_text(data: bytes, file: str) -> str:
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
    """The fault of the line at which the TOML reader stopped."""
    match = _POSITION.match(message)
    lines = text.splitlines() or [""]
    number = int(match[2]) if match and match[2] else len(lines)
    line = lines[min(number, len(lines)) - 1].strip()
    reason = match[1] if match else message
    is_twice = bool(re.match(r"Cannot (overwrite|declare|mutate)", reason))
    wanted = "each key and each table once" if is_twice else "TOML"
    remedy = _syntax_remedy(line, file, is_twice=is_twice)
    return Fault(f"{file} line {number}", wanted, f"{quote_text(line)}: {printable(reason)}", remedy)


def _syntax_remedy(line: str, file: str, *, is_twice: bool) -> str:
    """What to write in place of the line at which the reader stopped; empty if its meaning is not clear."""
    if is_twice:
        setup = re.match(r"\[\s*setup\b", line)
        return "several setups are written [[setup]], in double brackets, each with a name" if setup else ""
    if _CURLY_QUOTES.search(line):
        straight = _CURLY_QUOTES.sub('"', line)
        return f"straight quotes: {straight[:80]}"
    if remedy := strange_character_remedy(_TEXT_OR_COMMENT.sub("", line)):
        return remedy
    label = _LABEL.match(line)
    if label:
        return f'a label stands in quotes: "{label[1]}" = {(label[2] or "52")[:40]}'
    comma = _DECIMAL_COMMA.search(line)
    if comma or _DECIMAL_COMMA_IN_LIST.search(line):
        return (comma_ambiguity(comma[1]) if comma else "") or "a number has a decimal point, not a comma"
    if with_unit := _NUMBER_WITH_UNIT.search(line):
        return number_hint(with_unit[2], with_unit[1] or "") or "the unit stands in the key: write the number alone"
    if re.fullmatch(r"[^=\[#{]*[,;\t][^=]*", line) or not file.endswith(".toml"):
        return "a card is a TOML file with lines like length_x_mm = 550; bayesplate new writes a first one"
    if re.fullmatch(r"[^=]*=\s*", line):
        return "a value after the sign, or leave the line out"
    return "a text stands in quotes" if re.search(r"=\s*[^\W\d]", line) else ""


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


def _file_kind(path: str | Path) -> str:
    mode = os.stat(path).st_mode
    kinds = ((stat.S_ISDIR, "a directory"), (stat.S_ISFIFO, "a FIFO"), (stat.S_ISSOCK, "a socket"))
    return next((name for test, name in kinds if test(mode)), "a device")


def _refuse_nesting(file: str) -> NoReturn:
    _refuse(file, f"tables and lists nested at most {DEEPEST_NESTING} deep", "deeper nesting")


def _refuse(place: str, wanted: str, got: str, remedy: str = "") -> NoReturn:
    raise InputError(Fault(place, wanted, got, remedy)) from None
