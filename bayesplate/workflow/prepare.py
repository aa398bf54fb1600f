"""From the name of a card to a board in SI units, with every fault of the input reported at once."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.cards import (
    BoardCard,
    PriorCard,
    load_board,
    load_coefficients,
    load_prior,
    physical_faults,
    remarks,
)
from bayesplate.effects import declare, effect_faults, implied_effects
from bayesplate.effects.attached_mass import ROUGH_ROVING, heaviest_roving
from bayesplate.errors import Fault, InputError, NotIdentifiableError
from bayesplate.estimates.coefficients import aspect_ratio_of
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
        return "" if self.card.path is None else self.card.path.read_text(encoding="utf-8-sig")


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
    faults = physical_faults(read)
    if faults and _prior_is_at_fault(read):
        raise InputError(faults)
    prior = load_prior(read.material.prior, read.path.parent if read.path else None)
    board = board_from_card(read, prior)
    listed = (*board.effects, *implied_effects(board)) if effects is None else effects
    board = replace(board, effects=tuple(dict.fromkeys(listed)))
    faults += [*label_faults(board), *effect_faults(board)]
    faults = faults or unit_faults(board, prior, np.random.default_rng(0))
    if faults:
        raise InputError(faults)
    _refuse_exchanged(read, board)
    notes = (*board.notes, *remarks(read, board.effects), *_unused_profiles(board), *_roving(board))
    return Prepared(read, prior, declare(replace(board, notes=notes)))


_SAME_RATIO = 0.02


def _refuse_exchanged(card: BoardCard, board: Board) -> None:
    """Refuse a board that has the aspect ratio of its printed table only with its sides exchanged."""
    nominal = board.nominal()
    exchanged = {**nominal, "length_x": nominal["length_y"], "length_y": nominal["length_x"]}
    for section, setup in zip(card.setups, board.setups, strict=True):
        if section.published_coefficients is None:
            continue
        table = load_coefficients(section.published_coefficients, card.path.parent if card.path else None)
        ratio, other = (aspect_ratio_of(values, setup) / table.aspect_ratio for values in (nominal, exchanged))
        if abs(other - 1.0) < _SAME_RATIO < abs(ratio - 1.0):
            place = f"{board.name}.toml setup '{setup.name}' published_coefficients"
            wanted = f"the aspect ratio L_x / L_y of {table.name}, {table.aspect_ratio:.3g}"
            remedy = "are length_x_mm and length_y_mm exchanged? x is along the grain"
            raise NotIdentifiableError(Fault(place, wanted, f"{ratio * table.aspect_ratio:.3g}", remedy))


def _unused_profiles(board: Board) -> list[str]:
    """Readings at several places of which only the mean is used."""
    profiled = {"thickness": "thickness_profile", "length_y": "outline_profile"}
    return [
        f"the {name} was read at several places: its mean is used, the {effect} is not part of this model"
        for name, effect in profiled.items()
        if board.inputs[name].has_profile and effect not in board.effects
    ]


def _roving(board: Board) -> list[str]:
    """Things that roved and are heavy enough for the mean over their places to be rough."""
    if "attached_mass" not in board.effects:
        return []
    return [
        f"what roved in setup '{setup.name}' weighs {100.0 * share:.1f} % of the board: the mean over its places is "
        f"right to first order in the mass only and may err by some cents; a setup for each place is exact"
        for setup in board.setups
        if (share := heaviest_roving(board, setup)) > ROUGH_ROVING
    ]


def _prior_is_at_fault(card: BoardCard) -> bool:
    try:
        load_prior(card.material.prior, card.path.parent if card.path else None)
    except InputError:
        return True
    return False
