"""Files of cards, by their path or by their name on the shelf of shipped cards, and the tables in them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

from bayesplate.board.toml import parse_toml, read_file
from bayesplate.board.words import did_you_mean, quote_text, show_value
from bayesplate.board.writing import toml_text
from bayesplate.errors import Fault, InputError, printable

CardKind = Literal["boards", "priors", "coefficients", "campaigns"]
_SINGULAR = {"boards": "board", "priors": "prior", "coefficients": "coefficient", "campaigns": "campaign"}
CAMPAIGN_REMEDY = "check, fit, diagnose and plan take it"
_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED_SHELF = _PACKAGE / "models"
_CHECKOUT_SHELF = _PACKAGE.parent / "models"


def shelf_folder(kind: CardKind) -> Path:
    """The folder of the shipped cards of one kind, in the package or the checkout; InputError if there is none."""
    for shelf in (_INSTALLED_SHELF, _CHECKOUT_SHELF):
        if (shelf / kind).is_dir():
            return shelf / kind
    folders = f"neither {_INSTALLED_SHELF / kind} nor {_CHECKOUT_SHELF / kind}"
    raise InputError(Fault("shelf of cards", f"the folder models/{kind}", folders, "install bayesplate again"))


def card_names(kind: CardKind) -> tuple[str, ...]:
    """Names of the shipped cards of one kind, in alphabetical order."""
    return tuple(sorted(path.stem for path in shelf_folder(kind).glob("*.toml")))


def find_card(kind: CardKind, name_or_path: str | os.PathLike[str], folder: Path | None = None) -> Path:
    """The file of a card: a path, from `folder`, if it looks like one, otherwise a name on the shelf.

    Raises InputError if a name is not on the shelf, with the nearest card and how to write a path.
    """
    if not isinstance(name_or_path, str | os.PathLike):
        raise InputError(Fault(f"{_SINGULAR[kind]} card", "a name or a path", show_value(name_or_path)))
    text = os.fspath(name_or_path)
    if isinstance(name_or_path, os.PathLike) or text.endswith(".toml") or any(mark in text for mark in "/\\"):
        return Path(text) if folder is None else Path(os.path.normpath(folder / text))  # which may still be to be made
    names = card_names(kind)
    if text in names:
        return shelf_folder(kind) / f"{text}.toml"
    wanted = f"the name of a {_SINGULAR[kind]} card, or a path that ends in .toml"
    got = f"no card of that name in {shelf_folder(kind)}"
    local_file = Path(f"{text}.toml")
    is_possible = "\0" not in text and len(text) < 200
    if kind == "boards" and text in card_names("campaigns"):
        remedy = f"it is a campaign: {CAMPAIGN_REMEDY}"
    elif is_possible and local_file.is_file():
        remedy = f"there is a file here: write {quote_text(str(local_file))}"
    elif is_possible and Path(text).suffix and Path(text).is_file():
        remedy = "a card is a TOML file; bayesplate new writes a first one, for the frequencies to be put in"
    else:
        remedy = did_you_mean(text, names) or f"a card in {printable(os.getcwd())} is given as a path"
    raise InputError(Fault(quote_text(text), wanted, got, remedy))


@dataclass(frozen=True)
class CardFile:
    """The table of a card, read from a file or made in Python."""

    table: Mapping[str, Any]
    name: str
    folder: Path | None = None  # from which the relative paths on the card start
    read: str = ""  # the text of the file; empty for a table made in Python

    @classmethod
    def load(cls, kind: CardKind, name_or_path: str | os.PathLike[str], folder: Path | None = None) -> CardFile:
        """A card of the shelf by its name, or of a path; raises InputError if it is no table."""
        path = find_card(kind, name_or_path, folder)
        return cls.of(read_file(path), path.name, path.parent)

    @classmethod
    def of(cls, content: bytes | str, name: str, folder: Path | None = None) -> CardFile:
        """A card from the content of a file; raises InputError if it is no table."""
        if not isinstance(content, bytes | str):
            raise InputError(Fault(printable(name), "the text of a card", show_value(content)))
        data = content if isinstance(content, bytes) else content.encode("utf-8", "surrogatepass")
        return cls(parse_toml(data, printable(name)), name, folder, data.decode("utf-8"))

    @property
    def display_name(self) -> str:
        """The name of the file as messages show it."""
        return printable(self.name)

    @property
    def stem(self) -> str:
        """The name that the card must have."""
        return os.path.splitext(self.name)[0]

    @property
    def path(self) -> Path:
        return (self.folder or Path()) / self.name

    @cached_property
    def text(self) -> str:
        """The text of the file as it was read, or the table as TOML; `sha256` is that of its bytes in UTF-8."""
        return self.read or toml_text(self.table)

    @cached_property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes."""
        return sha256(self.text.encode("utf-8")).hexdigest()
