"""The table of many boards as CSV or Parquet, written a row at a time, so that its length costs no memory."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, Literal, TypeVar

from bayesplate.errors import Fault, InputError
from bayesplate.files import whole_file, writing
from bayesplate.results.board_rows import NUMBERS, WORDS, BoardRow
from bayesplate.results.tables import csv_text

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
    kind : "csv" or "parquet"
    rows : iterable of BoardRow

    Returns
    -------
    Path
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
