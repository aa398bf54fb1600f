"""A board as a row of a table: what is common stands on a card, the template, and each column is one of its keys."""

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
from bayesplate.board.words import did_you_mean, quoted
from bayesplate.errors import Fault, InputError

Cell = str | float | int | None
Inside = tuple[str, ...]
"""The keys that lead to a value; those of a mode are "setup", the name of the setup, and the label."""

_TEXTS = ("name", "title", "source", "notes")
_WORDS = (*_TEXTS, "prior")
"""Keys whose values are texts, also where a cell looks like a number."""
_SECTIONS = {key: section for section in ("plate", "material") for key in sections_of(BoardKeys)[(section,)]}
_WEIGHED = ("mass_g", "density_kg_m3")
_UNLABELLED = ("unlabelled_hz", "peaks")
_OF_LABELS = ("signs", "label_confidence")
_MODE = re.compile(r"(?:(?P<setup>[A-Za-z0-9._-]+) )?\((?P<m>\d{1,3}), ?(?P<n>\d{1,3})\)")
_SD = " sd"
_MOST_COLUMNS = 500


class _Column(NamedTuple):
    """Where the cells of a column go, and whether they are standard deviations."""

    inside: Inside
    is_sd: bool


class Columns:
    """The columns of a table as keys of a card; raises InputError with every column that is no key.

    A column is `name`, `title`, a key of [plate] or [material], or the label of a mode, "(1,1)" or "SETUP (1,1)", with
    " sd" behind it for the standard deviation. The template is the card of what is common to all boards; frequencies
    that it has must have a column.
    """

    def __init__(self, template: str | PathLike[str], names: Sequence[str], file: str) -> None:
        self.template, self.names, self.file = CardFile.load("boards", template), tuple(names), file
        self._setups = [_name_of(one) for one in _setups_of(self.template.table)]
        if len(names) > _MOST_COLUMNS:
            raise InputError(Fault(file, f"at most {_MOST_COLUMNS} columns", str(len(names))))
        faults: list[Fault] = []
        self._columns: list[_Column | None] = []
        for i, name in enumerate(names, start=1):
            column = self._column(name) if name else None
            if isinstance(column, str):
                wanted = "a key of a board card, or the label of a mode"
                faults.append(Fault(f"{file} column {i}", wanted, quoted(name), column))
                column = None
            elif column is not None and column in self._columns:
                first = names[self._columns.index(column)]
                got = quoted(name) + (" again" if first == name else f", which is {quoted(first)} again")
                faults.append(Fault(f"{file} column {i}", "each column once", got))
                column = None
            self._columns.append(column)
        faults += [*self._lone_sds(), *self._common_readings()]
        if "name" not in names:
            faults.append(Fault(file, "a column with the names of the boards", "none", 'call it "name"'))
        if faults:
            raise InputError(faults)

    def _column(self, name: str) -> _Column | str:
        """Where a column goes; otherwise what to do."""
        bare = name.removesuffix(_SD)
        if name in _TEXTS:
            return _Column((name,), False)
        if bare in _SECTIONS and (bare == name or bare != "prior"):
            return _Column((_SECTIONS[bare], bare), bare != name)
        mode = _MODE.fullmatch(bare)
        if mode is None:
            return did_you_mean(bare, (*_TEXTS, *_SECTIONS))
        label, known = f"({mode['m']},{mode['n']})", self._setups
        setup = known[0] if mode["setup"] is None and len(known) == 1 else mode["setup"]
        if setup in known:
            return _Column(("setup", setup, label), bare != name)
        if known in ([], [""]):
            return f"the template has no setup of a name: write the label alone, {quoted(label)}"
        return f"the setups of the template are {', '.join(map(quoted, known))}: write the name of one"

    def _lone_sds(self) -> Iterator[Fault]:
        """A standard deviation without a value would be left out silently."""
        for i, (name, column) in enumerate(zip(self.names, self._columns, strict=True), start=1):
            if column is not None and column.is_sd and _Column(column.inside, False) not in self._columns:
                wanted = f"a column {quoted(name.removesuffix(_SD))} beside it"
                remedy = "a value on the template has its standard deviation there"
                yield Fault(f"{self.file} column {i}", wanted, f"{quoted(name)} alone", remedy)

    def _common_readings(self) -> Iterator[Fault]:
        """Readings of the template would silently be those of every board."""
        own = {column.inside for column in self._columns if column is not None}
        stray: list[str] = []
        for setup in _setups_of(self.template.table):
            told = f" of setup {_name_of(setup)}" if len(self._setups) > 1 else ""
            read = setup.get("frequencies_hz")
            labels = [key for key in (read if isinstance(read, dict) else ()) if _inside(setup, key) not in own]
            stray += [f"{key}{told}" for key in (*labels, *filter(setup.get, _UNLABELLED))]
        if stray:
            wanted, remedy = "no reading that has no column in the table", "leave it off: every board would have it"
            yield Fault(f"{self.template.shown} (the template)", wanted, ", ".join(stray), remedy)

    def name_of(self, row: Sequence[Cell]) -> str:
        """The name of the board of a row, as it stands there."""
        at = self.names.index("name")
        return (_word(row[at]) or "") if at < len(row) else ""

    def board(self, row: Sequence[Cell]) -> Board:
        """The board of a row; raises InputError with every fault of the cells, or of the card that they would be.

        Empty cells say nothing: the template's entry stays, but a mode was not read.
        """
        values, faults = self._values(row)
        name = self.name_of(row)
        if not name:
            faults.append(Fault("name", "a name", "an empty cell"))
        if faults:
            raise InputError(faults)
        return Board.from_card(CardFile(_filled(self.template.table, values), f"{name}.toml", self.template.folder))

    def _values(self, row: Sequence[Cell]) -> tuple[dict[Inside, Any], list[Fault]]:
        """What a row says by the keys of a card, and what is wrong with its cells beside one another."""
        n = len(self.names)
        if not all(map(is_empty, row[n:])):
            remedy = "does a decimal comma divide a number into two cells? write a point"
            return {}, [Fault("cells", f"{n}, as the header has", str(len(row)), remedy)]
        cells = [*zip(self.names, self._columns, [*row[:n], *[None] * (n - len(row))], strict=True)]
        values: dict[Inside, Any] = {}
        faults: list[Fault] = []
        for i, (_, column, cell) in enumerate(cells, start=1):
            if column is not None and not column.is_sd:
                values[column.inside] = _word(cell) if column.inside[-1] in _WORDS else _value(cell)
            elif column is None and not is_empty(cell):
                faults.append(Fault(f"column {i}", "an empty cell, for the column has no name", quoted(str(cell))))
        for name, column, cell in cells:
            if column is not None and column.is_sd and (sd := _value(cell)) is not None:
                faults += _sd_faults(name, column, values[column.inside])
                values[column.inside] = {"mean": values[column.inside], "sd": sd}
        return values, faults


