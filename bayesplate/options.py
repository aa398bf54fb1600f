"""Options of the command line: those that several commands share, and what stands behind the words of the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import inf
from typing import Any

import click

PATH = click.Path(readable=False)
"""A path as it is given: what cannot be read is invalid input, told by those who read it, and no fault of usage."""


def shared_option(name: str) -> Callable[..., Any]:
    """An option that several commands take, as a decorator."""
    known = {
        "out": click.option("--out", type=PATH, help="Output folder (default results/NAME)."),
        "seed": click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Random seed."),
        "effects": click.option(
            "--effects",
            callback=names,
            help="Declared effects, comma separated, in place of the card's; or none.",
        ),
        "setup": click.option(
            "--setup", type=PATH, help="File with a [setup] that completes the card: what pick writes."
        ),
        "linear": click.option("--linear", is_flag=True, help="Force the linear frequency law."),
        "exact": click.option("--exact", is_flag=True, help="Force the exact frequency law."),
        "robust": click.option("--robust", is_flag=True, help="Student-t noise: one wrong mode has less say."),
        "coefficients": click.option(
            "--coefficients",
            type=click.Choice(["sensitivity", "training", "published"]),
            help="Source of the paper's coefficients (default: the table that the card names, else sensitivity).",
        ),
        "write_to": click.option("--out", type=PATH, help="Folder for compare.json (default: not written)."),
        "force": click.option("--force", is_flag=True, help="Replace the results in the output folder."),
        "report": click.option(
            "--no-report", "report", is_flag=True, default=True, flag_value=False, help="Write no page and no figures."
        ),
        "resume": click.option("--resume", is_flag=True, help="Continue an interrupted run."),
        "json": click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables."),
        "quiet": click.option("--quiet", is_flag=True, help="Print nothing but errors."),
        "debug": click.option("--debug", is_flag=True, help="Show the traceback of an error."),
    }
    return known[name]


def refuse_contradictions(asked: Mapping[str, Any]) -> None:
    """Refuse options that exclude each other.

    Raises
    ------
    click.UsageError
    """
    refuse_both(asked.get("force"), asked.get("resume"), "--force starts anew and --resume continues")
    refuse_both(asked.get("linear"), asked.get("exact"), "--linear and --exact force different laws")
    refuse_both(asked.get("workers"), asked.get("dask"), "--workers are processes here, --dask others")


def refuse_both(one: object, other: object, why: str) -> None:
    if one and other:
        raise click.UsageError(f"{why}: give one of them.")


def names(context: click.Context, option: click.Parameter, effects: str | None) -> list[str] | None:
    """Effects from a comma-separated list; none at all from "none"."""
    if effects is None:
        return None
    names = [name.strip() for name in effects.split(",") if name.strip()]
    refuse_both("none" in names, len(names) > 1, "--effects none declares nothing and a name declares an effect")
    return [] if "none" in names else names


def costs(context: click.Context, option: click.Parameter, costs: tuple[str, ...]) -> dict[str, Any] | None:
    """Minutes by class from CLASS=MINUTES, as often as there are classes."""
    told: dict[str, Any] = {}
    for one in costs:
        name, _, minutes = one.partition("=")
        try:
            told[name.strip()] = float(minutes)
        except ValueError:
            raise click.BadParameter(f"{one!r}: wanted CLASS=MINUTES, as reading=2", context, option) from None
    return told or None


def places(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> list[tuple[float, float]]:
    """Places "X,Y" in mm as m."""
    found = []
    for text in given:
        try:
            x, y = (1e-3 * float(part) for part in text.split(","))
        except ValueError:
            raise click.BadParameter(f"wanted X,Y in mm, got {text!r}: {option.opts[0]} 20,20") from None
        found.append((x, y))
    return found


def mass_kg(context: click.Context, option: click.Parameter, given: str | None) -> tuple[float, float] | None:
    """A mass "G" or "G,SD" in g as kg."""
    if given is None:
        return None
    try:
        grams, sd = (*(float(part) for part in given.split(",", 1)), 0.0)[:2]
    except ValueError:
        grams, sd = 0.0, 0.0
    if not (0.0 <= sd <= grams < inf and grams > 0.0):
        wanted = "wanted a mass in g, or mass and standard deviation, with decimal points"
        raise click.BadParameter(f"{wanted}, got {given!r}: 0.6 or 0.6,0.1")
    return 1e-3 * grams, 1e-3 * sd


def frequencies(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[str, str]:
    """Frequencies "LABEL=HZ" by their label."""
    found = {}
    for text in given:
        label, sign, hertz = text.rpartition("=")
        if not sign:
            raise click.UsageError(f'--frequency {text!r}: write a label and its frequency, "(1,1)=35".')
        found[label.strip()] = hertz.strip()
    return found


def sand_pictures(context: click.Context, option: click.Parameter, given: tuple[str, ...]) -> dict[float, str]:
    """Pictures "HZ=FILE" by their frequency."""
    found = {}
    for text in given:
        hertz, _, path = text.partition("=")
        try:
            found[float(hertz)] = path
        except ValueError:
            raise click.BadParameter(f"wanted HZ=FILE, got {text!r}: --sand 210=sand-210.png") from None
    return found
