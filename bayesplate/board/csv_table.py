"""A table of boards as CSV with commas between the cells; other separators are recognised and refused."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise

from bayesplate.board.words import quote_text
from bayesplate.errors import Fault, InputError, printable

_SEPARATORS = {";": "semicolons", "\t": "tabs"}
_LABEL_START, _LABEL_END = re.compile(r"\s*(?:\S+ )?\(\d{1,3}"), re.compile(r"\s*\d{1,3}\)(?: sd)?\s*")


def read_csv_table(data: bytes, file: str) -> tuple[list[str], list[list[str]]]:
    """Header and rows of a CSV file in UTF-8, empty rows included; raises InputError for anything else."""
    rows = _read_rows(data, file)
    header = next((row for row in rows if any(map(str.strip, row))), None)
    if header is None:
        raise InputError(Fault(file, "a table with a header", "an empty file"))
    _require_commas(header, file)
    _require_whole_labels(header, file)
    return [name.strip() for name in header], list(rows)


def _read_rows(data: bytes, file: str) -> Iterator[list[str]]:
    try:
        stream = io.StringIO(data.decode("utf-8-sig"), newline="")
    except UnicodeDecodeError as error:
        got = f"the byte 0x{data[error.start]:02x} at offset {error.start}"
        raise InputError(Fault(file, "UTF-8 text", got, "save the file as UTF-8")) from None
    try:
        yield from csv.reader(stream, strict=True)
    except csv.Error as error:
        raise InputError(Fault(file, "a CSV table, commas between its cells", printable(str(error)))) from None


def _require_commas(header: Sequence[str], file: str) -> None:
    """Spreadsheets of countries with decimal commas put semicolons between cells."""
    for mark, got in _SEPARATORS.items():
        if mark in header[0]:
            remedy = "separate cells with commas, write decimals with a point, and labels in double quotes"
            raise InputError(Fault(f"{file} header", "commas between the cells", got, remedy))


def _require_whole_labels(header: Sequence[str], file: str) -> None:
    """The comma in a label without quotes divides it into two cells."""
    labels = [f'"{cell.strip()},{next_cell.strip()}"' for cell, next_cell in pairwise(header)
              if _LABEL_START.fullmatch(cell) and _LABEL_END.fullmatch(next_cell)]  # fmt: skip
    if labels:
        got, remedy = f"{len(labels)} without, each of them two cells", f"write {','.join(labels)}"
        raise InputError(Fault(f"{file} header", f"labels in double quotes, {quote_text('(1,1)')}", got, remedy))
