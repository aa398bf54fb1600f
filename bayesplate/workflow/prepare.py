"""From the name of a card to a board in SI units, with every fault of the input reported at once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.cards import BoardCard, PriorCard, load_board, load_named, physical_faults, remarks
from bayesplate.effects import declare, effect_faults, implied_effects, notes
from bayesplate.errors import InputError
from bayesplate.estimates.coefficients import coefficient_faults, require_sides
from bayesplate.estimates.plausibility import unit_faults
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
        return self.card.text


def prepare(
    card: str | os.PathLike[str], effects: Sequence[str] | None = None, *, may_lack_frequencies: bool = False
) -> Prepared:
    """Read a board card and everything it names.

    Parameters
    ----------
    card : str or path
        Name of a shipped card, or a path.
    effects : sequence of str, optional
        Declared effects in place of the card's.
    may_lack_frequencies : bool
        Whether a board that was not measured yet will do.

    Returns
    -------
    Prepared

    Raises
    ------
    InputError
        Every schema fault at once; if there is none, every physical fault at once; if there is none, what all
        frequencies together say of their unit.
    NotIdentifiableError
        If the sides are those of the printed table that the card names, exchanged.
    """
    read = load_board(card, may_lack_frequencies=may_lack_frequencies)
    named = load_named(read)
    board = board_from_card(read, named.prior, named.tables)
    listed = (*board.effects, *implied_effects(board)) if effects is None else effects
    board = replace(board, effects=tuple(dict.fromkeys(listed)))
    faults = [*physical_faults(read), *named.faults, *label_faults(board), *effect_faults(board)]
    if not faults:
        require_sides(board)
    faults += coefficient_faults(board)
    if named.prior is not None and not faults:
        faults = unit_faults(board, named.prior, np.random.default_rng(0))
    if faults or named.prior is None:
        raise InputError(faults)
    told = (*board.notes, *remarks(read, board.effects), *notes(board))
    return Prepared(read, named.prior, declare(replace(board, notes=told)))
