"""The command line: options in, tables and exit codes out; no logic of its own."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from bayesplate.errors import BayesplateError

if TYPE_CHECKING:
    from bayesplate.workflow.shown import Progress, Shown

INTERRUPTED = 130
INTERNAL = 70


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


def _options(*wanted: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The shared options that a command takes, in one order."""
    known = {
        "out": click.option("--out", type=click.Path(), help="Output folder (default results/NAME)."),
        "seed": click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Random seed."),
        "effects": click.option(
            "--effects", help="Declared effects, comma separated, in place of the card's; or none."
        ),
        "law": click.option("--linear", "law", flag_value="linear", help="Force the linear frequency law."),
        "exact": click.option("--exact", "law", flag_value="exact", help="Force the exact frequency law."),
        "robust": click.option("--robust", is_flag=True, help="Student-t noise: one wrong mode has less say."),
        "coefficients": click.option(
            "--coefficients",
            type=click.Choice(["sensitivity", "training", "published"]),
            help="Source of the paper's coefficients (default: the table that the card names, else sensitivity).",
        ),
        "write_to": click.option("--out", type=click.Path(), help="Folder for compare.json (default: not written)."),
        "force": click.option("--force", is_flag=True, help="Replace the results in the output folder."),
        "report": click.option(
            "--no-report", "report", is_flag=True, default=True, flag_value=False, help="Write no page and no figures."
        ),
        "resume": click.option("--resume", is_flag=True, help="Continue an interrupted run."),
        "json": click.option("--json", "as_json", is_flag=True, help="Print JSON instead of tables."),
        "quiet": click.option("--quiet", is_flag=True, help="Print nothing but errors."),
        "debug": click.option("--debug", is_flag=True, help="Show the traceback of an error."),
    }

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        for name in reversed(wanted):
            command = known[name](command)
        return command

    return decorate


@click.group(cls=Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="bayesplate")
def main() -> None:
    """Learn the elastic constants of a rectangular plate from its modes.

    CARD is the name of a shipped board or the path of a card (a .toml file).
    """
    # Thousands of small matrices: more than one thread each only waits for the others. Before numpy is loaded.
    for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, "1")


@main.command()
@click.argument("card")
@_options("effects", "json", "quiet", "debug")
def check(card: str, effects: str | None, as_json: bool, quiet: bool, debug: bool) -> None:
    """Every fault of CARD, or what would be fitted and what it can identify."""
    with _reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.check import check as run
        from bayesplate.workflow.shown import show_check

        report = run(card, effects=_names(effects))
        if as_json:
            _print_json(report)
        elif not quiet:
            _print(show_check(report))


