"""The questions of `new` on the terminal, each of which may be skipped."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import click

from bayesplate.errors import InputError

SIZE_QUESTIONS = {
    "length_x": "Length along the grain, mm",
    "length_y": "Length across the grain, mm",
    "thickness": "Thickness, mm",
    "mass": "Mass, g",
}


def ask_card_arguments(path: str | None) -> dict[str, Any]:
    """Arguments of `bayesplate.new` from questions on the terminal, a path too where there is none.

    An empty answer leaves the argument out.
    """
    from bayesplate.commands.new import example_labels, require_edges, require_path, require_prior

    if path is not None:
        require_path(path)  # before anything is asked in vain
    click.echo("An empty answer skips a question; an example stands in for it, marked on the card.", err=True)
    answers: dict[str, Any] = {"path": path or _ask("Name", "my-board", require_path)}
    answers["sizes"] = _without_blanks({name: _ask_number(question) for name, question in SIZE_QUESTIONS.items()})
    answers["edges"] = _ask("Edges: free, cantilever, clamped, supported", "free", require_edges)
    answers["prior"] = _ask(
        "Wood: spruce, or weakly-informative",
        "weakly-informative",
        lambda prior: require_prior(prior, answers["path"]),
    )
    click.echo("Frequencies; (m,n) crosses m nodal lines along the grain and n across.", err=True)
    answers["frequencies"] = _without_blanks(
        {label: _ask_number(f"{label}, Hz") for label in example_labels(answers["edges"])}
    )
    answers["notes"] = click.prompt("Notes", default="", show_default=False, err=True)
    return answers


def _ask(question: str, default: str, require: Callable[[str], object]) -> str:
    """Ask a question until its answer can be used."""

    def read_answer(text: str) -> str:
        try:
            require(text)
        except InputError as error:
            raise click.BadParameter(str(error)) from None
        return text

    return str(click.prompt(question, default=default, value_proc=read_answer, err=True))


def _ask_number(question: str) -> str:
    return str(click.prompt(question, default="", show_default=False, value_proc=_read_number, err=True))


def _read_number(text: str) -> str:
    try:
        number = float(text) if text else 0.0
        if not math.isfinite(number):
            raise ValueError
        return text and str(number)
    except ValueError:
        raise click.BadParameter("a number with a decimal point, 2.8, or nothing") from None


def _without_blanks(answers: Mapping[str, str]) -> dict[str, str]:
    return {name: answer for name, answer in answers.items() if answer}
