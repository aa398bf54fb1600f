"""From a card, or a board made in Python, to a board in SI units, with every fault of the input reported at once."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesplate.board.board import Board, poisson_notes
from bayesplate.board.campaign import is_campaign
from bayesplate.board.checks import board_remarks, physical_faults
from bayesplate.board.named import NamedCards, load_named_cards
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.sessions import session_notes
from bayesplate.board.shelf import CardFile, find_card
from bayesplate.board.words import canonical_effect
from bayesplate.effects import declare, effect_faults, implied_effects, notes
from bayesplate.errors import Fault, InputError
from bayesplate.estimates.coefficients import coefficient_faults, require_sides
from bayesplate.estimates.plausibility import require_plausible
from bayesplate.frequencies.labels import label_faults

CardSource = str | os.PathLike[str] | Board
"""Name of a shipped card, the path of a card, or a board made in Python."""


@dataclass(frozen=True)
class PreparedBoard:
    """A board as its card states it, the cards that it names, and the board with its declared effects' parameters."""

    named: NamedCards
    card: Board
    board: Board

    @property
    def prior(self) -> PriorCard:
        assert self.named.prior is not None
        return self.named.prior

    def with_effects(self, effects: Sequence[str]) -> PreparedBoard:
        """The same cards, not read again, with other declared effects; raises InputError as `prepare`."""
        return prepare_card(self.card, self.named, effects)


def default_folder(card: str | os.PathLike[str]) -> Path:
    """Default folder of the results of a card on the command line: results/NAME."""
    return Path("results") / find_card("campaigns" if is_campaign(card) else "boards", card).stem


def prepare(
    card: CardSource,
    effects: Sequence[str] | None = None,
    *,
    prior: str | os.PathLike[str] | PriorCard | None = None,
    may_lack_frequencies: bool = False,
    setup: str | os.PathLike[str] | None = None,
) -> PreparedBoard:
    """Read a board card and everything it names; raises InputError with every schema fault, else every physical one.

    Else with what all frequencies together say of their unit; NotIdentifiableError if sides or orders seem exchanged. A
    board made in Python goes through its own card: what would be refused there is refused here, with the same places.
    """
    _require_card(card)
    prior_card = prior if prior is None or isinstance(prior, PriorCard) else load_prior(prior)
    if not isinstance(card, Board):
        stated_board = Board.from_toml(card, may_lack_frequencies=may_lack_frequencies, setup=setup)
        return prepare_card(stated_board, load_named_cards(stated_board, prior_card), effects)
    stated_board = Board.from_card(
        CardFile(card.table(), f"{card.name}.toml", card.folder), may_lack_frequencies, setup
    )
    tables = {
        card_setup.name: card_setup.published_coefficients
        for card_setup in card.setups
        if card_setup.published_coefficients is not None
    }
    prepared = prepare_card(stated_board, load_named_cards(stated_board, prior_card, tables), effects)
    faults = list(_unstated_effects(card, prepared.board)) if setup is None else []
    if faults:
        raise InputError(faults)
    return prepared


def _require_card(card: object) -> None:
    """Refuse a Problem or a Campaign, which other functions take for a card, and anything else."""
    if not isinstance(card, Board | str | os.PathLike):
        remedy = {"Problem": "it is one: use it as it is", "Campaign": "its boards are in its problems"}
        kind = type(card).__name__
        raise InputError(Fault("card", "a board: a name, a path or a Board", f"a {kind}", remedy.get(kind, "")))


def prepare_card(read: Board, named: NamedCards, effects: Sequence[str] | None = None) -> PreparedBoard:
    """Prepare cards that were read already: no file is looked at; raises as `prepare`."""
    stated_board = read.assuming(named.prior, named.tables)
    implied = implied_effects(stated_board)
    names = (*stated_board.effects, *implied) if effects is None else map(canonical_effect, effects)
    declared = tuple(dict.fromkeys(names))
    board = replace(
        stated_board,
        effects=declared,
        has_implied_effects=bool(declared) or (stated_board.has_implied_effects and not implied),
    )
    faults = [*physical_faults(stated_board), *named.faults, *label_faults(board), *effect_faults(board)]
    if not faults:
        require_sides(board)
    faults += coefficient_faults(board)
    if faults or named.prior is None:
        raise InputError(faults)
    require_plausible(board, named.prior, np.random.default_rng(0))
    board_notes = (*poisson_notes(board), *board_remarks(board, board.effects), *notes(board), *session_notes(board))
    return PreparedBoard(named, stated_board, declare(replace(board, notes=board_notes)))


def _unstated_effects(board: Board, prepared: Board) -> Iterator[Fault]:
    """Faults of effects whose priors or forms a card cannot state: they must not be dropped silently."""
    card_inputs = prepared.inputs
    remedy = "a card states an effect by its name, and the effect's own prior holds: vary Problem.board, which has none"
    for parameter in board.parameters:
        if parameter.is_of_effect and parameter.name in card_inputs and parameter.prior != card_inputs[parameter.name]:
            yield Fault(f"{board.name} {parameter.name}", "the prior of a declared effect", "another one", remedy)
    if board.effect_forms:
        forms = ", ".join(effect.name for effect in board.effect_forms)
        yield Fault(
            f"{board.name} effect_forms", "effects in the form that a card gives them", f"other forms of {forms}"
        )
