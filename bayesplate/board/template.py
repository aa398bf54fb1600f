"""The template of a table: the card of what is common to all boards, and what a row puts into it."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from bayesplate.board.card_file import CardFile

_WEIGHED = ("mass_g", "density_kg_m3")
_UNLABELLED = ("unlabelled_hz", "peaks")
_OF_LABELS = ("signs", "label_confidence")
Inside = tuple[str, ...]
"""The keys that lead to a value; those of a mode are "setup", the name of the setup, and the label."""


class Template:
    """The card of what is common to all boards of a table.

    Parameters
    ----------
    card : str or path
        Name of a shipped board card, or a path; it need not have frequencies, and those that it has must have a column.

    Raises
    ------
    InputError
        If it cannot be read as a table.
    """

    def __init__(self, card: str | Path) -> None:
        self.card = CardFile.load("boards", card)
        self.file, self.content = self.card.shown, self.card.table
        self.setups = [_name_of(one) for one in _setups_of(self.content)]

    def readings(self) -> Iterator[tuple[str, tuple[str, ...]]]:
        """What was read according to the template: in words, and the keys that lead there."""
        for setup in _setups_of(self.content):
            name, told = _name_of(setup), f" of setup {_name_of(setup)}" if len(self.setups) > 1 else ""
            frequencies = setup.get("frequencies_hz")
            for label in frequencies if isinstance(frequencies, dict) else ():
                yield f"{label}{told}", ("setup", name, _bare(label))
            for key in _UNLABELLED:
                if setup.get(key):
                    yield f"{key}{told}", ("setup", name, key)

    def filled(self, values: Mapping[Inside, Any]) -> dict[str, Any]:
        """The content with the values of a row in it.

        Parameters
        ----------
        values : dict
            By the keys that lead there. None leaves what is there, but a mode was not read then; a setup of which
            nothing was read is left out, unless it is the only one.
        """
        content = copy.deepcopy({**self.content})
        plate = content.get("plate")
        if isinstance(plate, dict) and any(values.get(("plate", key)) is not None for key in _WEIGHED):
            for key in _WEIGHED:
                plate.pop(key, None)
        for inside, value in values.items():
            _put(content, inside, value)
        setups = content.get("setup")
        if isinstance(setups, list):
            read = [one for one in setups if not isinstance(one, dict) or one.get("frequencies_hz", {}) != {}]
            content["setup"] = read or setups
        return content


def _setups_of(content: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The setups of a card, one or several."""
    setups = content.get("setup")
    return [one for one in (setups if isinstance(setups, list) else [setups]) if isinstance(one, dict)]


def _name_of(setup: Mapping[str, Any]) -> str:
    return str(setup.get("name", ""))


def _put(content: dict[str, Any], inside: Inside, value: Any) -> None:
    """One value at its place."""
    if inside[0] == "setup":
        setup, key = next(one for one in _setups_of(content) if _name_of(one) == inside[1]), inside[2]
        section = setup.setdefault("frequencies_hz", {})
        _leave_out(section, key)
        for about in _OF_LABELS if value is None else ():
            _leave_out(setup.get(about), key)
    elif len(inside) == 2:
        section, key = content.setdefault(inside[0], {}), inside[1]
    else:
        section, key = content, inside[0]
    if value is not None and isinstance(section, dict):
        section[key] = value


def _leave_out(section: Any, label: str) -> None:
    """Take a label out of a table of labels, however it is written there."""
    if isinstance(section, dict):
        for key in [key for key in section if _bare(key) == label]:
            del section[key]


def _bare(label: str) -> str:
    return label.replace(" ", "")
