"""Boards as rows of a table: common values stand on a card, the template, and each column is one of its keys."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, NamedTuple

from bayesplate.board.board import Board
from bayesplate.board.board_keys import BoardKeys
from bayesplate.board.schema import sections_of
from bayesplate.board.shelf import CardFile
from bayesplate.board.words import did_you_mean, quote_text
from bayesplate.errors import Fault, InputError

CellValue = str | float | int | None
ColumnPath = tuple[str, ...]
"""The keys that lead to a value; those of a mode are "setup", the name of the setup, and the label."""

_TEXT_COLUMNS = ("name", "title", "source", "notes")
_TEXT_KEYS = (*_TEXT_COLUMNS, "prior")
"""Keys whose values are texts, also where a cell looks like a number."""
_SECTION_OF_KEY = {key: section for section in ("plate", "material") for key in sections_of(BoardKeys)[(section,)]}
_MASS_KEYS = ("mass_g", "density_kg_m3")
_UNLABELLED_KEYS = ("unlabelled_hz", "peaks")
_LABEL_KEYS = ("signs", "label_confidence")
_MODE_NAME = re.compile(r"(?:(?P<setup>[A-Za-z0-9._-]+) )?\( *(?P<m>\d{1,3}) *, *(?P<n>\d{1,3}) *\)")
_SD_SUFFIX = " sd"
_MOST_COLUMNS = 500


class _Column(NamedTuple):
    """The path of a column's values on a card, and whether they are standard deviations."""

    path: ColumnPath
    is_sd: bool


class TableColumns:
    """The columns of a table as keys of a card; raises InputError with every column that is no key.

    A column is `name`, `title`, a key of [plate] or [material], or the label of a mode, "(1,1)" or "SETUP (1,1)", with
    " sd" behind it for the standard deviation. The template is the card of the values common to all boards; each of its
    frequencies must have a column.
    """

    def __init__(self, template: str | PathLike[str], names: Sequence[str], file: str) -> None:
        self.template, self.names, self.file = CardFile.load("boards", template), tuple(names), file
        self._setup_names = [_setup_name(setup) for setup in _setup_tables(self.template.table)]
        if len(names) > _MOST_COLUMNS:
            raise InputError(Fault(file, f"at most {_MOST_COLUMNS} columns", str(len(names))))
        faults: list[Fault] = []
        self._columns: list[_Column | None] = []
        for i, name in enumerate(names, start=1):
            column = self._read_column(name) if name else None
            if isinstance(column, str):
                wanted = "a key of a board card, or the label of a mode"
                faults.append(Fault(f"{file} column {i}", wanted, quote_text(name), column))
                column = None
            elif column is not None and column in self._columns:
                first = names[self._columns.index(column)]
                got = quote_text(name) + (" again" if first == name else f", which is {quote_text(first)} again")
                faults.append(Fault(f"{file} column {i}", "each column once", got))
                column = None
            self._columns.append(column)
        faults += [*self._lone_sd_faults(), *self._template_reading_faults()]
        if "name" not in names:
            faults.append(Fault(file, "a column with the names of the boards", "none", 'call it "name"'))
        if faults:
            raise InputError(faults)

    def _read_column(self, name: str) -> _Column | str:
        """A column by its name, or the remedy for a name that is no key."""
        bare_name = name.removesuffix(_SD_SUFFIX)
        if name in _TEXT_COLUMNS:
            return _Column((name,), False)
        if bare_name in _SECTION_OF_KEY and (bare_name == name or bare_name != "prior"):
            return _Column((_SECTION_OF_KEY[bare_name], bare_name), bare_name != name)
        mode = _MODE_NAME.fullmatch(bare_name)
        if mode is None:
            return did_you_mean(bare_name, (*_TEXT_COLUMNS, *_SECTION_OF_KEY))
        label, setup_names = f"({mode['m']},{mode['n']})", self._setup_names
        setup = setup_names[0] if mode["setup"] is None and len(setup_names) == 1 else mode["setup"]
        if setup in setup_names:
            return _Column(("setup", setup, label), bare_name != name)
        if setup_names in ([], [""]):
            return f"the template has no setup of a name: write the label alone, {quote_text(label)}"
        return f"the setups of the template are {', '.join(map(quote_text, setup_names))}: write the name of one"

    def _lone_sd_faults(self) -> Iterator[Fault]:
        """A standard deviation without a value would be left out silently."""
        for i, (name, column) in enumerate(zip(self.names, self._columns, strict=True), start=1):
            if column is not None and column.is_sd and _Column(column.path, False) not in self._columns:
                wanted = f"a column {quote_text(name.removesuffix(_SD_SUFFIX))} beside it"
                remedy = "a value on the template has its standard deviation there"
                yield Fault(f"{self.file} column {i}", wanted, f"{quote_text(name)} alone", remedy)

    def _template_reading_faults(self) -> Iterator[Fault]:
        """Readings of the template would silently be those of every board."""
        column_paths = {column.path for column in self._columns if column is not None}
        uncovered: list[str] = []
        for setup in _setup_tables(self.template.table):
            of_setup = f" of setup {_setup_name(setup)}" if len(self._setup_names) > 1 else ""
            frequencies = setup.get("frequencies_hz")
            labels = [
                key
                for key in (frequencies if isinstance(frequencies, dict) else ())
                if _path(setup, key) not in column_paths
            ]
            uncovered += [f"{key}{of_setup}" for key in (*labels, *filter(setup.get, _UNLABELLED_KEYS))]
        if uncovered:
            wanted, remedy = "no reading that has no column in the table", "leave it off: every board would have it"
            yield Fault(f"{self.template.display_name} (the template)", wanted, ", ".join(uncovered), remedy)

    def name_of(self, row: Sequence[CellValue]) -> str:
        """The name of the board of a row, as it stands there."""
        position = self.names.index("name")
        return (_cell_text(row[position]) or "") if position < len(row) else ""

    def board(self, row: Sequence[CellValue]) -> Board:
        """The board of a row; raises InputError with every fault of the cells, or of the card that they would be.

        An empty cell leaves the template's value; a mode with an empty cell was not read.
        """
        values, faults = self._row_values(row)
        name = self.name_of(row)
        if not name:
            faults.append(Fault("name", "a name", "an empty cell"))
        if faults:
            raise InputError(faults)
        return Board.from_card(
            CardFile(_fill_template(self.template.table, values), f"{name}.toml", self.template.folder)
        )

    def _row_values(self, row: Sequence[CellValue]) -> tuple[dict[ColumnPath, Any], list[Fault]]:
        """The values of a row by the keys of a card, and the faults between its cells."""
        n = len(self.names)
        if not all(map(is_empty, row[n:])):
            remedy = "does a decimal comma divide a number into two cells? write a point"
            return {}, [Fault("cells", f"{n}, as the header has", str(len(row)), remedy)]
        cells = [*zip(self.names, self._columns, [*row[:n], *[None] * (n - len(row))], strict=True)]
        values: dict[ColumnPath, Any] = {}
        faults: list[Fault] = []
        for i, (_, column, cell) in enumerate(cells, start=1):
            if column is not None and not column.is_sd:
                values[column.path] = _cell_text(cell) if column.path[-1] in _TEXT_KEYS else _cell_value(cell)
            elif column is None and not is_empty(cell):
                faults.append(Fault(f"column {i}", "an empty cell, for the column has no name", quote_text(str(cell))))
        for name, column, cell in cells:
            if column is not None and column.is_sd and (sd := _cell_value(cell)) is not None:
                faults += _sd_faults(name, column, values[column.path])
                values[column.path] = {"mean": values[column.path], "sd": sd}
        return values, faults


