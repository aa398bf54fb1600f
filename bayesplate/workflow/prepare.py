"""From the name of a card to a board in SI units, with every fault of the input reported at once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bayesplate.cards import BoardCard, PriorCard, load_board, load_prior, physical_faults
from bayesplate.errors import Fault, InputError
from bayesplate.frequencies.labels import label_faults
from bayesplate.plate.board import Board, board_from_card


@dataclass(frozen=True)
class Prepared:
    """A card, its prior, and the board they describe."""

    card: BoardCard
    prior: PriorCard
    board: Board

    @property
    def card_text(self) -> str:
        """The card as it was read."""
        return "" if self.card.path is None else self.card.path.read_text(encoding="utf-8-sig")


def prepare(card: str | os.PathLike[str], effects: Sequence[str] | None = None) -> Prepared:
    """Read a board card and everything it names.

    Parameters
    ----------
    card : str or path
        Name of a shipped card, or a path.
    effects : sequence of str, optional
        Declared effects in place of the card's.

    Returns
    -------
    Prepared

    Raises
    ------
    InputError
        Every schema fault at once; if there is none, every physical fault at once.
    """
    read = load_board(card)
    faults = physical_faults(read)
    if faults and _prior_is_at_fault(read):
        raise InputError(faults)
    prior = load_prior(read.material.prior, read.path.parent if read.path else None)
    board = board_from_card(read, prior)
    if effects is not None:
        board = replace(board, effects=tuple(effects))
    faults += label_faults(board)
    if board.effects:
        faults.append(
            Fault(
                f"{board.name}.toml effects",
                "no declared effects: this version fits the bare plate",
                ", ".join(board.effects),
                "--effects none",
            )
        )
    if faults:
        raise InputError(faults)
    return Prepared(read, prior, board)


def _prior_is_at_fault(card: BoardCard) -> bool:
    try:
        load_prior(card.material.prior, card.path.parent if card.path else None)
    except InputError:
        return True
    return False
