"""From a card, or a board made in Python, to a board in SI units, with every fault of the input reported at once."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bayesplate.board.board import Board, assumed_notes
from bayesplate.board.campaign import is_campaign
from bayesplate.board.checks import physical_faults, remarks
from bayesplate.board.named import NamedCards, load_named
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.sessions import notes as session_notes
from bayesplate.board.shelf import CardFile, find
from bayesplate.board.words import effect_named
from bayesplate.effects import declare, effect_faults, implied_effects, notes
from bayesplate.errors import Fault, InputError
from bayesplate.estimates.coefficients import coefficient_faults, require_sides
from bayesplate.estimates.plausibility import require_plausible
from bayesplate.frequencies.labels import label_faults

Card = str | os.PathLike[str] | Board
"""Name of a shipped card, the path of a card, or a board made in Python."""


@dataclass(frozen=True)
class Prepared:
    """A board as its card states it, the cards that it names, and the board with its declared effects' parameters."""

    named: NamedCards
    card: Board
    board: Board

    @property
    def prior(self) -> PriorCard:
        assert self.named.prior is not None
        return self.named.prior

    def with_effects(self, effects: Sequence[str]) -> Prepared:
        """The same cards, not read again, with other declared effects; raises InputError as `prepare`."""
        return prepared_card(self.card, self.named, effects)


def default_folder(card: str | os.PathLike[str]) -> Path:
    """Where the command line writes the results of a card unless it is told: results/NAME."""
    return Path("results") / find("campaigns" if is_campaign(card) else "boards", card).stem


def prepare(
    card: Card,
    effects: Sequence[str] | None = None,
    *,
    prior: str | os.PathLike[str] | PriorCard | None = None,
    may_lack_frequencies: bool = False,
    setup: str | os.PathLike[str] | None = None,
) -> Prepared:
    """Read a board card and everything it names; raises InputError with every schema fault, else every physical one.

    Else with what all frequencies together say of their unit; NotIdentifiableError if sides or orders seem exchanged. A
    board made in Python goes through its own card: what would be refused there is refused here, with the same places.
    """
    _require_card(card)
    given = prior if prior is None or isinstance(prior, PriorCard) else load_prior(prior)
    if not isinstance(card, Board):
        read = Board.from_toml(card, may_lack_frequencies=may_lack_frequencies, setup=setup)
        return prepared_card(read, load_named(read, given), effects)
    read = Board.from_card(CardFile(card.table(), f"{card.name}.toml", card.folder), may_lack_frequencies, setup)
    found = {one.name: one.published_coefficients for one in card.setups if one.published_coefficients is not None}
    prepared = prepared_card(read, load_named(read, given, found), effects)
    lost = list(_lost(card, prepared.board)) if setup is None else []
    if lost:
        raise InputError(lost)
    return prepared


def _require_card(card: object) -> None:
    """Refuse what other functions take for a card."""
    if not isinstance(card, Board | str | os.PathLike):
        remedy = {"Problem": "it is one: use it as it is", "Campaign": "its boards are in its problems"}
        kind = type(card).__name__
        raise InputError(Fault("card", "a board: a name, a path or a Board", f"a {kind}", remedy.get(kind, "")))


def prepared_card(read: Board, named: NamedCards, effects: Sequence[str] | None = None) -> Prepared:
    """Prepare cards that were read already: no file is looked at; raises as `prepare`."""
    stated = read.assuming(named.prior, named.tables)
    implied = implied_effects(stated)
    listed = (*stated.effects, *implied) if effects is None else map(effect_named, effects)
    declared = tuple(dict.fromkeys(listed))
    board = replace(stated, effects=declared, implies=bool(declared) or (stated.implies and not implied))
    faults = [*physical_faults(stated), *named.faults, *label_faults(board), *effect_faults(board)]
    if not faults:
        require_sides(board)
    faults += coefficient_faults(board)
    if faults or named.prior is None:
        raise InputError(faults)
    require_plausible(board, named.prior, np.random.default_rng(0))
    told = (*assumed_notes(board), *remarks(board, board.effects), *notes(board), *session_notes(board))
    return Prepared(named, stated, declare(replace(board, notes=told)))


def _lost(given: Board, prepared: Board) -> Iterator[Fault]:
    """Faults of effects whose priors or forms a card cannot state: they must not be dropped silently."""
    again = prepared.inputs
    remedy = "a card states an effect by its name, and the effect's own prior holds: vary Problem.board, which has none"
    for one in given.parameters:
        if one.is_of_effect and one.name in again and one.prior != again[one.name]:
            yield Fault(f"{given.name} {one.name}", "the prior of a declared effect", "another one", remedy)
    if given.chosen:
        forms = ", ".join(one.name for one in given.chosen)
        yield Fault(f"{given.name} chosen", "effects in the form that a card gives them", f"other forms of {forms}")
