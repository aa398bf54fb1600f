"""`new`: a first card, from a few numbers; what is written can be read, and nothing is ever overwritten."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import click

from bayesplate.board.board import Board
from bayesplate.board.checks import physical_faults
from bayesplate.board.named import load_named_cards
from bayesplate.board.prior import load_prior
from bayesplate.board.setup_keys import EdgeCondition, edge_words
from bayesplate.board.shelf import CardFile
from bayesplate.board.starter import HALF_TOP, starter_text
from bayesplate.board.values import Complaint, Key, Number, Refusal
from bayesplate.board.words import EDGES, did_you_mean, name_complaint, show_value
from bayesplate.commands.arguments import check_arguments
from bayesplate.commands.options import ANY_PATH, FilePath, Option, OptionGroup
from bayesplate.errors import Fault, InputError, printable
from bayesplate.files import catch_write_errors, write_text
from bayesplate.frequencies.labels import label_faults, lowest_labels
from bayesplate.labels import Label

_EDGES_WANTED = (
    '"free", "cantilever", "clamped", "supported", or four letters of C, S and F for x0, y0, x1, y1, like "CFFF"'
)
_ARRANGEMENTS = {"cantilever": "CFFF"}
_ANY_NUMBER = Number(-1e300, 1e300)
_N_EXAMPLES = 8
SIZES = (*HALF_TOP, "mass")


def _read_text(value: object) -> object:
    if not isinstance(value, str):
        raise Refusal(Complaint("a text", repr(value)))
    return value


def _read_numbers(value: object) -> object:
    if not isinstance(value, Mapping | None):
        raise Refusal(Complaint("a dict of numbers", repr(value)))
    return value


def _frequencies_from_text(context: click.Context, option: click.Parameter, texts: tuple[str, ...]) -> dict[str, str]:
    """Frequencies "LABEL=HZ" by their label."""
    frequencies = {}
    for text in texts:
        label, sign, hertz = text.rpartition("=")
        if not sign:
            raise click.UsageError(f'--frequency {text!r}: write a label and its frequency, "(1,1)=35".')
        if label.strip() in frequencies:
            raise click.UsageError(f"--frequency: {label.strip()} is given twice.")
        frequencies[label.strip()] = hertz.strip()
    return frequencies


def _sizes_from_options(**sizes: str | None) -> dict[str, str]:
    return {name: size for name, size in sizes.items() if size}


_TEXT_KEY, _NUMBERS_KEY = Key(_read_text), Key(_read_numbers)
_EDGES_HELP = "free, cantilever, clamped, supported, or letters like CFFF."
_PRIOR_HELP = "Prior card, spruce or weakly-informative."
_SIZE_OPTIONS = OptionGroup(
    _sizes_from_options,
    length_x=Option("--length-x", metavar="MM", help="Length along the grain."),
    length_y=Option("--length-y", metavar="MM", help="Length across the grain."),
    thickness=Option("--thickness", metavar="MM"),
    mass=Option("--mass", metavar="G"),
)
_FREQUENCY_OPTION = Option(
    "--frequency",
    multiple=True,
    callback=_frequencies_from_text,
    metavar="LABEL=HZ",
    help='As often as there are modes: "(1,1)=35".',
)


@check_arguments()
def new(
    path: Annotated[FilePath, ANY_PATH, Option("path", required=False)],
    *,
    sizes: Annotated[Mapping[str, float | str] | None, _NUMBERS_KEY, _SIZE_OPTIONS] = None,
    edges: Annotated[str, _TEXT_KEY, Option("--edges", metavar="WORD", help=_EDGES_HELP)] = "free",
    prior: Annotated[str, _TEXT_KEY, Option("--prior", metavar="NAME", help=_PRIOR_HELP)] = "weakly-informative",
    title: Annotated[str, _TEXT_KEY, Option("--title", help="A line for people.")] = "",
    notes: Annotated[str, _TEXT_KEY, Option("--notes", help="Free text.")] = "",
    frequencies: Annotated[Mapping[str, float | str] | None, _NUMBERS_KEY, _FREQUENCY_OPTION] = None,
) -> Path:
    """Write a first card.

    Parameters
    ----------
    path : str or path
        Of the card; .toml is added where it is missing.
    sizes : mapping, optional
        Any of length_x, length_y, thickness (mm) and mass (g); those of an example stand for the others.
    edges : str
        "free", "cantilever", "clamped", "supported", or four letters of C, S and F for x0, y0, x1, y1.
    prior : str
        Name of a prior card.
    title, notes : str
        Any text.
    frequencies : mapping, optional
        Label to Hz. Without any the card serves `modes`, which shows where to look for them.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If there is a file of that name, or what was given cannot stand on a card; then nothing is written.
    """
    card = _new_card_path(path)
    words = edge_words(_ARRANGEMENTS.get(edges, edges))
    faults = [
        Fault(f"sizes {name}", f"one of {', '.join(SIZES)}", show_value(name), did_you_mean(str(name), SIZES))
        for name in sizes or {}
        if name not in SIZES
    ]
    if words is None:
        faults.append(Fault("edges", _EDGES_WANTED, show_value(edges)))
        words = dict.fromkeys(EDGES, "free")
    size_values, hertz = _to_numbers(sizes or {}, faults), _to_numbers(frequencies or {}, faults)
    text = starter_text(card.stem, size_values, words, prior, hertz, _example_modes(words), title=title, notes=notes)
    faults += _card_faults(text, card)
    if faults:
        raise InputError(faults)
    with catch_write_errors(card):
        card.parent.mkdir(parents=True, exist_ok=True)
    write_text(card, text)
    return card


def _new_card_path(path: str | os.PathLike[str]) -> Path:
    card = Path(path)
    if not card.name:
        raise InputError(Fault("name", "a file name", show_value(str(path)), "choose another name"))
    card = card if card.suffix == ".toml" else card.with_name(f"{card.name}.toml")
    if os.path.exists(card):
        raise InputError(Fault(printable(str(card)), "a new file", "one that exists", "choose another name"))
    return card


def require_path(path: str | os.PathLike[str]) -> None:
    """Refuse what `new` would refuse of a path by itself: a file that exists, a name that no card can have."""
    card = _new_card_path(path)
    if wanted := name_complaint(card.stem):
        raise InputError(Fault("name", wanted, show_value(card.stem), "choose another name"))


def require_edges(edges: str) -> None:
    """Refuse a text that does not say how four edges are held."""
    if edge_words(_ARRANGEMENTS.get(edges, edges)) is None:
        raise InputError(Fault("edges", _EDGES_WANTED, show_value(edges)))


def require_prior(prior: str, path: str) -> None:
    """Refuse a prior that a card at this path cannot name."""
    load_prior(prior, _new_card_path(path).parent)


def example_labels(edges: str) -> list[str]:
    """Labels of modes that a board held this way has; those of a free one where the arrangement is not known."""
    words = edge_words(_ARRANGEMENTS.get(edges, edges))
    return [str(label) for label in _example_modes(words or dict.fromkeys(EDGES, "free"))]


def _example_modes(words: Mapping[str, EdgeCondition]) -> list[Label]:
    return lowest_labels((words["x0"], words["x1"]), (words["y0"], words["y1"]))[:_N_EXAMPLES]


def _to_numbers(texts: Mapping[str, float | str], faults: list[Fault]) -> dict[str, float]:
    """Numbers from texts, with the hints of a card for those that are not numbers."""
    numbers = {}
    for name, value in texts.items():
        try:
            numbers[name] = _ANY_NUMBER(_to_number(value))
        except Refusal as refusal:
            faults += [
                Fault(printable(str(name)), complaint.wanted, complaint.got, complaint.remedy)
                for complaint in refusal.complaints
            ]
    return numbers


def _to_number(value: float | str) -> float | str:
    try:
        return float(value)
    except (TypeError, ValueError):
        return value


def _card_faults(text: str, card: Path) -> list[Fault]:
    """Every fault of the text of a card, and of the prior that it names."""
    try:
        board = Board.from_card(CardFile.of(text, card.name, card.parent), may_lack_frequencies=True)
    except InputError as error:
        return list(error.faults)
    named = load_named_cards(board)
    return [*physical_faults(board), *named.faults] or label_faults(board.assuming(named.prior))
