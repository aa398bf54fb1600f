"""Rows of boards on disk: the journal of a run, a line for each board that is done, and the table of all of them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Literal

from pydantic import TypeAdapter

from bayesplate.errors import Fault, InputError
from bayesplate.files import whole_file, write_text, writing
from bayesplate.grading.boards import NUMBERS, WORDS, BoardRow
from bayesplate.results.contract import as_json
from bayesplate.results.tables import csv_text

_ROW = TypeAdapter(BoardRow)


class Journal:
    """Rows of the boards that are done, by keys, each on disk before the next board; an existing file is read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, BoardRow] = {}
        with writing(path):
            self._stream = path.open("ab", buffering=0)
            *lines, half_written = path.read_bytes().split(b"\n")
            self._stream.truncate(self._stream.tell() - len(half_written))
        self.rows.update(filter(None, map(_entry, lines)))

    def append(self, key: str, row: BoardRow) -> None:
        """Add a row; raises UnwritableError at a full disk."""
        line = _line(key, row)
        with writing(self.path):
            start = os.fstat(self._stream.fileno()).st_size
            if self._stream.write(line) != len(line):
                self._stream.truncate(start)
                raise OSError("no space left")
        self.rows[key] = row

    def keep(self, keys: Iterable[str]) -> None:
        """Write the journal anew with the rows of these keys alone, in this order."""
        with writing(self.path), whole_file(self.path) as stream:
            stream.writelines(_line(key, self.rows[key]) for key in keys)

    def close(self) -> None:
        """Let go of the file."""
        self._stream.close()


def _line(key: str, row: BoardRow) -> bytes:
    """A row with its key and the hash of both, so that a line which was altered later is known."""
    content = as_json(row)
    whole = {"key": key, "sha256": _hash_of(key, content), "row": content}
    return json.dumps(whole, allow_nan=False).encode() + b"\n"


def _hash_of(key: str, content: Any) -> str:
    return hashlib.sha256(json.dumps([key, content], allow_nan=False).encode()).hexdigest()


def _entry(line: bytes) -> tuple[str, BoardRow] | None:
    """The key and the row of a line; None if it is not as it was written."""
    try:
        entry: Any = json.loads(line)
        key = str(entry["key"])
        return (key, _ROW.validate_python(entry["row"])) if entry["sha256"] == _hash_of(key, entry["row"]) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


TableKind = Literal["csv", "parquet"]


def parquet_library(place: str) -> Any:
    """pyarrow; an InputError with the command that installs it where it is not there."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        remedy = 'pip install "bayesplate[parquet]", or take CSV'
        raise InputError(Fault(place, "pyarrow, which reads and writes Parquet", "no such library", remedy)) from None
    return pyarrow


def write_table(folder: Path, kind: TableKind, rows: Sequence[BoardRow]) -> Path:
    """Write boards.csv or boards.parquet into a folder that is there, completely or not at all."""
    path = folder / f"boards.{kind}"
    if kind == "csv":
        write_text(path, csv_text([*WORDS, *NUMBERS], [row.cells() for row in rows]))
        return path
    with writing(path), whole_file(path) as stream:
        _write_parquet(stream, rows)
    return path


def _write_parquet(stream: BinaryIO, rows: Sequence[BoardRow]) -> None:
    arrow = parquet_library("--table parquet")
    texts = [(word, arrow.int64() if word == "seed" else arrow.string()) for word in WORDS]
    schema = arrow.schema([*texts, *((name, arrow.float64()) for name in NUMBERS)])
    cells = [dict(zip(schema.names, row.cells(), strict=True)) for row in rows]
    arrow.parquet.write_table(arrow.Table.from_pylist(cells, schema=schema), stream)
