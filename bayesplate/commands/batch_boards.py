"""The boards of a batch: the cards of a folder, or the rows of a table with a card as their template."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bayesplate.board.board import Board
from bayesplate.board.csv_table import read_csv_table
from bayesplate.board.rows import CellValue, TableColumns, is_empty
from bayesplate.board.shelf import CardFile
from bayesplate.board.toml import parse_toml, read_file
from bayesplate.errors import Fault, InputError, printable
from bayesplate.grading.storage import parquet_library

LARGEST_TABLE = 100_000_000
"""Bytes; hundreds of thousands of boards, and ten times as much in memory."""
_LONGEST_SIDE = 1e9
_WANTED_SOURCE = "a folder of cards, or a table (.csv or .parquet)"
_SPREADSHEET_SUFFIXES = (".tsv", ".tab", ".txt", ".xlsx", ".xls", ".xlsm", ".ods", ".numbers")
_OTHER_CARD_KEYS = {"boards", "coefficients", "E", "E_x", "D_x", "noise_percent"}
"""Keys that a campaign, a coefficient table and a prior card have and a board card has not."""


@dataclass(frozen=True)
class BatchBoard:
    """A board of a batch that is read when its turn comes, for there may be very many."""

    name: str
    card: Callable[[], Board]  # raises InputError with all its faults
    place: str = ""  # where it stands, as messages show it; empty where its own file says so
    alike: tuple[str, ...] = ()  # equal for boards that share matrices, which are fitted one after another


def list_boards(
    source: str | os.PathLike[str], template: str | os.PathLike[str] | None
) -> tuple[list[BatchBoard], tuple[str, ...]]:
    """The boards of a folder or a table by name, and files that are other cards; InputError if there are none."""
    path = Path(source)
    if os.path.isdir(path):
        if template is not None:
            raise InputError(Fault("--template", "a table of boards beside it", "a folder of cards"))
        return _folder_boards(path)
    if not os.path.exists(path):
        got, hint = "nothing there", f"looked in {printable(str(path.absolute().parent))}"
        raise InputError(Fault(printable(str(path)), _WANTED_SOURCE, got, hint))
    ending = path.suffix.lower()
    if ending not in (".csv", ".parquet"):
        remedy = "save the table as CSV" if ending in _SPREADSHEET_SUFFIXES else ""
        raise InputError(Fault(printable(str(path)), _WANTED_SOURCE, "another file", remedy))
    if template is None:
        remedy = "a board card with what all boards have in common"
        raise InputError(Fault("--template", "a card for the table", "none", remedy))
    header, rows = (_read_csv if ending == ".csv" else _read_parquet)(path)
    return _table_boards(
        printable(path.name), TableColumns(os.fspath(template), header, printable(path.name)), rows
    ), ()


def _folder_boards(folder: Path) -> tuple[list[BatchBoard], tuple[str, ...]]:
    """The board cards of a folder; priors, campaigns, coefficient tables and what `pick` writes are left aside."""
    try:
        files = sorted(name for name in os.listdir(folder) if name.lower().endswith(".toml"))
    except OSError as error:
        raise InputError(Fault(printable(str(folder)), "a readable folder", error.strerror or str(error))) from None
    boards, other_cards = [], []
    for file in files:
        content = _card_content(folder, file)
        is_other_card = not {"plate", "setup"} & content.keys() and _OTHER_CARD_KEYS & content.keys()
        if is_other_card or content.keys() == {"setup"}:
            other_cards.append(printable(file))
        else:
            name = printable(file[: -len(".toml")])
            boards.append(BatchBoard(name, partial(_read_folder_card, folder, file), alike=_matrix_key(content)))
    if not boards:
        raise InputError(Fault(printable(str(folder)), "a folder with board cards (NAME.toml)", "none in it"))
    return boards, tuple(other_cards)


def _read_folder_card(folder: Path, file: str) -> Board:
    """A card of the folder; raises InputError with all its faults, or if it is a link that leads elsewhere."""
    if not _is_inside(folder, file):
        wanted, remedy = "a card in the folder of the batch", "copy the card"
        raise InputError(Fault(printable(file), wanted, "a link that leads out of it", remedy))
    return Board.from_card(CardFile.of(read_file(os.path.join(folder, file)), file, folder))


def _card_content(folder: Path, file: str) -> Mapping[str, Any]:
    """Content of a card; empty where it cannot be read, which is reported when the board's turn comes."""
    try:
        return parse_toml(read_file(os.path.join(folder, file)), printable(file)) if _is_inside(folder, file) else {}
    except InputError:
        return {}


def _is_inside(folder: Path, file: str) -> bool:
    return os.path.realpath(os.path.join(folder, file)).startswith(os.path.join(os.path.realpath(folder), ""))


def _matrix_key(content: Mapping[str, Any]) -> tuple[str, ...]:
    """Edges and aspect ratio, as far as they can be seen without reading the card."""
    plate, setups = content.get("plate"), content.get("setup")
    sides = [plate.get(f"length_{side}_mm") for side in "xy"] if isinstance(plate, dict) else []
    stated_sides = [side.get("mean") if isinstance(side, dict) else side for side in sides]
    means = [float(side) for side in stated_sides if isinstance(side, int | float) and 0 < side <= _LONGEST_SIDE]
    setup_tables = setups if isinstance(setups, list) else [setups]
    edges = [repr(setup.get("edges")) for setup in setup_tables if isinstance(setup, dict)]
    return (*edges, f"{means[0] / means[1]:.3f}") if len(means) == 2 else tuple(edges)


def _table_boards(file: str, columns: TableColumns, rows: Sequence[Sequence[CellValue]]) -> list[BatchBoard]:
    """The boards of a table; its rows are counted from the first below the header, empty ones too."""

    def read_rows() -> Iterator[BatchBoard]:
        for i, row in enumerate(rows, start=1):
            if not all(map(is_empty, row)):
                name = printable(columns.name_of(row)) or f"row-{i}"
                yield BatchBoard(name, partial(columns.board, row), f"{file} row {i}")

    boards = sorted(read_rows(), key=lambda board: board.name)
    if not boards:
        raise InputError(Fault(file, "a row for each board", "no row"))
    return boards


def _read_csv(path: Path) -> tuple[Sequence[str], Sequence[Sequence[CellValue]]]:
    file = printable(path.name)
    try:
        if not path.is_file():
            raise InputError(Fault(file, "a regular file", "another kind"))
        if path.stat().st_size > LARGEST_TABLE:
            raise InputError(Fault(file, f"a table of at most {LARGEST_TABLE:,} bytes", "a larger one"))
        return read_csv_table(path.read_bytes(), file)
    except OSError as error:
        raise InputError(Fault(printable(str(path)), "a readable table", error.strerror or str(error))) from None


def _read_parquet(path: Path) -> tuple[Sequence[str], Sequence[Sequence[CellValue]]]:
    file = printable(path.name)
    arrow = parquet_library(file)
    try:
        table = arrow.parquet.read_table(path)
    except (OSError, arrow.ArrowException) as error:
        raise InputError(Fault(file, "a Parquet table", printable(str(error)))) from None
    rows = zip(*(column.to_pylist() for column in table.columns), strict=True)
    # NaN, which some programs write for an empty cell, is an empty cell
    return list(table.column_names), [[None if cell != cell else cell for cell in row] for row in rows]
