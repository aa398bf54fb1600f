"""The command line: commands and their options; no logic of its own."""

from __future__ import annotations

import os
from shlex import quote
from typing import Any

import click

from bayesplate.asking import asked_answers, given_answers
from bayesplate.options import (
    PATH,
    costs,
    mass_kg,
    names,
    places,
    refuse_both,
    sand_pictures,
    shared_options,
)
from bayesplate.terminal import print_json, print_shown, progress_line, reporting, say


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


@main.command()
@click.argument("card")
@shared_options("effects", "setup", "json", "quiet", "debug")
def check(card: str, effects: list[str] | None, setup: str | None, as_json: bool, quiet: bool, debug: bool) -> None:
    """Every fault of CARD, or what a fit of it can identify."""
    with reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.check import check as run
        from bayesplate.workflow.shown import show_check

        report = run(card, effects=effects, setup=setup)
        if as_json:
            print_json(report)
        elif not quiet:
            print_shown(show_check(report))


@main.command()
@click.argument("card")
@shared_options(
    "out", "seed", "effects", "setup", "linear", "exact", "robust", "report", "force", "resume", "json", "quiet",
    "debug",
)  # fmt: skip
def fit(
    card: str,
    out: str | None,
    linear: bool,
    exact: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
    **asked: Any,
) -> None:
    """Posterior of the elastic constants of CARD.

    Writes report.html, summary.json and posterior.nc.
    """
    refuse_both(asked["force"], asked["resume"], "--force starts anew and --resume continues")
    refuse_both(linear, exact, "--linear and --exact force different laws")
    with reporting(as_json=as_json, debug=debug):
        with progress_line(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.fit import fit as run
            from bayesplate.workflow.prepare import default_folder

            folder = default_folder(card) if out is None else out
            result = run(
                card, out=folder, law="linear" if linear else "exact" if exact else None, progress=tell, **asked
            )
        if as_json:
            print_json(result.summary)
        elif not quiet:
            from bayesplate.workflow.shown import show_fit

            print_shown(show_fit(result.summary))
            say(f"written to {result.folder}")


@main.command()
@click.argument("card")
@shared_options("out", "seed", "effects", "setup", "force", "json", "quiet", "debug")
def modes(
    card: str,
    out: str | None,
    seed: int,
    effects: list[str] | None,
    setup: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Lowest modes of CARD, and a sheet of their Chladni figures."""
    with reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.modes import modes as run
        from bayesplate.workflow.prepare import default_folder
        from bayesplate.workflow.shown import show_modes

        folder = default_folder(card) if out is None else out
        result = run(card, out=folder, seed=seed, effects=effects, setup=setup, force=force)
        if as_json:
            print_json(result.summary)
        elif not quiet:
            print_shown(show_modes(result.summary))


@main.command()
@click.argument("card")
@shared_options("coefficients", "write_to", "seed", "effects", "force", "json", "quiet", "debug")
def compare(
    card: str,
    coefficients: Any,
    out: str | None,
    seed: int,
    effects: list[str] | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Every method on CARD side by side.

    Each as a thin and as a shear-flexible plate.
    """
    with reporting(as_json=as_json, debug=debug):
        with progress_line(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.compare import compare as run

            result = run(
                card,
                coefficients=coefficients,
                seed=seed,
                effects=effects,
                out=out,
                force=force,
                progress=tell,
            )
        if as_json:
            print_json(result)
        elif not quiet:
            from bayesplate.workflow.shown import show_compare

            print_shown(show_compare(result))


@main.command()
@click.argument("card")
@shared_options("out", "seed", "effects", "setup", "report", "force", "resume", "json", "quiet", "debug")
def diagnose(
    card: str,
    out: str | None,
    seed: int,
    effects: list[str] | None,
    setup: str | None,
    report: bool,
    force: bool,
    resume: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Trace what the plate model misses on CARD to a physical effect.

    Adds the effect, and reports the error before and after.
    """
    refuse_both(force, resume, "--force starts anew and --resume continues")
    with reporting(as_json=as_json, debug=debug):
        with progress_line(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.diagnose import diagnose as run
            from bayesplate.workflow.prepare import default_folder

            folder = default_folder(card) if out is None else out
            result = run(
                card,
                out=folder,
                report=report,
                seed=seed,
                effects=effects,
                setup=setup,
                force=force,
                resume=resume,
                progress=tell,
            )
        if as_json:
            print_json(result.to_json())
        elif not quiet:
            from bayesplate.workflow.shown import show_diagnosis

            print_shown(show_diagnosis(result.diagnosis))
            say(f"written to {result.folder}")


@main.command()
@click.argument("card")
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
@shared_options("out", "seed", "effects", "force", "json", "quiet", "debug")
def plan(
    card: str,
    goal: str | None,
    costs: Any,
    between: list[str] | None,
    out: str | None,
    seed: int,
    effects: list[str] | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """What to measure next on CARD.

    Ranks measurements by what they are expected to give and what they cost.
    """
    with reporting(as_json=as_json, debug=debug):
        with progress_line(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.plan import plan as run
            from bayesplate.workflow.prepare import default_folder

            folder = default_folder(card) if out is None else out
            result = run(
                card, goal=goal, costs=costs, between=between, out=folder, seed=seed, effects=effects, force=force,
                progress=tell,
            )  # fmt: skip
        if as_json:
            print_json(result.summary)
        elif not quiet:
            from bayesplate.workflow.shown import show_plan

            print_shown(show_plan(result.summary))
            say(f"written to {folder}: {', '.join(path.name for path in result.files)}")


@main.command()
@click.argument("path", required=False)
@click.option("--length-x", metavar="MM", help="Length along the grain.")
@click.option("--length-y", metavar="MM", help="Length across the grain.")
@click.option("--thickness", metavar="MM")
@click.option("--mass", metavar="G")
@click.option("--edges", metavar="WORD", help="free, cantilever, clamped, supported, or letters like CFFF.")
@click.option("--prior", metavar="NAME", help="Prior card, spruce or weakly-informative.")
@click.option("--title", help="A line for people.")
@click.option("--notes", help="Free text.")
@click.option("--frequency", multiple=True, metavar="LABEL=HZ", help='As often as there are modes: "(1,1)=35".')
@shared_options("json", "quiet", "debug")
def new(path: str | None, as_json: bool, quiet: bool, debug: bool, **answers: Any) -> None:
    """Write a first card to PATH.

    It asks, or takes the options where there are any.
    """
    given = {name: value for name, value in answers.items() if value}
    options = given_answers(given)
    with reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.new import new as run

        told = {"name": path or "my-board"} | (options if given or as_json or quiet else asked_answers(path))
        card = run(told.pop("name"), **told)
        if as_json:
            print_json({"path": str(card)})
        elif not quiet:
            shown = quote(str(card))
            say(
                f"written to {card}. Next: bayesplate check {shown}, which tells every fault, or what it can say"
                if told.get("frequencies")
                else f"written to {card}. Next: bayesplate modes {shown}, which shows the figures and where to listen; "
                f"bayesplate plan {shown}, where to tap; with frequencies bayesplate check {shown}"
            )


@main.command()
@click.argument("files", nargs=-1, required=True, type=PATH)
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
@shared_options("force", "json", "quiet", "debug")
def pick(files: tuple[str, ...], out: str, force: bool, as_json: bool, quiet: bool, debug: bool, **given: Any) -> None:
    """Frequencies of the modes in recordings FILES.

    Writes the [setup] that a card takes, too.
    """
    with reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.pick import FRAGMENT, PAGE
        from bayesplate.workflow.pick import pick as run
        from bayesplate.workflow.pick_words import show_pick

        result = run(files, out=out, force=force, **given)
        if as_json:
            print_json(result.summary)
        elif not quiet:
            print_shown(show_pick(result.summary))
            completes = f"{quote(given['card'] or 'CARD')} --setup {quote(f'{out}/{FRAGMENT}')}"
            say(f"written to {out}: {FRAGMENT}, {PAGE}. Next: bayesplate fit {completes}")


@main.command()
@click.argument("card")
@shared_options("effects", "json", "quiet", "debug")
def cite(card: str, effects: list[str] | None, as_json: bool, quiet: bool, debug: bool) -> None:
    """References of exactly what a fit of CARD uses."""
    with reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.cite import cite as run
        from bayesplate.workflow.cite import cite_text

        sections = run(card, effects=effects)
        if as_json:
            print_json({section.title.lower(): list(section.entries) for section in sections})
        elif not quiet:
            say(cite_text(sections), nl=False)


@main.command()
@click.argument("source")
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
@shared_options(
    "out", "seed", "effects", "linear", "exact", "robust", "report", "force", "resume", "json", "quiet", "debug"
)
def batch(
    source: str,
    out: str | None,
    linear: bool,
    exact: bool,
    match: str | None,
    limit: tuple[str, ...],
    rigidity: float | None,
    as_json: bool,
    quiet: bool,
    debug: bool,
    **asked: Any,
) -> None:
    """Fit many boards: a folder of cards, or the rows of a table.

    One table of all, and a page that grades them. SOURCE is the folder or the table.
    """
    refuse_both(asked["force"], asked["resume"], "--force starts anew and --resume continues")
    refuse_both(linear, exact, "--linear and --exact force different laws")
    refuse_both(asked["workers"] is not None, asked["dask"] is not None, "--workers are processes here, --dask others")
    with reporting(as_json=as_json, debug=debug):
        with progress_line(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.batch import batch as run
            from bayesplate.workflow.batch import default_batch_folder
            from bayesplate.workflow.batch_grading import grading_request

            result = run(
                source,
                default_batch_folder(source) if out is None else out,
                law="linear" if linear else "exact" if exact else None,
                grading=grading_request(match, limit, rigidity),
                progress=tell,
                **asked,
            )
        if as_json:
            print_json(result.summary)
        elif not quiet:
            from bayesplate.workflow.shown import show_batch

            print_shown(show_batch(result.summary, result.grading))
            say(f"written to {result.folder}")
    with reporting(as_json=False, debug=debug):
        result.require_all()
