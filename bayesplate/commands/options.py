"""Arguments that several commands take, each with its reader and the option of the command line that gives it."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Annotated, Any, get_args

import click

from bayesplate.board.values import Key, Refusal
from bayesplate.board.words import did_you_mean
from bayesplate.commands.arguments import (
    annotations_of,
    effects_reader,
    integer_reader,
    is_positive,
    optional_reader,
    read_bool,
    read_card,
    read_function,
    read_path,
    refusal_of,
    word_reader,
)
from bayesplate.commands.prepare import default_folder
from bayesplate.estimates.coefficients import CoefficientSource
from bayesplate.frequencies.laws import LawName
from bayesplate.planning.gains import GOALS
from bayesplate.planning.proposals import Costs
from bayesplate.posterior.sampling import Progress


class Option:
    """An option or an argument of the command line that gives an argument of a function."""

    def __init__(self, *names: str, otherwise: Callable[[str], Any] | None = None, **settings: Any) -> None:
        self.names, self.otherwise, self.settings = names, otherwise, settings

    def parameters(self, name: str, default: object) -> Iterator[click.Parameter]:
        """Parameters of click, from the name and the default of the argument."""
        settings = {"default": default, **self.settings} if self.settings.get("show_default") else self.settings
        if self.names[0].startswith("-"):
            yield click.Option([*self.names, name], **settings)
        else:
            yield click.Argument([name], **settings)

    def value(self, name: str, values: Mapping[str, Any], first_argument: Any) -> Any:
        """The argument, from all options that were given; `otherwise` derives it from the command's first argument."""
        return self.otherwise(first_argument) if values[name] is None and self.otherwise is not None else values[name]


class OptionGroup:
    """Several options that give one argument; `join` raises click.UsageError where they exclude each other."""

    def __init__(self, join: Callable[..., Any], **options: Option) -> None:
        self.options, self.join = options, join

    def parameters(self, name: str, default: object) -> Iterator[click.Parameter]:
        for option_name, option in self.options.items():
            yield from option.parameters(option_name, None)

    def value(self, name: str, values: Mapping[str, Any], first_argument: Any) -> Any:
        return self.join(**{option_name: values[option_name] for option_name in self.options})


def options_of(function: Callable[..., Any]) -> dict[str, Option | OptionGroup]:
    """The options of a function, by argument; an argument without a default stands on the command line by itself."""
    options: dict[str, Option | OptionGroup] = {}
    annotations = annotations_of(function)
    for name, parameter in inspect.signature(function).parameters.items():
        metadata = getattr(annotations[name], "__metadata__", ())
        declared = [entry for entry in metadata if isinstance(entry, Option | OptionGroup)]
        if declared or parameter.default is parameter.empty:
            options[name] = declared[0] if declared else Option(name)
    return options


def path_option(*names: str, **settings: Any) -> Option:
    """A path that click does not check: a file that cannot be read is invalid input and no fault of usage."""
    return Option(*names, type=click.Path(readable=False), **settings)


def refuse_both(first: object, second: object, why: str) -> None:
    """Refuse options that exclude each other; raises click.UsageError."""
    if first and second:
        raise click.UsageError(f"{why}: give one of them.")


def _effects_from_text(context: click.Context, option: click.Parameter, effects: str | None) -> list[str] | None:
    """Effects from a comma-separated list; none at all from "none"."""
    if effects is None:
        return None
    names = [name.strip() for name in effects.split(",") if name.strip()]
    if not names:
        raise click.UsageError('--effects: wanted names, or "none", got nothing.')
    refuse_both("none" in names, len(names) > 1, "--effects none declares nothing and a name declares an effect")
    return [] if "none" in names else names


def _law_from_flags(linear: bool, exact: bool) -> str | None:
    refuse_both(linear, exact, "--linear and --exact force different laws")
    return "linear" if linear else "exact" if exact else None


def _costs_from_text(context: click.Context, option: click.Parameter, costs: tuple[str, ...]) -> dict[str, Any] | None:
    """Minutes by class from CLASS=MINUTES, as often as there are classes."""
    minutes_by_class: dict[str, Any] = {}
    for text in costs:
        name, _, minutes = text.partition("=")
        try:
            stated_minutes = float(minutes)
        except ValueError:
            raise click.BadParameter(f"{text!r}: wanted CLASS=MINUTES, as reading=2", context, option) from None
        if name.strip() in minutes_by_class:
            raise click.BadParameter(f"{name.strip()} is given twice", context, option)
        minutes_by_class[name.strip()] = stated_minutes
    return minutes_by_class or None


