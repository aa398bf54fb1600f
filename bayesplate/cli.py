"""The command line: commands and their options; no logic of its own."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

from bayesplate.asking import answers, asked_answers
from bayesplate.options import (
    PATH,
    costs,
    frequencies,
    mass_kg,
    names,
    places,
    refuse_contradictions,
    sand_pictures,
    shared_option,
)
from bayesplate.terminal import print_json, print_shown, progress_line, reporting, say

if TYPE_CHECKING:
    from bayesplate.commands.shown import Shown


class Commands(click.Group):
    """A group that names the nearest command when one is mistyped."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find a command, or say which was probably meant."""
        from difflib import get_close_matches

        try:
            return super().resolve_command(ctx, args)
        except click.UsageError as error:
            near = get_close_matches(args[0], self.list_commands(ctx), n=1)
            hint = f" Did you mean {near[0]!r}?" if near else ""
            raise click.UsageError(error.message + hint, ctx) from None


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="bayesplate")
def main() -> None:
    """Learn the elastic constants of a rectangular plate from its modes.

    CARD is the name of a shipped board or the path of a card (a .toml file). Campaigns go to check, fit,
    diagnose and plan.
    """
    # Thousands of small matrices: more than one thread each only waits for the others. Before numpy is loaded.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")


@dataclass(frozen=True)
class Answer:
    """What a command found.

    Attributes
    ----------
    content : object
        What `--json` prints.
    shown : callable, optional
        What people are shown.
    closing : str
        Where things were written, and what comes next.
    then : callable, optional
        Called at the end; its error is the command's.
    """

    content: Any
    shown: Callable[[], Shown] | None = None
    closing: str = ""
    then: Callable[[], None] | None = None

    def print(self, *, as_json: bool, quiet: bool) -> None:
        """Print what was asked for."""
        if as_json:
            print_json(self.content)
        elif not quiet:
            if self.shown is not None:
                print_shown(self.shown())
            if self.closing:
                say(self.closing)


CARD = click.argument("card")


def command(
    *options: str, argument: Callable[..., Any] = CARD, has_progress: bool = False
) -> Callable[[Callable[..., Answer]], click.Command]:
    """A command with its argument, the shared options of these names, and those above it; its answer is printed."""

    def decorate(run: Callable[..., Answer]) -> click.Command:
        @wraps(run)
        def whole(as_json: bool, quiet: bool, debug: bool, **asked: Any) -> None:
            refuse_contradictions(asked)
            if "linear" in asked:
                is_linear, is_exact = asked.pop("linear"), asked.pop("exact")
                asked["law"] = "linear" if is_linear else "exact" if is_exact else None
            with reporting(as_json=as_json, debug=debug):
                with progress_line(shown=has_progress and not quiet and not as_json) as tell:
                    if has_progress:
                        asked["progress"] = tell
                    if "out" in options and "card" in asked and asked["out"] is None:
                        from bayesplate.commands.prepare import default_folder

                        asked["out"] = default_folder(asked["card"])
                    answer = run(**asked)
                answer.print(as_json=as_json, quiet=quiet)
            if answer.then is not None:
                with reporting(as_json=False, debug=debug):
                    answer.then()

        own = getattr(run, "__click_params__", [])  # which stand first in the help
        whole.__click_params__ = []  # type: ignore[attr-defined]
        for name in reversed((*options, "json", "quiet", "debug")):
            shared_option(name)(whole)
        whole.__click_params__ += own  # type: ignore[attr-defined]
        return main.command(name=run.__name__)(argument(whole))

    return decorate


@command("effects", "setup")
def check(card: str, **asked: Any) -> Answer:
    """Every fault of CARD, or what a fit of it can identify."""
    from bayesplate.commands.check import check as run
    from bayesplate.commands.shown import show_check

    report = run(card, **asked)
    return Answer(report, lambda: show_check(report))


@command("out", "seed", "effects", "setup", "linear", "exact", "robust", "report", "force", "resume", has_progress=True)
def fit(card: str, **asked: Any) -> Answer:
    """Posterior of the elastic constants of CARD.

    Writes report.html, summary.json and posterior.nc.
    """
    from bayesplate.commands.fit import fit as run
    from bayesplate.commands.shown import show_fit

    result = run(card, **asked)
    return Answer(result.summary, lambda: show_fit(result.summary), f"written to {result.folder}")


