"""The campaign card: boards that were measured together, and what they share."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, TypeGuard, get_args

from pydantic import Field, PrivateAttr

from bayesplate.board.schema import BaseCard, Section, fault_place, validate_card
from bayesplate.board.shelf import CardFile, card_names
from bayesplate.board.toml import parse_toml, read_file
from bayesplate.board.values import (
    CardReference,
    Choice,
    Complaint,
    Key,
    Number,
    Refusal,
    Text,
    list_of_tables,
    read_effect,
    read_effects,
    read_items,
    read_list,
    read_reference,
)
from bayesplate.board.words import canonical_effect, quote_text
from bayesplate.errors import Fault, printable

FEWEST_BOARDS, MOST_BOARDS = 2, 200
MOST_SHARED = 10
SharingKind = Literal["value", "ratio"]


def _read_boards(value: object) -> tuple[str, ...]:
    """Names of board cards, or paths relative to this card."""
    boards = read_items(enumerate(read_list(value, "boards", MOST_BOARDS)), read_reference)
    if len(boards) < FEWEST_BOARDS:
        raise Refusal(Complaint("at least two boards", str(len(boards)), "bayesplate fit takes a single board's card"))
    repeated = [board for i, board in enumerate(boards) if board in boards[:i]]
    if repeated:
        raise Refusal(Complaint("each board once", f"{quote_text(repeated[0])} again"))
    return tuple(boards)


class SharedSection(Section):
    """An effect whose parameters all boards have in common: their values, or their ratios to the boards' moduli."""

    effect: Annotated[str, Key(read_effect)] = Field(description="the name of an effect")
    way: Annotated[SharingKind, Key(Choice(get_args(SharingKind)))] = Field(default="value", alias="as")
    scatter_percent: Annotated[float, Key(Number(0.1, 100, "%"))] = 0.0  # scale of the differences between boards


class PopulationSection(Section):
    """The distribution that the boards' constants share: its prior."""

    prior: CardReference = Field(description="a card of models/priors")


class CampaignCard(BaseCard):
    """Boards and what they share. `load_campaign` makes one."""

    source: Text = ""
    notes: Text = ""
    boards: Annotated[tuple[str, ...], Key(_read_boards)] = Field(description="a list of board cards")
    effects: Annotated[tuple[str, ...], Key(read_effects)] = ()
    shared: Annotated[tuple[SharedSection, ...], list_of_tables("[[shared]] tables", MOST_SHARED)] = ()
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
        """Name or path of a board of the campaign: a shipped card's name, or a path from this card's folder."""
        return self.path.parent / board if board.endswith(".toml") else board


def load_campaign(name_or_path: str | os.PathLike[str]) -> CampaignCard:
    """Read a campaign card, a shipped one by its name or a path; raises InputError with every fault at once."""
    return validate_card(CampaignCard, CardFile.load("campaigns", name_or_path), _repeated_effect_faults)


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
        return "boards" in parse_toml(read_file(Path(text)), printable(Path(text).name))
    except (ValueError, OSError):
        return False


def _repeated_effect_faults(table: Mapping[str, Any], file: str) -> list[Fault]:
    """Faults of effects that are shared more than once."""
    shared = table.get("shared")
    entries = shared if isinstance(shared, list) else []
    effects = [entry.get("effect") if isinstance(entry, dict) else None for entry in entries]
    names = [canonical_effect(name) if isinstance(name, str) else None for name in effects]
    return [
        Fault(fault_place(file, table, ("shared", i, "effect")), "each effect once", f"{quote_text(name)} again")
        for i, name in enumerate(names)
        if name is not None and name in names[:i]
    ]
