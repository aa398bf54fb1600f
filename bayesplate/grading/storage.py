"""Board rows on disk: the journal of a batch, with one line per finished board, and the table of all boards."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, Literal

from pydantic import TypeAdapter

from bayesplate.errors import Fault, InputError
from bayesplate.files import catch_write_errors, whole_file, write_text
from bayesplate.grading.boards import NUMBER_COLUMNS, TEXT_COLUMNS, BoardRow
from bayesplate.results.contract import as_json
from bayesplate.results.tables import csv_text

_ROW = TypeAdapter(BoardRow)


class Journal:
    """Rows of the finished boards by key, each on disk before the next board; an existing file is read."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, BoardRow] = {}
        with catch_write_errors(path):
            self._stream = path.open("ab", buffering=0)
            *lines, half_written = path.read_bytes().split(b"\n")
            self._stream.truncate(self._stream.tell() - len(half_written))
        self.rows.update(filter(None, map(_parse_line, lines)))

    def append(self, key: str, row: BoardRow) -> None:
        """Add a row; raises UnwritableError at a full disk."""
        line = _journal_line(key, row)
        with catch_write_errors(self.path):
            start = os.fstat(self._stream.fileno()).st_size
            if self._stream.write(line) != len(line):
                self._stream.truncate(start)
                raise OSError("no space left")
        self.rows[key] = row

    def keep(self, keys: Iterable[str]) -> None:
        """Rewrite the journal with the rows of these keys alone, in this order."""
        with catch_write_errors(self.path), whole_file(self.path) as stream:
            stream.writelines(_journal_line(key, self.rows[key]) for key in keys)

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _journal_line(key: str, row: BoardRow) -> bytes:
    """A row with its key and the hash of both, which shows whether the line was altered later."""
    content = as_json(row)
    entry = {"key": key, "sha256": _row_hash(key, content), "row": content}
    return json.dumps(entry, allow_nan=False).encode() + b"\n"


def _row_hash(key: str, content: Any) -> str:
    return hashlib.sha256(json.dumps([key, content], allow_nan=False).encode()).hexdigest()


def _parse_line(line: bytes) -> tuple[str, BoardRow] | None:
    """The key and the row of a line; None if the line was altered or cut off."""
    try:
        entry: Any = json.loads(line)
        key = str(entry["key"])
        return (key, _ROW.validate_python(entry["row"])) if entry["sha256"] == _row_hash(key, entry["row"]) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


TableKind = Literal["csv", "parquet"]


def parquet_library(place: str) -> Any:
    """The module pyarrow; where it is missing, an InputError with the command that installs it."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        remedy = 'pip install "bayesplate[parquet]", or take CSV'
        raise InputError(Fault(place, "pyarrow, which reads and writes Parquet", "no such library", remedy)) from None
    return pyarrow


def write_table(folder: Path, kind: TableKind, rows: Sequence[BoardRow]) -> Path:
    """Write boards.csv or boards.parquet into an existing folder, completely or not at all."""
    path = folder / f"boards.{kind}"
    if kind == "csv":
        write_text(path, csv_text([*TEXT_COLUMNS, *NUMBER_COLUMNS], [row.cells() for row in rows]))
        return path
    with catch_write_errors(path), whole_file(path) as stream:
        _write_parquet(stream, rows)
    return path


def _write_parquet(stream: BinaryIO, rows: Sequence[BoardRow]) -> None:
    arrow = parquet_library("--table parquet")
    texts = [(word, arrow.int64() if word == "seed" else arrow.string()) for word in TEXT_COLUMNS]
    schema = arrow.schema([*texts, *((name, arrow.float64()) for name in NUMBER_COLUMNS)])
    cells = [dict(zip(schema.names, row.cells(), strict=True)) for row in rows]
    arrow.parquet.write_table(arrow.Table.from_pylist(cells, schema=schema), stream)