@command("out", "seed", "effects", "setup", "force")
def modes(card: str, **asked: Any) -> Answer:
    """Lowest modes of CARD, and a sheet of their Chladni figures."""
    from bayesplate.commands.modes import modes as run
    from bayesplate.commands.shown import show_modes

    result = run(card, **asked)
    return Answer(result.summary, lambda: show_modes(result.summary))


@command("coefficients", "write_to", "seed", "effects", "force", has_progress=True)
def compare(card: str, **asked: Any) -> Answer:
    """Every method on CARD side by side.

    Each as a thin and as a shear-flexible plate.
    """
    from bayesplate.commands.compare import compare as run
    from bayesplate.commands.shown import show_compare

    result = run(card, **asked)
    return Answer(result, lambda: show_compare(result))


@command("out", "seed", "effects", "setup", "report", "force", "resume", has_progress=True)
def diagnose(card: str, **asked: Any) -> Answer:
    """Trace what the plate model misses on CARD to a physical effect.

    Adds the effect, and reports the error before and after.
    """
    from bayesplate.commands.diagnose import diagnose as run
    from bayesplate.commands.shown import show_diagnosis

    result = run(card, **asked)
    return Answer(result.to_json(), lambda: show_diagnosis(result.diagnosis), f"written to {result.folder}")


@command("out", "seed", "effects", "force", has_progress=True)
@click.option("--for", "goal", metavar="WHAT", help="E_x, E_y, G_xy, constants or explanations.")
@click.option(
    "--cost",
    "costs",
    multiple=True,
    metavar="CLASS=MINUTES",
    callback=costs,
    help="Minutes that a reading (1), a new clamping (10) or another board (30) takes.",
)
@click.option("--between", callback=names, help="Effects to be told apart, comma separated.")
def plan(card: str, **asked: Any) -> Answer:
    """What to measure next on CARD.

    Ranks measurements by what they are expected to give and what they cost.
    """
    from bayesplate.commands.plan import plan as run
    from bayesplate.commands.shown import show_plan

    result = run(card, **asked)
    closing = f"written to {asked['out']}: {', '.join(path.name for path in result.files)}"
    return Answer(result.summary, lambda: show_plan(result.summary), closing)


@command(argument=click.argument("path", required=False))
@click.option("--length-x", metavar="MM", help="Length along the grain.")
@click.option("--length-y", metavar="MM", help="Length across the grain.")
@click.option("--thickness", metavar="MM")
@click.option("--mass", metavar="G")
@click.option("--edges", metavar="WORD", help="free, cantilever, clamped, supported, or letters like CFFF.")
@click.option("--prior", metavar="NAME", help="Prior card, spruce or weakly-informative.")
@click.option("--title", help="A line for people.")
@click.option("--notes", help="Free text.")
@click.option(
    "--frequency",
    "frequencies",
    multiple=True,
    callback=frequencies,
    metavar="LABEL=HZ",
    help='As often as there are modes: "(1,1)=35".',
)
def new(path: str | None, **options: Any) -> Answer:
    """Write a first card to PATH.

    It asks, or takes the options where there are any.
    """
    from bayesplate.commands.new import new as run

    given = {name: value for name, value in options.items() if value}
    asked = click.get_current_context().params
    may_ask = not given and not asked["as_json"] and not asked["quiet"]
    told = asked_answers(path) if may_ask else {"name": path or "my-board", **answers(given)}
    card = run(told.pop("name"), **told)
    shown = quote(str(card))
    following = (
        f"check {shown}, which tells every fault, or what it can say"
        if told.get("frequencies")
        else f"modes {shown}, which shows the figures and where to listen; bayesplate plan {shown}, where to tap; "
        f"with frequencies bayesplate check {shown}"
    )
    return Answer({"path": str(card)}, closing=f"written to {card}. Next: bayesplate {following}")


