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
    """What a board card names, each read once; a relative path starts from the folder of the board card."""

    prior: PriorCard | None  # None if it cannot be read
    tables: Mapping[str, CoefficientCard]  # by setup, as far as they can be read
    faults: tuple[Fault, ...]  # of the others, with the place where each was named


def load_named(
    board: Board, prior: PriorCard | None = None, tables: Mapping[str, CoefficientCard] | None = None
) -> NamedCards:
    """Read every card that a board card names and that is not given; tables are by setup."""
    file, beside = board.file, board.folder
    faults: list[Fault] = []
    where = f"{file} [material] prior"
    if prior is None:
        prior = _read(load_prior, board.prior, beside, where, faults)
    if prior is not None:
        name, prior = prior.name, prior.for_board(board.isotropic)
        faults += [] if prior is not None else [_of_another_symmetry(where, name, board.isotropic)]
    if tables is not None:
        return NamedCards(prior, tables, tuple(faults))
    found: dict[str, CoefficientCard] = {}
    for setup, where in zip(board.setups, setup_places(file, [setup.name for setup in board.setups]), strict=True):
        if setup.table_name:
            place = f"{where} published_coefficients"
            table = _read(load_coefficients, setup.table_name, beside, place, faults)
            found |= {} if table is None else {setup.name: table}
    return NamedCards(prior, found, tuple(faults))


def _of_another_symmetry(place: str, name: str, is_isotropic: bool) -> Fault:
    """The fault of a prior that states one modulus for a board of three, or three for a board of one."""
    if not is_isotropic:
        return Fault(place, "a prior of three constants", f"{name}, which states E alone", "or isotropic = true?")
    remedy = "weakly-informative states one, or a card of your own with [E]"
    return Fault(place, "a prior of E, because isotropic = true", f"{name}, which states none", remedy)


def _read(
    load: Callable[[str, Path | None], Card], name: str, beside: Path | None, place: str, faults: list[Fault]
) -> Card | None:
    """Read one card; its faults join the others."""
    try:
        return load(name, beside)
    except InputError as error:
        faults += [Fault(f"{place} -> {one.place}", one.wanted, one.got, one.remedy) for one in error.faults]
        return None
