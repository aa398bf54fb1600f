"""`cite`: the references of exactly what a fit of a card uses."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Annotated

from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.options import CARD, Effects
from bayesplate.commands.prepare import CardSource
from bayesplate.commands.problem import Problem, as_problem
from bayesplate.results.references import ReferenceSection, references

_WIDTH = 80


@check_arguments()
def cite(card: Annotated[Problem | CardSource, CARD], *, effects: Effects = None) -> tuple[ReferenceSection, ...]:
    """References of a fit, by section.

    Parameters
    ----------
    card : Problem, str, path or Board
        A problem, the name of a shipped board card, the path of a card, or a board made in Python.
    effects : sequence of str, optional
        Declared effects in place of the card's.

    Returns
    -------
    tuple of ReferenceSection

    Raises
    ------
    InputError
        As `fit` would.
    """
    prepared = as_problem(card, effects=effects).prepared
    return references(prepared.card, prepared.prior, prepared.board)


def cite_text(sections: Sequence[ReferenceSection]) -> str:
    """The references as plain text: a heading a section, an indented paragraph a reference."""
    blocks = []
    for section in sections:
        entries = [fill(entry, _WIDTH, initial_indent="- ", subsequent_indent="  ") for entry in section.entries]
        blocks.append("\n".join([section.title, *entries]))
    return "\n\n".join(blocks) + "\n"