def _sd_faults(name: str, column: _Column, value: Any) -> Iterator[Fault]:
    """A standard deviation beside nothing, or beside readings."""
    if value is None:
        is_mode = column.path[0] == "setup"
        remedy = "leave both empty where it was not read" if is_mode else "leave both to the template"
        yield Fault(
            quote_text(name.removesuffix(_SD_SUFFIX)), "a value beside its standard deviation", "an empty cell", remedy
        )
    elif isinstance(value, list):
        wanted, got = "readings, or a value and its standard deviation", "readings and a standard deviation"
        yield Fault(quote_text(name), wanted, got, "leave it empty: readings have a scatter of their own")


def is_empty(cell: CellValue) -> bool:
    """Whether a cell is empty."""
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _cell_text(cell: CellValue) -> str | None:
    """A cell of text as a card has it: 101 is a name, and so is 101.0, its form in a column with empty cells."""
    if is_empty(cell):
        return None
    return str(int(cell) if isinstance(cell, float) and cell.is_integer() else cell).strip()


def _cell_value(cell: CellValue) -> Any:
    """A cell as a card has it: a number, readings with semicolons between them, true or false, otherwise a text."""
    if not isinstance(cell, str):
        return cell
    text = cell.strip()
    if not text:
        return None
    if text.lower() in ("true", "false"):
        return text.lower() == "true"
    try:
        readings = [float(reading) for reading in text.split(";")]
    except ValueError:
        return text
    return text if "_" in text else readings[0] if len(readings) == 1 else readings


def _fill_template(template: Mapping[str, Any], values: Mapping[ColumnPath, Any]) -> dict[str, Any]:
    """The table of the template with the values of a row in it.

    None leaves the template's value, but a mode of None was not read; a setup without readings is left out, unless it
    is the only one.
    """
    table = copy.deepcopy({**template})
    plate, setups = table.get("plate"), table.get("setup")
    if isinstance(plate, dict) and any(values.get(("plate", key)) is not None for key in _MASS_KEYS):
        for key in _MASS_KEYS:
            plate.pop(key, None)
    for path, value in values.items():
        section = table if len(path) == 1 else table.setdefault(path[0], {})
        if path[0] == "setup":
            setup = next(setup for setup in _setup_tables(table) if _setup_name(setup) == path[1])
            section = setup.setdefault("frequencies_hz", {})
            for entries in (section, *(setup.get(key) for key in _LABEL_KEYS if value is None)):
                for key in [key for key in entries if _path(setup, key) == path] if isinstance(entries, dict) else ():
                    del entries[key]
        if value is not None and isinstance(section, dict):
            section[path[-1]] = value
    if isinstance(setups, list):
        read_setups = [
            setup for setup in setups if not isinstance(setup, dict) or setup.get("frequencies_hz", {}) != {}
        ]
        table["setup"] = read_setups or setups
    return table


def _setup_tables(table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The setups of a card, one or several."""
    setups = table.get("setup")
    return [entry for entry in (setups if isinstance(setups, list) else [setups]) if isinstance(entry, dict)]


def _setup_name(setup: Mapping[str, Any]) -> str:
    return str(setup.get("name", ""))


def _path(setup: Mapping[str, Any], label: str) -> ColumnPath:
    """The keys that lead to a mode, however its label is written there."""
    return "setup", _setup_name(setup), label.replace(" ", "")
