"""The cards that a board card names: its prior, and the coefficient table of each setup that names one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from bayesplate.board.board import Board
from bayesplate.board.coefficients import CoefficientCard, load_coefficients
from bayesplate.board.prior import PriorCard, load_prior
from bayesplate.board.words import setup_places
from bayesplate.errors import Fault, InputError

Card = TypeVar("Card", PriorCard, CoefficientCard)


@dataclass(frozen=True)
class NamedCards:
    """The cards that a board card names, each read once; a relative path starts from the folder of the board card."""

    prior: PriorCard | None  # None if it cannot be read
    tables: Mapping[str, CoefficientCard]  # by setup, as far as they can be read
    faults: tuple[Fault, ...]  # of cards that cannot be read, with the place on the board card


def load_named_cards(
    board: Board, prior: PriorCard | None = None, tables: Mapping[str, CoefficientCard] | None = None
) -> NamedCards:
    """Read the cards that a board card names, except those that are passed; tables are by setup."""
    file, folder = board.file, board.folder
    faults: list[Fault] = []
    card_place = f"{file} [material] prior"
    if prior is None:
        prior = _read_card(load_prior, board.prior, folder, card_place, faults)
    if prior is not None:
        name, prior = prior.name, prior.for_board(board.isotropic)
        faults += [] if prior is not None else [symmetry_fault(card_place, name, board.isotropic)]
    coefficient_tables = dict(tables or {})
    for setup, card_place in zip(board.setups, setup_places(file, [setup.name for setup in board.setups]), strict=True):
        if setup.table_name and setup.name not in coefficient_tables:
            place = f"{card_place} published_coefficients"
            table = _read_card(load_coefficients, setup.table_name, folder, place, faults)
            coefficient_tables |= {} if table is None else {setup.name: table}
    return NamedCards(prior, coefficient_tables, tuple(faults))


def symmetry_fault(place: str, name: str, is_isotropic: bool) -> Fault:
    """The fault of an isotropic prior for an orthotropic board, or of an orthotropic prior for an isotropic board."""
    if not is_isotropic:
        return Fault(place, "a prior of three constants", f"{name}, which states E alone", "or isotropic = true?")
    remedy = "weakly-informative states one, or a card of your own with [E]"
    return Fault(place, "a prior of E, because isotropic = true", f"{name}, which states none", remedy)


def _read_card(
    load: Callable[[str, Path | None], Card], name: str, folder: Path | None, place: str, faults: list[Fault]
) -> Card | None:
    """Read one card; its faults are added to `faults`."""
    try:
        return load(name, folder)
    except InputError as error:
        faults += [Fault(f"{place} -> {fault.place}", fault.wanted, fault.got, fault.remedy) for fault in error.faults]
        return None