def _read_costs(value: object) -> object:
    if not isinstance(value, Mapping):
        raise refusal_of(f"minutes by class: {', '.join(Costs.names())}", value)
    complaints = []
    for key, minutes in value.items():
        if key not in Costs.names():
            hint = did_you_mean(key, Costs.names()) if isinstance(key, str) else ""
            complaints += refusal_of(f"one of {', '.join(Costs.names())}", key, hint).complaints_below(str(key))
        elif not is_positive(minutes):
            complaints += refusal_of("a positive number of minutes", minutes).complaints_below(key)
    if complaints:
        raise Refusal(*complaints)
    return value


def _read_rival_effects(value: object) -> object:
    if isinstance(value, list | tuple) and not value:
        raise refusal_of("one name of an effect or more, or None", [])
    return effects_reader("between")(value)


FilePath = str | os.PathLike[str]
CARD = Key(read_card)
ANY_PATH = Key(read_path)
_PATH_OR_NONE = Key(optional_reader(read_path))
_BOOL = Key(read_bool)

Out = Annotated[
    FilePath | None,
    _PATH_OR_NONE,
    path_option("--out", otherwise=default_folder, help="Output folder (default results/NAME)."),
]
CompareOut = Annotated[
    FilePath | None, _PATH_OR_NONE, path_option("--out", help="Folder for compare.json (default: not written).")
]
Seed = Annotated[
    int, Key(integer_reader(0)), Option("--seed", type=click.IntRange(0), show_default=True, help="Random seed.")
]
Effects = Annotated[
    Sequence[str] | None,
    Key(effects_reader("effects")),
    Option(
        "--effects",
        callback=_effects_from_text,
        help="Declared effects, comma separated, in place of the card's; or none.",
    ),
]
SetupFile = Annotated[
    FilePath | None,
    _PATH_OR_NONE,
    path_option("--setup", help="File with a [setup]: its keys, readings among them, take the place of the card's."),
]
Law = Annotated[
    LawName | None,
    Key(word_reader(*get_args(LawName), None)),
    OptionGroup(
        _law_from_flags,
        linear=Option("--linear", is_flag=True, help="Force the linear frequency law."),
        exact=Option("--exact", is_flag=True, help="Force the exact frequency law."),
    ),
]
Robust = Annotated[bool, _BOOL, Option("--robust", is_flag=True, help="Student-t noise: one wrong mode has less say.")]
Report = Annotated[
    bool,
    _BOOL,
    Option("--no-report", is_flag=True, default=True, flag_value=False, help="Write no page and no figures."),
]
Force = Annotated[bool, _BOOL, Option("--force", is_flag=True, help="Replace the results in the output folder.")]
Resume = Annotated[bool, _BOOL, Option("--resume", is_flag=True, help="Continue an interrupted run.")]
OnProgress = Annotated[Callable[[Progress], None] | None, Key(read_function)]
CoefficientChoice = Annotated[
    CoefficientSource | None,
    Key(word_reader(*get_args(CoefficientSource), None)),
    Option(
        "--coefficients",
        type=click.Choice(get_args(CoefficientSource)),
        help="Source of the paper's coefficients (default: the table that the card names, else sensitivity).",
    ),
]
Goal = Annotated[
    str | None,
    Key(word_reader(*GOALS, None)),
    Option("--for", metavar="WHAT", help="E_x, E_y, G_xy, constants or explanations."),
]
Minutes = Annotated[
    Mapping[str, float] | None,
    Key(optional_reader(_read_costs)),
    Option(
        "--cost",
        multiple=True,
        metavar="CLASS=MINUTES",
        callback=_costs_from_text,
        help="Minutes that a reading (1), a new clamping (10) or another board (30) takes.",
    ),
]
RivalEffects = Annotated[
    Sequence[str] | None,
    Key(_read_rival_effects),
    Option("--between", callback=_effects_from_text, help="Effects to be told apart, comma separated."),
]
