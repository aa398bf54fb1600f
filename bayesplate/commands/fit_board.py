"""`fit_board`: a board, a prior and a request to the summary of its fit; pure, so that any process may compute it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, get_args

from bayesplate.board.board import Board
from bayesplate.board.coefficients import CoefficientCard
from bayesplate.board.named import NamedCards, symmetry_fault
from bayesplate.board.prior import PriorCard
from bayesplate.board.values import Key, read_entries
from bayesplate.commands.arguments import (
    check_arguments,
    effects_reader,
    instance_reader,
    integer_reader,
    read_bool,
    refusal_of,
    word_reader,
)
from bayesplate.commands.fit import fit
from bayesplate.commands.fitting import compute_fit
from bayesplate.commands.prepare import prepare, prepare_card
from bayesplate.commands.problem import Problem
from bayesplate.errors import Fault
from bayesplate.frequencies.laws import LawName
from bayesplate.results.summary import Summary


@dataclass(frozen=True)
class FitRequest:
    """Options of a fit, besides its board and its prior.

    Attributes
    ----------
    seed : int
        Everything random follows from it.
    effects : tuple of str or None
        Declared effects in place of the card's.
    law : "linear", "exact" or None
        None: the linear law where it is good enough.
    robust : bool
        Student's distribution for the noise.
    tables : dict of CoefficientCard
        The published coefficients that the setups of a card name, by setup.
    """

    seed: int = 1
    effects: tuple[str, ...] | None = None
    law: LawName | None = None
    robust: bool = False
    tables: Mapping[str, CoefficientCard] = field(default_factory=dict)


_REQUEST_READERS = {
    "seed": integer_reader(0),
    "effects": effects_reader("effects"),
    "law": word_reader(*get_args(LawName), None),
    "robust": read_bool,
}


def _read_request(value: object) -> object:
    """A FitRequest, whose entries are read as the arguments of that name are."""
    if value is not None and not all(hasattr(value, key) for key in _REQUEST_READERS):
        raise refusal_of("a FitRequest", value)
    if value is not None:
        read_entries({key: getattr(value, key) for key in _REQUEST_READERS}, _REQUEST_READERS)
    return value


@check_arguments()
def fit_board(
    board: Annotated[Board, Key(instance_reader(Board))],
    prior: Annotated[PriorCard, Key(instance_reader(PriorCard))],
    request: Annotated[FitRequest | None, Key(_read_request)] = None,
) -> Summary:
    """Fit one board; nothing is read, written or remembered, and the same arguments give the same bytes anywhere.

    Parameters
    ----------
    board : Board
        Made in Python, or read from a card.
    prior : PriorCard
        Of its constants.
    request : FitRequest, optional

    Returns
    -------
    Summary
        That of `fit` with the same seed.

    Raises
    ------
    InputError, NotIdentifiableError, NotConvergedError
        As of `fit`.
    """
    request = FitRequest() if request is None else request
    return compute_fit(_problem(board, prior, request), request.seed).summary


def fit_board_into(folder: Path, report: bool, board: Board, prior: PriorCard, request: FitRequest) -> Summary:
    """`fit_board` with the files of a fit in a folder, in place of those that are there."""
    result = fit(_problem(board, prior, request), out=folder, report=report, seed=request.seed, force=True)
    return result.summary  # type: ignore[return-value]  # a problem is no campaign


def _problem(board: Board, prior: PriorCard, request: FitRequest) -> Problem:
    if board.card is None or board != Board.from_card(board.card):
        return Problem(prepare(board, request.effects, prior=prior), request.law, request.robust)
    faults = tuple(
        Fault(
            f"request tables {setup.name}",
            "the published coefficients that the card names",
            "none",
            f'tables={{"{setup.name}": ...}} of the FitRequest',
        )
        for setup in board.setups
        if setup.table_name and setup.name not in request.tables
    )
    own_prior = prior.for_board(board.isotropic)
    if own_prior is None:
        faults += (symmetry_fault(f"{board.file} [material] prior", prior.name, board.isotropic),)
    named_cards = NamedCards(own_prior, request.tables, faults)
    return Problem(prepare_card(board, named_cards, request.effects), request.law, request.robust)
