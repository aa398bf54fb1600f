"""Rows of boards on disk: the journal of a run, a line for each board that is done, and the table of all of them."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, Literal, TypeVar

from bayesplate.errors import Fault, InputError
from bayesplate.files import whole_file, writing
from bayesplate.grading.boards import NUMBERS, WORDS, BoardRow
from bayesplate.results.tables import csv_text


class Journal:
    """Rows of boards on disk; in memory is only where those of earlier runs stand, by their keys.

    Parameters
    ----------
    path : Path
        Made if it is not there; what it holds is read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._places: dict[str, int] = {}
        with writing(path):
            self._stream = path.open("ab", buffering=0)
            self._lines = path.open("rb")
            self._read()

    def _read(self) -> None:
        """Where each row stands; the last line of a killed run, and any other that is damaged, are none."""
        end = 0
        for line in self._lines:
            if line.endswith(b"\n"):
                key = _key_of(line)
                if key is not None:
                    self._places[key] = end
                end += len(line)
        self._stream.truncate(end)

    def place(self, key: str) -> int | None:
        """Where the row of a key stands; None where no earlier run left one."""
        return self._places.get(key)

    def row(self, place: int) -> BoardRow:
        """The row that stands there."""
        return BoardRow.from_json(json.loads(self._line(place))["row"])

    def append(self, key: str, row: BoardRow) -> int:
        """Add a row, and return where it stands; raises UnwritableError at a full disk."""
        line = _line(key, row)
        with writing(self.path):
            start = os.fstat(self._stream.fileno()).st_size
            if self._stream.write(line) != len(line):
                self._stream.truncate(start)
                raise OSError("no space left")
        return start

    def rows(self, places: Sequence[int]) -> Sequence[BoardRow]:
        """The rows that stand there, in this order; each is read when it is asked for."""
        return _Rows(self, places)

    def keep(self, places: Iterable[int]) -> None:
        """Write the journal anew with these rows alone, in this order; it is closed then."""
        with writing(self.path), whole_file(self.path) as stream:
            stream.writelines(self._line(place) for place in places)
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        self._stream.close()
        self._lines.close()

    def _line(self, place: int) -> bytes:
        self._lines.seek(place)
        return self._lines.readline()


@dataclass(frozen=True)
class _Rows(Sequence[BoardRow]):
    journal: Journal
    places: Sequence[int]

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, at: Any) -> Any:
        return self.journal.row(self.places[at])


def _line(key: str, row: BoardRow) -> bytes:
    """A row with its key and the hash of both, so that a line which was altered later is known."""
    content = row.to_json()
    whole = {"key": key, "sha256": _hash_of(key, content), "row": content}
    return json.dumps(whole, allow_nan=False).encode() + b"\n"


def _hash_of(key: str, content: Any) -> str:
    return hashlib.sha256(json.dumps([key, content], allow_nan=False).encode()).hexdigest()


def _key_of(line: bytes) -> str | None:
    """The key of a line; None if it is not as it was written."""
    try:
        found: Any = json.loads(line)
        key = str(found["key"])
        return key if found["sha256"] == _hash_of(key, found["row"]) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None


TableKind = Literal["csv", "parquet"]
T = TypeVar("T")
_AT_ONCE = 1000
_WHOLE = "seed"


def table_name(kind: TableKind) -> str:
    """The file of the table."""
    return f"boards.{kind}"


def require_table_kind(kind: TableKind) -> None:
    """Check that such a table can be written here.

    Raises
    ------
    InputError
        If it is Parquet and pyarrow is not installed.
    """
    if kind == "parquet":
        parquet_library("--table parquet")


def parquet_library(place: str) -> Any:
    """pyarrow; an InputError with the command that installs it where it is not there."""
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        remedy = 'pip install "bayesplate[parquet]", or take CSV'
        raise InputError(Fault(place, "pyarrow, which reads and writes Parquet", "no such library", remedy)) from None
    return pyarrow


def write_table(folder: Path, kind: TableKind, rows: Iterable[BoardRow]) -> Path:
    """Write the table of some boards, completely or not at all.

    Parameters
    ----------
    folder : Path
        Must be there.
    """
    path = folder / table_name(kind)
    with writing(path), whole_file(path) as stream:
        (_write_csv if kind == "csv" else _write_parquet)(stream, rows)
    return path


def _write_csv(stream: BinaryIO, rows: Iterable[BoardRow]) -> None:
    write_rows(stream, [*WORDS, *NUMBERS], (row.cells() for row in rows))


def write_rows(stream: BinaryIO, header: list[Any], rows: Iterable[list[Any]]) -> None:
    """Write CSV part after part."""
    stream.write(csv_text(header, []).encode())
    for some in _in_parts(rows, _AT_ONCE):
        stream.write(csv_text((), some).encode())


def _write_parquet(stream: BinaryIO, rows: Iterable[BoardRow]) -> None:
    arrow = parquet_library("--table parquet")
    texts = [(word, arrow.int64() if word == _WHOLE else arrow.string()) for word in WORDS]
    schema = arrow.schema([*texts, *((name, arrow.float64()) for name in NUMBERS)])
    with arrow.parquet.ParquetWriter(stream, schema) as writer:
        for some in _in_parts(rows, _AT_ONCE):
            columns = list(zip(*(row.cells() for row in some), strict=True))
            writer.write_table(arrow.table(dict(zip(schema.names, map(list, columns), strict=True)), schema=schema))


def _in_parts(rows: Iterable[T], n: int) -> Iterator[list[T]]:
    source = iter(rows)
    while some := list(islice(source, n)):
        yield some
