"""A board as a row of a table: what is common stands on a card, the template, and each column is one of its keys."""

from __future__ import annotations

import copy
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayesplate.cards.board import BoardCard, MaterialSection, PlateSection, read_board_text
from bayesplate.cards.reading import read_file, read_table
from bayesplate.cards.shelf import find
from bayesplate.cards.words import did_you_mean, quoted
from bayesplate.cards.writing import array, number, table, text, whole
from bayesplate.errors import Fault, InputError, plain

Cell = str | float | int | None

_TEXTS = ("name", "title", "source", "notes")
_SECTIONS = {
    **dict.fromkeys(PlateSection.model_fields, "plate"),
    **dict.fromkeys(MaterialSection.model_fields, "material"),
}
_WEIGHED = ("mass_g", "density_kg_m3")
_MODE = re.compile(r"(?:(?P<setup>[A-Za-z0-9._-]+) )?\((?P<m>\d{1,3}), ?(?P<n>\d{1,3})\)")
_SD = " sd"
_BARE = re.compile(r"[A-Za-z0-9_-]+")
_MOST_COLUMNS = 500


@dataclass(frozen=True)
class _Place:
    """Where the cells of a column go: the keys that lead there, and whether they are standard deviations."""

    inside: tuple[str, ...]
    is_sd: bool


class Template:
    """The card of what is common to all boards of a table.

    Parameters
    ----------
    card : str or path
        Name of a shipped board card, or a path; it need not have frequencies.

    Raises
    ------
    InputError
        If it cannot be read as a table.
    """

    def __init__(self, card: str | Path) -> None:
        self.path = find("boards", card)
        self.content = read_table(read_file(self.path), plain(self.path.name))
        setups = self.content.get("setup")
        listed = setups if isinstance(setups, list) else [setups]
        self.setups = [str(one.get("name", "")) for one in listed if isinstance(one, dict)]


class Columns:
    """The columns of a table as keys of a card.

    Parameters
    ----------
    template : Template
    names : sequence of str
        The header of the table: `name`, `title`, a key of [plate] or [material], or the label of a mode as "(1,1)",
        after the name of its setup where there are several; with " sd" behind it the standard deviation of that column.
    file : str
        The table, as messages show it.

    Raises
    ------
    InputError
        With every column that is no key.
    """

    def __init__(self, template: Template, names: Sequence[str], file: str) -> None:
        self.template, self.names, self.file = template, tuple(names), file
        if len(names) > _MOST_COLUMNS:
            raise InputError(Fault(file, f"at most {_MOST_COLUMNS} columns", str(len(names))))
        faults = [
            Fault(f"{file} column {i}", "each column once", f"{quoted(name)} again")
            for i, name in enumerate(names, start=1)
            if name in names[: i - 1]
        ]
        self._places: list[_Place] = []
        for i, name in enumerate(names, start=1):
            place = self._place(name)
            if isinstance(place, _Place):
                self._places.append(place)
            else:
                wanted = "a key of a board card, or the label of a mode"
                faults.append(Fault(f"{file} column {i}", wanted, quoted(name), place))
        if "name" not in names:
            faults.append(Fault(file, "a column with the names of the boards", "none", 'call it "name"'))
        if faults:
            raise InputError(faults)

    def _place(self, name: str) -> _Place | str:
        """Where a column goes; otherwise what to do."""
        bare = name.removesuffix(_SD)
        if name in _TEXTS:
            return _Place((name,), False)
        if bare in _SECTIONS and (bare == name or bare != "prior"):
            return _Place((_SECTIONS[bare], bare), bare != name)
        mode = _MODE.fullmatch(bare)
        if mode is None:
            return did_you_mean(bare, (*_TEXTS, *_SECTIONS))
        label = f"({mode['m']},{mode['n']})"
        setup = mode["setup"]
        if setup is None and len(self.template.setups) == 1:
            return _Place(("setup", self.template.setups[0], label), bare != name)
        if setup in self.template.setups:
            return _Place(("setup", setup, label), bare != name)
        return f"the setups of the template are {', '.join(map(quoted, self.template.setups))}: write the name of one"

    def name_of(self, row: Sequence[Cell]) -> str:
        """The name of the board of a row, as it stands there."""
        at = self.names.index("name")
        return "" if at >= len(row) or row[at] is None else str(row[at]).strip()

    def card(self, row: Sequence[Cell], number: int) -> BoardCard:
        """The card of a row.

        Parameters
        ----------
        row : sequence of str, number or None
            Empty cells say nothing: the template's entry stays, but a mode was not read.
        number : int
            Of the row, the first below the header being 1.

        Raises
        ------
        InputError
            With every fault of the card that it would be.
        """
        place = f"{self.file} row {number}"
        if len(row) > len(self.names):
            raise InputError(Fault(place, f"{len(self.names)} cells, as the header has", str(len(row))))
        name = self.name_of(row)
        if not name:
            raise InputError(Fault(place, "a name", "an empty cell"))
        try:
            return read_board_text(_card_text(self._filled(row)), name, beside=self.template.path.parent)
        except InputError as error:
            faults = [Fault(f"{place} -> {one.place}", one.wanted, one.got, one.remedy) for one in error.faults]
            raise InputError(faults) from None

    def _filled(self, row: Sequence[Cell]) -> dict[str, Any]:
        """The template with the cells of a row in it."""
        content = copy.deepcopy(self.template.content)
        padded = [*row, *[None] * (len(self.names) - len(row))]
        cells = {place: _value(cell) for place, cell in zip(self._places, padded, strict=True)}
        plate = content.get("plate")
        weighed = [key for key in _WEIGHED if cells.get(_Place(("plate", key), False)) is not None]
        if weighed and isinstance(plate, dict):
            for key in _WEIGHED:
                plate.pop(key, None)
        for place, value in cells.items():
            if not place.is_sd:
                _put(content, place.inside, value, cells.get(_Place(place.inside, True)))
        return content


