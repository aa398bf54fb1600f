"""The boards of a batch: the cards of a folder, or the rows of a table with a card as their template."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from bayesplate.board.board import Board
from bayesplate.board.card_file import CardFile
from bayesplate.board.csv_table import csv_table
from bayesplate.board.rows import Cell, Columns, is_empty
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


class Source(Protocol):
    """Where boards come from; little is kept of each, for there may be very many."""

    names: Sequence[str]
    """Of the boards, in their order, before it is known whether each may be one."""
    alike: Sequence[tuple[str, ...]]
    """What boards have in common that share their matrices: they are fitted one after another."""
    aside: Sequence[str]
    """Files that were left aside, because they are cards of another kind."""

    def card(self, at: int) -> Board:
        """The card of the board at a place among the names; raises InputError with all its faults."""

    def place(self, at: int) -> str:
        """Where that board stands, as messages show it; empty where its own file says so."""


class Folder:
    """The board cards of a folder; priors, campaigns, coefficient tables and what `pick` writes are left aside.

    Raises
    ------
    InputError
        If it cannot be read, or there is no board card in it.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._inside = path, os.path.join(os.path.realpath(path), "")
        self._strange: dict[int, str] = {}  # files whose name is not the board's
        names: list[str] = []
        alike: list[tuple[str, ...]] = []
        aside: list[str] = []
        kept: dict[tuple[str, ...], tuple[str, ...]] = {}
        for name in _cards_in(path):
            content = self._content_of(name) if self._is_inside(name) else {}
            is_other = not {"plate", "setup"} & content.keys() and _OF_OTHER_CARDS & content.keys()
            if is_other or content.keys() == {"setup"}:
                aside.append(plain(name))
                continue
            own = plain(name.removesuffix(".toml"))
            if f"{own}.toml" != name:
                self._strange[len(names)] = name
            names.append(own)
            shared = _alike(content)
            alike.append(kept.setdefault(shared, shared))
        if not names:
            raise InputError(Fault(plain(str(path)), "a folder with board cards (NAME.toml)", "none in it"))
        self.names: Sequence[str] = names
        self.alike: Sequence[tuple[str, ...]] = alike
        self.aside: Sequence[str] = aside

    def card(self, at: int) -> Board:
        """The card of a board; raises InputError with all its faults, or if it is a link that leads elsewhere."""
        file = self._strange.get(at, f"{self.names[at]}.toml")
        if not self._is_inside(file):
            wanted, remedy = "a card in the folder of the batch", "copy the card"
            raise InputError(Fault(plain(file), wanted, "a link that leads out of it", remedy))
        data = read_file(os.path.join(self._path, file))  # no Path: Python keeps every name that stood in one
        return Board.from_card(CardFile.of(data, file, self._path))

    def place(self, at: int) -> str:
        """Nothing: the faults of a card name its file."""
        return ""

    def _is_inside(self, file: str) -> bool:
        return os.path.realpath(os.path.join(self._path, file)).startswith(self._inside)

    def _content_of(self, file: str) -> Mapping[str, Any]:
        """What a card's file holds; nothing where it cannot be read, which is told when the board's turn comes."""
        try:
            return read_table(read_file(os.path.join(self._path, file)), plain(file))
        except InputError:
            return {}


class Table:
    """The rows of a table, in CSV or Parquet, with a card as the template of what is common.

    Parameters
    ----------
    template : str or path
        A board card.

    Raises
    ------
    InputError
        If the table or the template cannot be read, a column is no key of a card, or there is no row.
    """

    def __init__(self, path: Path, template: str | Path) -> None:
        self._file = plain(path.name)
        header, self._rows = _read_parquet(path) if _ending(path) == ".parquet" else _read_csv(path)
        self._columns = Columns(template, header, self._file)
        filled = [i for i, row in enumerate(self._rows, start=1) if not all(map(is_empty, row))]
        if not filled:
            raise InputError(Fault(self._file, "a row for each board", "no row"))
        named = sorted((plain(self._columns.name_of(self._rows[i - 1])) or f"row-{i}", i) for i in filled)
        self.names: Sequence[str] = [name for name, _ in named]
        self.alike: Sequence[tuple[str, ...]] = [()] * len(named)
        self.aside: Sequence[str] = ()
        self._numbers = [number for _, number in named]

    def card(self, at: int) -> Board:
        """The card of a row; raises InputError with all its faults."""
        return self._columns.board(self._rows[self._numbers[at] - 1])

    def place(self, at: int) -> str:
        """The table and the number of the row, the first below the header being 1."""
        return f"{self._file} row {self._numbers[at]}"


def boards_of(source: str | os.PathLike[str], template: str | os.PathLike[str] | None) -> Source:
    """The boards of a folder or of a table.

    Raises
    ------
    InputError
        If there are none, or a template is given with a folder or lacks with a table.
    """
    path = Path(source)
    if os.path.isdir(path):
        if template is not None:
            raise InputError(Fault("--template", "a table of boards beside it", "a folder of cards"))
        return Folder(path)
    if not os.path.exists(path):
        got, looked = "nothing there", f"looked in {plain(str(path.absolute().parent))}"
        raise InputError(Fault(plain(str(path)), _WANTED, got, looked))
    if _ending(path) not in (".csv", ".parquet"):
        remedy = "save the table as CSV" if _ending(path) in _OF_SHEETS else ""
        raise InputError(Fault(plain(str(path)), _WANTED, "another file", remedy))
    if template is None:
        remedy = "a board card with what all boards have in common"
        raise InputError(Fault("--template", "a card for the table", "none", remedy))
    return Table(path, os.fspath(template))


def _ending(path: Path) -> str:
    return path.suffix.lower()


def _cards_in(folder: Path) -> list[str]:
    """Names of the files that may be cards, in their order."""
    try:
        return sorted(name for name in os.listdir(folder) if name.endswith(".toml"))
    except OSError as error:
        raise InputError(Fault(plain(str(folder)), "a readable folder", error.strerror or str(error))) from None


def _alike(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Edges and aspect ratio, as far as they can be seen without reading the card."""
    plate, setups = content.get("plate"), content.get("setup")
    sides = [plate.get(f"length_{side}_mm") for side in "xy"] if isinstance(plate, dict) else []
    told = [side.get("mean") if isinstance(side, dict) else side for side in sides]
    means = [float(side) for side in told if isinstance(side, int | float) and 0 < side <= _LONGEST]
    listed = setups if isinstance(setups, list) else [setups]
    edges = [repr(one.get("edges")) for one in listed if isinstance(one, dict)]
    if len(means) == 2:
        edges.append(f"{means[0] / means[1]:.3f}")
    return tuple(edges)


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
    columns = [_cells(column.to_pylist()) for column in found.columns]
    return list(found.column_names), [list(row) for row in zip(*columns, strict=True)]


def _cells(values: Sequence[Any]) -> list[Cell]:
    """A column of Parquet: numbers and texts as they are, nothing where there is nothing or not-a-number."""
    return [None if value is None or value != value else value for value in values]
