"""`cite`: the references of exactly what a fit of a card uses."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Annotated

from bayesplate.commands.arguments import checked
from bayesplate.commands.options import CARD, Effects
from bayesplate.commands.prepare import Card
from bayesplate.commands.problem import Problem, as_problem
from bayesplate.results.references import Section, references

_WIDTH = 80


@checked()
def cite(card: Annotated[Problem | Card, CARD], *, effects: Effects = None) -> tuple[Section, ...]:
    """References of a fit, by section.

    Parameters
    ----------
    card : Problem, str, path or Board
        A problem, the name of a shipped board card, the path of a card, or a board made in Python.
    effects : sequence of str, optional
        Declared effects in place of the card's.

    Returns
    -------
    tuple of Section

    Raises
    ------
    InputError
        As `fit` would.
    """
    prepared = as_problem(card, effects=effects).prepared
    return references(prepared.card, prepared.prior, prepared.board)


def cite_text(sections: Sequence[Section]) -> str:
    """The references as plain text: a heading a section, an indented paragraph a reference."""
    parts = []
    for section in sections:
        entries = [fill(e, _WIDTH, initial_indent="- ", subsequent_indent="  ") for e in section.entries]
        parts.append("\n".join([section.title, *entries]))
    return "\n\n".join(parts) + "\n"