@command("force", argument=click.argument("files", nargs=-1, required=True, type=PATH))
@click.option("--card", metavar="CARD", help="Board card with sizes and edges: labels are computed for it.")
@click.option("--rate", type=float, metavar="HZ", help="Samples per second, where a file does not say it.")
@click.option(
    "--hammer", multiple=True, callback=places, metavar="X,Y", help="Where it was hit, mm; once, or per file."
)
@click.option("--sensor", multiple=True, callback=places, metavar="X,Y", help="Where the sensor was, mm; likewise.")
@click.option("--sensor-mass", callback=mass_kg, metavar="G", help="Of the accelerometer in g, or G,SD.")
@click.option(
    "--channels",
    default="force,response",
    show_default=True,
    help="Of a file with two channels; also response,force, response,response for stereo, or the number of one.",
)
@click.option(
    "--motion",
    default="acceleration",
    show_default=True,
    help="What a response is: acceleration, velocity, displacement, or pressure (a microphone).",
)
@click.option("--polarity", help="same or opposite, of force and response (default: found by the labels).")
@click.option("--sweep", metavar="F1,F2,S", help="For recordings of an exponential sweep: its parameters, or its file.")
@click.option(
    "--sand", multiple=True, callback=sand_pictures, metavar="HZ=FILE", help="Picture of sand, cropped to the board."
)
@click.option("--lowest", type=float, default=20.0, show_default=True, metavar="HZ")
@click.option("--highest", type=float, default=1000.0, show_default=True, metavar="HZ")
@click.option("--out", type=PATH, default="results/recordings", show_default=True, help="Output folder.")
def pick(files: tuple[str, ...], **asked: Any) -> Answer:
    """Frequencies of the modes in recordings FILES.

    Writes the [setup] that a card takes, too.
    """
    from bayesplate.commands.pick import FRAGMENT, PAGE
    from bayesplate.commands.pick import pick as run
    from bayesplate.commands.pick_words import show_pick

    out = asked["out"]
    result = run(files, **asked)
    completes = f"{quote(asked['card'] or 'CARD')} --setup {quote(f'{out}/{FRAGMENT}')}"
    closing = f"written to {out}: {FRAGMENT}, {PAGE}. Next: bayesplate fit {completes}"
    return Answer(result.summary, lambda: show_pick(result.summary), closing)


@command("effects")
def cite(card: str, **asked: Any) -> Answer:
    """References of exactly what a fit of CARD uses."""
    from bayesplate.commands.cite import cite as run
    from bayesplate.commands.cite import cite_text

    sections = run(card, **asked)
    content = {section.title.lower(): list(section.entries) for section in sections}
    return Answer(content, closing=cite_text(sections).removesuffix("\n"))


@command(
    "out", "seed", "effects", "linear", "exact", "robust", "report", "force", "resume",
    argument=click.argument("source"), has_progress=True,
)  # fmt: skip
@click.option("--template", metavar="CARD", help="With a table: the card of what is common to its boards.")
@click.option("--workers", type=click.IntRange(1), help="Processes (default: one for each core).")
@click.option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster that computes in their place.")
@click.option("--folders", is_flag=True, help="Write the files of fit for each board too, into boards/NAME.")
@click.option("--table", type=click.Choice(["csv", "parquet"]), default="csv", show_default=True)
@click.option("--match", metavar="PERCENT", help="Boards match within this: 10 (default), or E_x=10,E_y=15.")
@click.option(
    "--limit",
    multiple=True,
    metavar="NAME=LEAST:GREATEST",
    help="A specification, moduli in GPa, density in kg/m3: E_x=10:14, density=:420.",
)
@click.option("--rigidity", type=float, metavar="N_M", help="D_x in N m for which each board's thickness is wanted.")
def batch(source: str, *, match: str | None, limit: tuple[str, ...], rigidity: float | None, **asked: Any) -> Answer:
    """Fit many boards: a folder of cards, or the rows of a table.

    One table of all, and a page that grades them. SOURCE is the folder or the table.
    """
    from bayesplate.commands.batch import batch as run
    from bayesplate.commands.batch import default_batch_folder
    from bayesplate.commands.batch_grading import grading_request
    from bayesplate.commands.shown import show_batch

    out = asked.pop("out") or default_batch_folder(source)
    result = run(source, out, grading=grading_request(match, limit, rigidity), **asked)
    closing = f"written to {result.folder}"
    return Answer(result.summary, lambda: show_batch(result.summary, result.grading), closing, result.require_all)
