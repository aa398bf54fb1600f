"""The campaign card: boards that were measured together, and what they share."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeGuard, get_args

from pydantic import Field, PrivateAttr

from bayesplate.board.schema import Card, Section, place, validated
from bayesplate.board.shelf import CardFile, card_names
from bayesplate.board.toml import read_file, read_table
from bayesplate.board.values import (
    Choice,
    Complaint,
    Key,
    Number,
    Reference,
    Refusal,
    Text,
    one_or_more,
    read_each,
    read_effect,
    read_effects,
    read_list,
    read_reference,
)
from bayesplate.board.words import effect_named, quoted
from bayesplate.errors import Fault, plain

FEWEST_BOARDS, MOST_BOARDS = 2, 200
MOST_SHARED = 10
Way = Literal["value", "ratio"]


def _read_boards(value: object) -> tuple[str, ...]:
    """Names of board cards, or paths relative to this card."""
    boards = read_each(enumerate(read_list(value, "boards", MOST_BOARDS)), read_reference)
    if len(boards) < FEWEST_BOARDS:
        raise Refusal(Complaint("at least two boards", str(len(boards)), "bayesplate fit takes a single board's card"))
    twice = [board for i, board in enumerate(boards) if board in boards[:i]]
    if twice:
        raise Refusal(Complaint("each board once", f"{quoted(twice[0])} again"))
    return tuple(boards)


class SharedSection(Section):
    """An effect whose parameters all boards have in common: their values, or their ratios to the boards' moduli."""

    effect: Annotated[str, Key(read_effect)] = Field(description="the name of an effect")
    way: Annotated[Way, Key(Choice(get_args(Way)))] = Field(default="value", alias="as")
    scatter_percent: Annotated[float, Key(Number(0.1, 100, "%"))] = 0.0  # scale by which a board's own may differ


class PopulationSection(Section):
    """That the boards' constants share a distribution, and what is believed of it before measuring."""

    prior: Reference = Field(description="a card of models/priors")


class CampaignCard(Card):
    """Boards and what they share. `load_campaign` makes one."""

    source: Text = ""
    notes: Text = ""
    boards: Annotated[tuple[str, ...], Key(_read_boards)] = Field(description="a list of board cards")
    effects: Annotated[tuple[str, ...], Key(read_effects)] = ()
    shared: Annotated[tuple[SharedSection, ...], one_or_more("[[shared]] tables", MOST_SHARED)] = ()
    population: PopulationSection | None = None
    _card: CardFile = PrivateAttr()

    def model_post_init(self, context: Any) -> None:
        """Keep where the card comes from."""
        self._card = context["card"]

    @property
    def path(self) -> Path:
        """The card's file."""
        return self._card.path

    @property
    def sha256(self) -> str:
        """Hexadecimal SHA-256 of the file's bytes."""
        return self._card.sha256

    @property
    def text(self) -> str:
        """The file as it was read."""
        return self._card.text

    def board_path(self, board: str) -> str | Path:
        """What finds a board of the campaign: a shipped card's name, or a path from this card's folder."""
        return self.path.parent / board if board.endswith(".toml") else board


def load_campaign(name_or_path: str | os.PathLike[str]) -> CampaignCard:
    """Read a campaign card, a shipped one by its name or a path; raises InputError with every fault at once."""
    return validated(CampaignCard, CardFile.load("campaigns", name_or_path), _twice)


def is_campaign(name_or_path: object) -> TypeGuard[str | os.PathLike[str]]:
    """Whether it is the name of a campaign, or a card that lists boards; a file that cannot be read is none."""
    if not isinstance(name_or_path, str | os.PathLike):
        return False
    text = os.fspath(name_or_path)
    if text in card_names("campaigns"):
        return text not in card_names("boards")
    if not (isinstance(name_or_path, os.PathLike) or text.endswith(".toml") or any(mark in text for mark in "/\\")):
        return False
    try:
        return "boards" in read_table(read_file(Path(text)), plain(Path(text).name))
    except (ValueError, OSError):
        return False


def _twice(table: Mapping[str, Any], file: str) -> list[Fault]:
    """An effect is shared once, in one way."""
    shared = table.get("shared")
    entries = shared if isinstance(shared, list) else []
    effects = [entry.get("effect") if isinstance(entry, dict) else None for entry in entries]
    names = [effect_named(name) if isinstance(name, str) else None for name in effects]
    return [
        Fault(place(file, table, ("shared", i, "effect")), "each effect once", f"{quoted(name)} again")
        for i, name in enumerate(names)
        if name is not None and name in names[:i]
    ]
