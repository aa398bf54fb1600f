"""The questions of `new` on the terminal, each of which may be skipped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import click

from bayesplate.errors import InputError

SIZES = {
    "length_x": "Length along the grain, mm",
    "length_y": "Length across the grain, mm",
    "thickness": "Thickness, mm",
    "mass": "Mass, g",
}


def asked_answers(path: str | None) -> dict[str, Any]:
    """Arguments of `bayesplate.new` from questions on the terminal, a path too where there is none.

    An empty answer leaves a matter open.
    """
    from bayesplate.commands.new import example_labels, require_edges, require_path

    if path is not None:
        require_path(path)  # before anything is asked in vain
    click.echo("An empty answer skips a question; an example stands in for it, marked on the card.", err=True)
    told: dict[str, Any] = {"path": path or _asked("Name", "my-board", require_path)}
    told["sizes"] = _answered({name: _number(question) for name, question in SIZES.items()})
    told["edges"] = _asked("Edges: free, cantilever, clamped, supported", "free", require_edges)
    told["prior"] = click.prompt("Wood: spruce, or weakly-informative", default="weakly-informative", err=True)
    click.echo("Frequencies; (m,n) crosses m nodal lines along the grain and n across.", err=True)
    told["frequencies"] = _answered({label: _number(f"{label}, Hz") for label in example_labels(told["edges"])})
    told["notes"] = click.prompt("Notes", default="", show_default=False, err=True)
    return told


def _asked(question: str, default: str, require: Callable[[str], object]) -> str:
    """An answer that can be used: it is asked again until it can."""

    def usable(text: str) -> str:
        try:
            require(text)
        except InputError as error:
            raise click.BadParameter(str(error)) from None
        return text

    return str(click.prompt(question, default=default, value_proc=usable, err=True))


def _number(question: str) -> str:
    return str(click.prompt(question, default="", show_default=False, value_proc=_number_or_nothing, err=True))


def _number_or_nothing(text: str) -> str:
    try:
        return text and str(float(text))
    except ValueError:
        raise click.BadParameter("a number with a decimal point, 2.8, or nothing") from None


def _answered(answers: Mapping[str, str]) -> dict[str, str]:
    return {name: answer for name, answer in answers.items() if answer}
