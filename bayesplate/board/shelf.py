"""Where cards stand: a path if it looks like one, otherwise the shelf of cards that comes with the package."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Literal

from bayesplate.board.words import did_you_mean, quoted
from bayesplate.errors import Fault, InputError, plain

CardKind = Literal["boards", "priors", "coefficients", "campaigns"]
_SINGULAR = {"boards": "board", "priors": "prior", "coefficients": "coefficient", "campaigns": "campaign"}
CAMPAIGN_REMEDY = "check, fit, diagnose and plan take it"
_PACKAGE = Path(__file__).resolve().parents[1]
_INSTALLED = _PACKAGE / "models"
_CHECKOUT = _PACKAGE.parent / "models"


def shelf_folder(kind: CardKind) -> Path:
    """The folder of the shipped cards of one kind, in the package or the checkout; InputError if there is none."""
    for shelf in (_INSTALLED, _CHECKOUT):
        if (shelf / kind).is_dir():
            return shelf / kind
    both = f"neither {_INSTALLED / kind} nor {_CHECKOUT / kind}"
    raise InputError(Fault("shelf of cards", f"the folder models/{kind}", both, "install bayesplate again"))


def card_names(kind: CardKind) -> tuple[str, ...]:
    """Names of the shipped cards of one kind, in alphabetical order."""
    return tuple(sorted(path.stem for path in shelf_folder(kind).glob("*.toml")))


def find(kind: CardKind, name_or_path: str | os.PathLike[str], beside: Path | None = None) -> Path:
    """The file of a card: a path, from the folder `beside`, if it looks like one, otherwise a name on the shelf.

    Raises InputError if a name is not on the shelf, with the nearest card and how to write a path.
    """
    text = os.fspath(name_or_path)
    if isinstance(name_or_path, os.PathLike) or text.endswith(".toml") or any(mark in text for mark in "/\\"):
        return Path(text) if beside is None else beside / text
    names = card_names(kind)
    if text in names:
        return shelf_folder(kind) / f"{text}.toml"
    wanted = f"the name of a {_SINGULAR[kind]} card, or a path that ends in .toml"
    got = f"no card of that name in {shelf_folder(kind)}"
    here = Path(f"{text}.toml")
    is_possible = "\0" not in text and len(text) < 200
    if kind == "boards" and text in card_names("campaigns"):
        remedy = f"it is a campaign: {CAMPAIGN_REMEDY}"
    elif is_possible and here.is_file():
        remedy = f"there is a file here: write {quoted(str(here))}"
    elif is_possible and Path(text).suffix and Path(text).is_file():
        remedy = "a card is a TOML file; bayesplate new writes a first one, for the frequencies to be put in"
    else:
        remedy = did_you_mean(text, names) or f"a card in {plain(os.getcwd())} is given as a path"
    raise InputError(Fault(quoted(text), wanted, got, remedy))