@main.command()
@click.argument("card")
@_options("out", "seed", "effects", "law", "exact", "robust", "report", "force", "resume", "json", "quiet", "debug")
def fit(
    card: str,
    out: str | None,
    seed: int,
    effects: str | None,
    law: Any,
    robust: bool,
    report: bool,
    force: bool,
    resume: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Posterior of the elastic constants of CARD: report.html, summary.json, posterior.nc."""
    if force and resume:
        raise click.UsageError("--force starts anew and --resume continues: give one of them.")
    with _reporting(as_json=as_json, debug=debug, resumable=True):
        with _progress(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.fit import fit as run

            result = run(
                card,
                out=out,
                seed=seed,
                effects=_names(effects),
                law=law,
                robust=robust,
                report=report,
                force=force,
                resume=resume,
                progress=tell,
            )
        if as_json:
            _print_json(result.summary)
        elif not quiet:
            from bayesplate.workflow.shown import show_fit

            _print(show_fit(result.summary))
            click.echo(f"written to {result.folder}")


@main.command()
@click.argument("card")
@_options("out", "seed", "effects", "force", "json", "quiet", "debug")
def modes(
    card: str, out: str | None, seed: int, effects: str | None, force: bool, as_json: bool, quiet: bool, debug: bool
) -> None:
    """Table of the lowest modes of CARD, and a sheet of Chladni figures."""
    with _reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.modes import modes as run
        from bayesplate.workflow.shown import show_modes

        result = run(card, out=out, seed=seed, effects=_names(effects), force=force)
        if as_json:
            _print_json(result.report)
        elif not quiet:
            _print(show_modes(result.report))


@main.command()
@click.argument("card")
@_options("coefficients", "write_to", "seed", "effects", "force", "json", "quiet", "debug")
def compare(
    card: str,
    coefficients: Any,
    out: str | None,
    seed: int,
    effects: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Every method on CARD side by side, as a thin and as a shear-flexible plate."""
    with _reporting(as_json=as_json, debug=debug):
        with _progress(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.compare import compare as run

            result = run(
                card,
                coefficients=coefficients,
                seed=seed,
                effects=_names(effects),
                out=out,
                force=force,
                progress=tell,
            )
        if as_json:
            _print_json(result)
        elif not quiet:
            from bayesplate.workflow.shown import show_compare

            _print(show_compare(result))


@main.command()
@click.argument("card")
@_options("out", "seed", "effects", "force", "resume", "json", "quiet", "debug")
def diagnose(
    card: str,
    out: str | None,
    seed: int,
    effects: str | None,
    force: bool,
    resume: bool,
    as_json: bool,
    quiet: bool,
    debug: bool,
) -> None:
    """Trace the residual of CARD to an effect, add it, and report the error before and after."""
    if force and resume:
        raise click.UsageError("--force starts anew and --resume continues: give one of them.")
    with _reporting(as_json=as_json, debug=debug, resumable=True):
        with _progress(shown=not quiet and not as_json) as tell:
            from bayesplate.workflow.diagnose import diagnose as run

            result = run(
                card, out=out, seed=seed, effects=_names(effects), force=force, resume=resume, progress=tell
            )
        if as_json:
            _print_json(result.diagnosis)
        elif not quiet:
            from bayesplate.workflow.shown import show_diagnosis

            _print(show_diagnosis(result.diagnosis))
            click.echo(f"written to {result.folder}")


@main.command()
@click.argument("card")
@_options("effects", "json", "quiet", "debug")
def cite(card: str, effects: str | None, as_json: bool, quiet: bool, debug: bool) -> None:
    """References of exactly what a fit of CARD uses."""
    with _reporting(as_json=as_json, debug=debug):
        from bayesplate.workflow.cite import cite as run
        from bayesplate.workflow.cite import cite_text

        sections = run(card, effects=_names(effects))
        if as_json:
            _print_json({section.title.lower(): list(section.entries) for section in sections})
        elif not quiet:
            click.echo(cite_text(sections), nl=False)


def _print(shown: Shown) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console(soft_wrap=False, highlight=False)
    with console.capture() as printed:
        for table in shown.tables:
            laid_out = Table(title=Text(table.title), title_justify="left", title_style="bold")
            for i, column in enumerate(table.columns):
                laid_out.add_column(Text(column), justify="left" if i == 0 else "right", no_wrap=i == 0)
            for row in table.rows:
                laid_out.add_row(*(Text(cell) for cell in row))
            console.print(laid_out)
        for sentence in [*(f"- {text}" for text in shown.remarks), *(f"! {text}" for text in shown.warnings)]:
            console.print(Text(sentence))
        console.print(Text(shown.closing))
    click.echo(printed.get(), nl=False)  # rich itself would exit with 1 where a reader like `head` has closed the pipe


def _print_json(content: Mapping[str, Any]) -> None:
    from bayesplate.workflow.shown import json_text

    click.echo(json_text(content), nl=False)


def _names(effects: str | None) -> list[str] | None:
    """Effects from a comma-separated list; none at all from "none"."""
    if effects is None:
        return None
    return [name.strip() for name in effects.split(",") if name.strip() not in ("", "none")]


@contextmanager
def _progress(*, shown: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A status line on the standard error while sampling; a line now and then where that is no terminal."""
    if not shown:
        yield None
        return
    from rich.console import Console

    console = Console(stderr=True)
    with console.status("reading the card and solving the plate") as status:

        def tell(progress: Progress) -> None:
            from bayesplate.workflow.shown import progress_text

            text = progress_text(progress)
            if console.is_terminal:
                status.update(text)
            elif progress.n_steps % 1000 == 0:
                click.echo(text, err=True)

        yield tell


@contextmanager
def _reporting(*, as_json: bool, debug: bool, resumable: bool = False) -> Iterator[None]:
    """Turn errors into one message and an exit code, and signals to stop into an interruption."""

    def interrupt(signum: int, frame: object) -> None:
        signal.signal(signum, signal.SIG_IGN)  # a second one must not disturb the farewell of the first
        raise KeyboardInterrupt

    # A run in the background of a shell ignores interrupts, and goes on doing so.
    heeded = [s for s in (signal.SIGTERM, signal.SIGINT) if signal.getsignal(s) != signal.SIG_IGN]
    before = {s: signal.signal(s, interrupt) for s in heeded}
    try:
        yield
    except BayesplateError as error:
        if debug:
            traceback.print_exc()
        _fail(str(error), error.exit_code, as_json, [vars(fault) for fault in error.faults])
    except KeyboardInterrupt:
        remedy = "; --resume continues from the last checkpoint" if resumable else ""
        _fail(f"interrupted{remedy}", INTERRUPTED, as_json)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except Exception as error:
        if debug:
            traceback.print_exc()
        _fail(f"internal error: {type(error).__name__}: {error} (--debug shows where)", INTERNAL, as_json)
    finally:
        for heard, handler in before.items():
            signal.signal(heard, handler)


def _fail(message: str, code: int, as_json: bool, faults: Sequence[Mapping[str, str]] = ()) -> None:
    click.echo(message, err=True)
    if as_json:
        click.echo(json.dumps({"error": {"exit_code": code, "message": message, "faults": list(faults)}}, indent=2))
    sys.exit(code)


if __name__ == "__main__":
    main()
