"""A board as a row of a table: what is common stands on a card, the template, and each column is one of its keys."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from bayesplate.board.board import Board
from bayesplate.board.board_keys import BoardKeys
from bayesplate.board.card_file import CardFile
from bayesplate.board.cells import Cell, is_empty, value, word
from bayesplate.board.schema import sections_of
from bayesplate.board.template import Inside, Template
from bayesplate.board.words import did_you_mean, quoted
from bayesplate.errors import Fault, InputError

_TEXTS = ("name", "title", "source", "notes")
_WORDS = (*_TEXTS, "prior")
"""Keys whose values are texts, also where a cell looks like a number."""
_SECTIONS = {key: section for section in ("plate", "material") for key in sections_of(BoardKeys)[(section,)]}
_MODE = re.compile(r"(?:(?P<setup>[A-Za-z0-9._-]+) )?\((?P<m>\d{1,3}), ?(?P<n>\d{1,3})\)")
_SD = " sd"
_MOST_COLUMNS = 500


@dataclass(frozen=True)
class _Place:
    """Where the cells of a column go: the keys that lead there, and whether they are standard deviations."""

    inside: Inside
    is_sd: bool

    @property
    def value(self) -> _Place:
        """Where the values go whose standard deviations these are."""
        return _Place(self.inside, False)


class Columns:
    """The columns of a table as keys of a card.

    Parameters
    ----------
    template : Template
    names : sequence of str
        The header of the table: `name`, `title`, a key of [plate] or [material], or the label of a mode as "(1,1)",
        after the name of its setup where there are several; with " sd" behind it the standard deviation of that column.
        A column without a name is none, and its cells are empty.
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
        faults: list[Fault] = []
        self._places: list[_Place | None] = []
        for i, name in enumerate(names, start=1):
            place = self._place(name) if name else None
            if isinstance(place, str):
                wanted = "a key of a board card, or the label of a mode"
                faults.append(Fault(f"{file} column {i}", wanted, quoted(name), place))
                place = None
            elif place is not None and place in self._places:
                first = names[self._places.index(place)]
                got = quoted(name) + (" again" if first == name else f", which is {quoted(first)} again")
                faults.append(Fault(f"{file} column {i}", "each column once", got))
                place = None
            self._places.append(place)
        faults += [*self._lone_sds(), *self._common_readings()]
        if "name" not in names:
            faults.append(Fault(file, "a column with the names of the boards", "none", 'call it "name"'))
        if faults:
            raise InputError(faults)

    def _lone_sds(self) -> Iterator[Fault]:
        """A standard deviation without a value would be left out silently."""
        for i, place in enumerate(self._places, start=1):
            if place is not None and place.is_sd and place.value not in self._places:
                wanted = f"a column {quoted(self.names[i - 1].removesuffix(_SD))} beside it"
                remedy = "a value on the template has its standard deviation there"
                yield Fault(f"{self.file} column {i}", wanted, f"{quoted(self.names[i - 1])} alone", remedy)

    def _common_readings(self) -> Iterator[Fault]:
        """What the template has read would silently be read on every board."""
        own = {place.inside for place in self._places if place is not None}
        stray = [words for words, inside in self.template.readings() if inside not in own]
        if stray:
            wanted, remedy = "no reading that has no column in the table", "leave it off: every board would have it"
            yield Fault(f"{self.template.file} (the template)", wanted, ", ".join(stray), remedy)

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
        if setup is not None and setup in self.template.setups:
            return _Place(("setup", setup, label), bare != name)
        if self.template.setups in ([], [""]):
            return f"the template has no setup of a name: write the label alone, {quoted(label)}"
        return f"the setups of the template are {', '.join(map(quoted, self.template.setups))}: write the name of one"

    def name_of(self, row: Sequence[Cell]) -> str:
        """The name of the board of a row, as it stands there."""
        at = self.names.index("name")
        return (word(row[at]) or "") if at < len(row) else ""

    def board(self, row: Sequence[Cell]) -> Board:
        """The board of a row.

        Parameters
        ----------
        row : sequence of str, number or None
            Empty cells say nothing: the template's entry stays, but a mode was not read.

        Raises
        ------
        InputError
            With every fault of the cells, or of the card that they would be.
        """
        values, faults = self._values(row)
        name = self.name_of(row)
        if not name:
            faults.append(Fault("name", "a name", "an empty cell"))
        if faults:
            raise InputError(faults)
        card = CardFile(self.template.filled(values), f"{name}.toml", self.template.card.folder)
        return Board.from_card(card)

    def _values(self, row: Sequence[Cell]) -> tuple[dict[Inside, Any], list[Fault]]:
        """What a row says by the keys of a card, and what is wrong with its cells beside one another."""
        n = len(self.names)
        if any(not is_empty(cell) for cell in row[n:]):
            remedy = "does a decimal comma divide a number into two cells? write a point"
            return {}, [Fault("cells", f"{n}, as the header has", str(len(row)), remedy)]
        padded = [*row[:n], *[None] * (n - len(row))]
        values: dict[Inside, Any] = {}
        faults: list[Fault] = []
        for i, (place, cell) in enumerate(zip(self._places, padded, strict=True), start=1):
            if place is not None and not place.is_sd:
                values[place.inside] = word(cell) if place.inside[-1] in _WORDS else value(cell)
            elif place is None and not is_empty(cell):
                faults.append(Fault(f"column {i}", "an empty cell, for the column has no name", quoted(str(cell))))
        for name, place, cell in zip(self.names, self._places, padded, strict=True):
            if place is not None and place.is_sd and (sd := value(cell)) is not None:
                faults += _sd_faults(name, place, values[place.inside])
                values[place.inside] = {"mean": values[place.inside], "sd": sd}
        return values, faults


def _sd_faults(name: str, place: _Place, of: Any) -> Iterator[Fault]:
    """A standard deviation beside nothing, or beside readings."""
    if of is None:
        is_mode = place.inside[0] == "setup"
        remedy = "leave both empty where it was not read" if is_mode else "leave both to the template"
        yield Fault(quoted(name.removesuffix(_SD)), "a value beside its standard deviation", "an empty cell", remedy)
    elif isinstance(of, list):
        wanted, got = "readings, or a value and its standard deviation", "readings and a standard deviation"
        yield Fault(quoted(name), wanted, got, "leave it empty: readings have a scatter of their own")
