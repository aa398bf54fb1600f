"""The boards of a batch: the cards of a folder, or the rows of a table with a card as their template."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bayesplate.board.board import Board
from bayesplate.board.csv_table import csv_table
from bayesplate.board.rows import Cell, Columns, is_empty
from bayesplate.board.shelf import CardFile
from bayesplate.board.toml import read_file, read_table
from bayesplate.errors import Fault, InputError, plain
from bayesplate.grading.storage import parquet_library

LARGEST_TABLE = 100_000_000
"""Bytes; hundreds of thousands of boards, and ten times as much in memory."""
_LONGEST = 1e9
_WANTED = "a folder of cards, or a table (.csv or .parquet)"
_OF_SHEETS = (".tsv", ".tab", ".txt", ".xlsx", ".xls", ".xlsm", ".ods", ".numbers")
_OF_OTHER_CARDS = {"boards", "coefficients", "E_x", "D_x", "noise_percent"}
"""Keys that a campaign, a coefficient table and a prior card have and a board card has not."""


@dataclass(frozen=True)
class Entry:
    """A board of a batch that is read when its turn comes, for there may be very many."""

    name: str
    card: Callable[[], Board]  # raises InputError with all its faults
    place: str = ""  # where it stands, as messages show it; empty where its own file says so
    alike: tuple[str, ...] = ()  # in common with boards that share its matrices, which are fitted one after another


def boards_of(
    source: str | os.PathLike[str], template: str | os.PathLike[str] | None
) -> tuple[list[Entry], tuple[str, ...]]:
    """The boards of a folder or a table by name, and files that are other cards; InputError if there are none."""
    path = Path(source)
    if os.path.isdir(path):
        if template is not None:
            raise InputError(Fault("--template", "a table of boards beside it", "a folder of cards"))
        return _in_folder(path)
    if not os.path.exists(path):
        got, looked = "nothing there", f"looked in {plain(str(path.absolute().parent))}"
        raise InputError(Fault(plain(str(path)), _WANTED, got, looked))
    ending = path.suffix.lower()
    if ending not in (".csv", ".parquet"):
        remedy = "save the table as CSV" if ending in _OF_SHEETS else ""
        raise InputError(Fault(plain(str(path)), _WANTED, "another file", remedy))
    if template is None:
        remedy = "a board card with what all boards have in common"
        raise InputError(Fault("--template", "a card for the table", "none", remedy))
    header, rows = (_read_csv if ending == ".csv" else _read_parquet)(path)
    return _of_rows(plain(path.name), Columns(os.fspath(template), header, plain(path.name)), rows), ()


def _in_folder(folder: Path) -> tuple[list[Entry], tuple[str, ...]]:
    """The board cards of a folder; priors, campaigns, coefficient tables and what `pick` writes are left aside."""
    try:
        files = sorted(name for name in os.listdir(folder) if name.endswith(".toml"))
    except OSError as error:
        raise InputError(Fault(plain(str(folder)), "a readable folder", error.strerror or str(error))) from None
    entries, aside = [], []
    for file in files:
        content = _content_of(folder, file)
        is_other = not {"plate", "setup"} & content.keys() and _OF_OTHER_CARDS & content.keys()
        if is_other or content.keys() == {"setup"}:
            aside.append(plain(file))
        else:
            name = plain(file.removesuffix(".toml"))
            entries.append(Entry(name, partial(_card_in, folder, file), alike=_alike(content)))
    if not entries:
        raise InputError(Fault(plain(str(folder)), "a folder with board cards (NAME.toml)", "none in it"))
    return entries, tuple(aside)


def _card_in(folder: Path, file: str) -> Board:
    """A card of the folder; raises InputError with all its faults, or if it is a link that leads elsewhere."""
    if not _is_inside(folder, file):
        wanted, remedy = "a card in the folder of the batch", "copy the card"
        raise InputError(Fault(plain(file), wanted, "a link that leads out of it", remedy))
    return Board.from_card(CardFile.of(read_file(os.path.join(folder, file)), file, folder))


def _content_of(folder: Path, file: str) -> Mapping[str, Any]:
    """Content of a card; empty where it cannot be read, which is reported when the board's turn comes."""
    try:
        return read_table(read_file(os.path.join(folder, file)), plain(file)) if _is_inside(folder, file) else {}
    except InputError:
        return {}


def _is_inside(folder: Path, file: str) -> bool:
    return os.path.realpath(os.path.join(folder, file)).startswith(os.path.join(os.path.realpath(folder), ""))


def _alike(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Edges and aspect ratio, as far as they can be seen without reading the card."""
    plate, setups = content.get("plate"), content.get("setup")
    sides = [plate.get(f"length_{side}_mm") for side in "xy"] if isinstance(plate, dict) else []
    told = [side.get("mean") if isinstance(side, dict) else side for side in sides]
    means = [float(side) for side in told if isinstance(side, int | float) and 0 < side <= _LONGEST]
    listed = setups if isinstance(setups, list) else [setups]
    edges = [repr(one.get("edges")) for one in listed if isinstance(one, dict)]
    return (*edges, f"{means[0] / means[1]:.3f}") if len(means) == 2 else tuple(edges)


def _of_rows(file: str, columns: Columns, rows: Sequence[Sequence[Cell]]) -> list[Entry]:
    """The boards of a table; its rows are counted from the first below the header, lines without a word too."""

    def entries() -> Iterator[Entry]:
        for i, row in enumerate(rows, start=1):
            if not all(map(is_empty, row)):
                name = plain(columns.name_of(row)) or f"row-{i}"
                yield Entry(name, partial(columns.board, row), f"{file} row {i}")

    found = sorted(entries(), key=lambda entry: entry.name)
    if not found:
        raise InputError(Fault(file, "a row for each board", "no row"))
    return found


def _read_csv(path: Path) -> tuple[Sequence[str], Sequence[Sequence[Cell]]]:
    file = plain(path.name)
    try:
        if not path.is_file():
            raise InputError(Fault(file, "a regular file", "another kind"))
        if path.stat().st_size > LARGEST_TABLE:
            raise InputError(Fault(file, f"a table of at most {LARGEST_TABLE:,} bytes", "a larger one"))
        return csv_table(path.read_bytes(), file)
    except OSError as error:
        raise InputError(Fault(plain(str(path)), "a readable table", error.strerror or str(error))) from None


def _read_parquet(path: Path) -> tuple[Sequence[str], Sequence[Sequence[Cell]]]:
    file = plain(path.name)
    arrow = parquet_library(file)
    try:
        found = arrow.parquet.read_table(path)
    except (OSError, arrow.ArrowException) as error:
        raise InputError(Fault(file, "a Parquet table", plain(str(error)))) from None
    rows = zip(*(column.to_pylist() for column in found.columns), strict=True)
    # a number that is not one, which some programs write for an empty cell, is none
    return list(found.column_names), [[None if cell != cell else cell for cell in row] for row in rows]