def _sd_faults(name: str, column: _Column, of: Any) -> Iterator[Fault]:
    """A standard deviation beside nothing, or beside readings."""
    if of is None:
        is_mode = column.inside[0] == "setup"
        remedy = "leave both empty where it was not read" if is_mode else "leave both to the template"
        yield Fault(quoted(name.removesuffix(_SD)), "a value beside its standard deviation", "an empty cell", remedy)
    elif isinstance(of, list):
        wanted, got = "readings, or a value and its standard deviation", "readings and a standard deviation"
        yield Fault(quoted(name), wanted, got, "leave it empty: readings have a scatter of their own")


def is_empty(cell: Cell) -> bool:
    """Whether a cell says nothing."""
    return cell is None or (isinstance(cell, str) and not cell.strip())


def _word(cell: Cell) -> str | None:
    """A cell of text as a card has it: 101 is a name, and so is 101.0 where a column of numbers lost one."""
    if is_empty(cell):
        return None
    return str(int(cell) if isinstance(cell, float) and cell.is_integer() else cell).strip()


def _value(cell: Cell) -> Any:
    """A cell as a card has it: a number, several with semicolons between them as readings, otherwise a text."""
    if not isinstance(cell, str):
        return cell
    stripped = cell.strip()
    if not stripped:
        return None
    try:
        parts = [float(part) for part in stripped.split(";")]
    except ValueError:
        return stripped
    return stripped if "_" in stripped else parts[0] if len(parts) == 1 else parts


def _filled(template: Mapping[str, Any], values: Mapping[Inside, Any]) -> dict[str, Any]:
    """The table of the template with the values of a row in it.

    None leaves what is there, but a mode was not read then; a setup of which nothing was read is left out, unless it is
    the only one.
    """
    table = copy.deepcopy({**template})
    plate, setups = table.get("plate"), table.get("setup")
    if isinstance(plate, dict) and any(values.get(("plate", key)) is not None for key in _WEIGHED):
        for key in _WEIGHED:
            plate.pop(key, None)
    for inside, value in values.items():
        section = table if len(inside) == 1 else table.setdefault(inside[0], {})
        if inside[0] == "setup":
            setup = next(one for one in _setups_of(table) if _name_of(one) == inside[1])
            section = setup.setdefault("frequencies_hz", {})
            for about in (section, *(setup.get(key) for key in _OF_LABELS if value is None)):
                for key in [key for key in about if _inside(setup, key) == inside] if isinstance(about, dict) else ():
                    del about[key]
        if value is not None and isinstance(section, dict):
            section[inside[-1]] = value
    if isinstance(setups, list):
        read = [one for one in setups if not isinstance(one, dict) or one.get("frequencies_hz", {}) != {}]
        table["setup"] = read or setups
    return table


def _setups_of(table: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The setups of a card, one or several."""
    setups = table.get("setup")
    return [one for one in (setups if isinstance(setups, list) else [setups]) if isinstance(one, dict)]


def _name_of(setup: Mapping[str, Any]) -> str:
    return str(setup.get("name", ""))


def _inside(setup: Mapping[str, Any], label: str) -> Inside:
    """The keys that lead to a mode, however its label is written there."""
    return "setup", _name_of(setup), label.replace(" ", "")