def _put(content: dict[str, Any], inside: Sequence[str], value: Any, sd: Any) -> None:
    """One cell at its place, with its standard deviation if there is one."""
    if inside[0] == "setup":
        setups = content["setup"]
        of_setup = [setups] if isinstance(setups, dict) else setups
        setup = next(one for one in of_setup if isinstance(one, dict) and str(one.get("name", "")) == inside[1])
        section, key = setup.setdefault("frequencies_hz", {}), inside[2]
        if isinstance(section, dict):
            section.pop(key, None)
    elif len(inside) == 2:
        section, key = content.setdefault(inside[0], {}), inside[1]
    else:
        section, key = content, inside[0]
    if value is not None and isinstance(section, dict):
        section[key] = value if sd is None else {"mean": value, "sd": sd}


def _value(cell: Cell) -> Any:
    """A cell as a card has it: a number, several with semicolons between them as readings, otherwise a text."""
    if not isinstance(cell, str):
        return cell
    stripped = cell.strip()
    if not stripped:
        return None
    parts = [_number(part) for part in stripped.split(";")]
    if any(part is None for part in parts):
        return stripped
    return parts[0] if len(parts) == 1 else parts


def _number(part: str) -> float | None:
    try:
        return float(part)
    except ValueError:
        return None


def _card_text(content: Mapping[str, Any]) -> str:
    """A card as TOML, one line for each of its keys."""
    return "".join(f"{_key(key)} = {_toml(value)}\n" for key, value in content.items())


def _key(key: str) -> str:
    return key if _BARE.fullmatch(key) else text(key)


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int):
        return whole(value)
    if isinstance(value, float):
        return number(value)
    if isinstance(value, Mapping):
        return table({_key(key): _toml(one) for key, one in value.items()})
    if isinstance(value, list | tuple):
        return array([_toml(one) for one in value])
    return text(value if isinstance(value, str) else str(value))


def csv_rows(data: bytes, file: str) -> Iterator[list[str]]:
    """The rows of a CSV file in UTF-8, the header first; raises InputError where it is no such text."""
    import csv
    import io

    try:
        stream = io.StringIO(data.decode("utf-8-sig"), newline="")
    except UnicodeDecodeError as error:
        got = f"the byte 0x{data[error.start]:02x} at offset {error.start}"
        raise InputError(Fault(file, "UTF-8 text", got, "save the file as UTF-8")) from None
    try:
        yield from (row for row in csv.reader(stream, strict=True) if row)
    except csv.Error as error:
        raise InputError(Fault(file, "a CSV table, commas between its cells", plain(str(error)))) from None
