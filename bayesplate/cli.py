"""The command line: the public functions as commands, and what each prints; no logic of its own."""

from __future__ import annotations

import inspect
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from shlex import quote
from typing import TYPE_CHECKING, Any

import click

import bayesplate
from bayesplate.asking import ask_card_arguments
from bayesplate.terminal import exit_on_error, print_json, print_tables, print_text, progress_line

if TYPE_CHECKING:
    from bayesplate.commands.options import Option, OptionGroup
    from bayesplate.commands.printout import Printout

_SHARED_ARGUMENTS = ("out", "seed", "effects", "setup", "law", "robust", "report", "force", "resume")
"""Arguments that several commands take, in the order of the help: after those that a command has alone."""


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
            matches = get_close_matches(args[0], self.list_commands(ctx), n=1)
            hint = f" Did you mean {matches[0]!r}?" if matches else ""
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
class CommandOutput:
    """Result of a command and what is printed of it; `final_check` is called last and may raise its error."""

    content: Any  # what `--json` prints
    make_printout: Callable[[], Printout] | None = None
    closing: str = ""  # where things were written, and what comes next
    final_check: Callable[[], None] | None = None

    def print(self, *, as_json: bool, quiet: bool) -> None:
        """Print JSON, or tables and the closing sentence, or nothing."""
        if as_json:
            print_json(self.content)
        elif not quiet:
            if self.make_printout is not None:
                print_tables(self.make_printout())
            if self.closing:
                print_text(self.closing)


class Command(click.Command):
    """A public function as a command of its name, with options that follow from its signature.

    The function, and with it the libraries, is loaded when the command is called or its help is read.
    """

    def __init__(self, answer: Callable[..., CommandOutput]) -> None:
        super().__init__(answer.__name__, callback=self._run, help=inspect.getdoc(answer))
        self._compute = answer

    @cached_property
    def _function(self) -> Callable[..., Any]:
        function: Callable[..., Any] = getattr(bayesplate, self._compute.__name__)
        return function

    @cached_property
    def _arguments(self) -> Mapping[str, inspect.Parameter]:
        """Parameters of the function itself, without those of its wrappers."""
        return inspect.signature(inspect.unwrap(self._function)).parameters

    @cached_property
    def _options(self) -> dict[str, Option | OptionGroup]:
        from bayesplate.commands.options import options_of

        options = options_of(self._function)
        unshared = [name for name in options if name not in _SHARED_ARGUMENTS]
        return {name: options[name] for name in (*unshared, *_SHARED_ARGUMENTS) if name in options}

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Options of the function, and those of the printing."""
        if not self.params:
            for name, option in self._options.items():
                self.params += option.parameters(name, self._arguments[name].default)
            self.params += _printing_options()
        return super().get_params(ctx)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Load what is needed, which can be interrupted, and read the arguments."""
        with exit_on_error(as_json="--json" in args, debug="--debug" in args):
            self.get_params(ctx)
        return super().parse_args(ctx, args)

    def _run(self, as_json: bool, quiet: bool, debug: bool, **values: Any) -> None:
        from bayesplate.commands.arguments import contradictions

        has_progress = "progress" in self._arguments
        with exit_on_error(as_json=as_json, debug=debug):
            about = values[next(iter(self._options))]
            arguments = {name: option.value(name, values, about) for name, option in self._options.items()}
            for fault in contradictions(arguments):
                raise click.UsageError(str(fault))
            with progress_line(is_shown=has_progress and not quiet and not as_json) as tell:
                arguments |= {"progress": tell}
                output = self._compute(
                    self._function, **{name: value for name, value in arguments.items() if value is not None}
                )
            output.print(as_json=as_json, quiet=quiet)
        if output.final_check is not None:
            with exit_on_error(as_json=False, debug=debug):
                output.final_check()


def _printing_options() -> list[click.Parameter]:
    return [
        click.Option(["--json", "as_json"], is_flag=True, help="Print JSON instead of tables."),
        click.Option(["--quiet"], is_flag=True, help="Print nothing but errors."),
        click.Option(["--debug"], is_flag=True, help="Show the traceback of an error."),
    ]


def command(answer: Callable[..., CommandOutput]) -> Command:
    """A command of the public function that has the same name."""
    new_command = Command(answer)
    main.add_command(new_command)
    return new_command


@command
def check(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Every fault of CARD, or what a fit of it can identify."""
    report = run(**options)
    return CommandOutput(report, report.printout)


@command
def fit(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Posterior of the elastic constants of CARD.

    Writes report.html, summary.json and posterior.nc.
    """
    result = run(**options)
    return CommandOutput(result.summary, result.printout, f"written to {result.folder}")


@command
def modes(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Lowest modes of CARD, and a sheet of their Chladni figures."""
    result = run(**options)
    return CommandOutput(result.summary, result.printout)


@command
def compare(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Every method on CARD side by side.

    Each as a thin and as a shear-flexible plate.
    """
    result = run(**options)
    return CommandOutput(result, result.printout)


@command
def diagnose(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Trace what the plate model misses on CARD to a physical effect.

    Adds the effect, and reports the error before and after.
    """
    result = run(**options)
    return CommandOutput(result.to_json(), result.printout, f"written to {result.folder}")


@command
def plan(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """What to measure next on CARD.

    Ranks measurements by what they are expected to give and what they cost.
    """
    result = run(**options)
    closing = f"written to {options['out']}: {', '.join(path.name for path in result.files)}"
    return CommandOutput(result.summary, result.printout, closing)


@command
def new(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Write a first card to PATH.

    It asks, or takes the options where there are any.
    """
    path, stated = options.get("path"), {name: value for name, value in options.items() if value and name != "path"}
    printing = click.get_current_context().params
    may_ask = not stated and not printing["as_json"] and not printing["quiet"]
    if not may_ask and not stated and path is None:
        raise click.UsageError("--json and --quiet ask no question: give PATH, or what the card is to say.")
    card_arguments = ask_card_arguments(path) if may_ask else {"path": path or "my-board", **stated}
    card = run(**card_arguments)
    quoted = quote(str(card))
    following = (
        f"check {quoted}, which tells every fault, or what it can say"
        if card_arguments.get("frequencies")
        else f"modes {quoted}, which shows the figures and where to listen; bayesplate plan {quoted}, where to tap; "
        f"with frequencies bayesplate check {quoted}"
    )
    return CommandOutput({"path": str(card)}, closing=f"written to {card}. Next: bayesplate {following}")


@command
def pick(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Frequencies of the modes in recordings FILES.

    Writes the [setup] that a card takes, too.
    """
    from bayesplate.commands.pick import FRAGMENT_FILE, PICK_PAGE_FILE

    out = options["out"]
    result = run(**options)
    fit_arguments = f"{quote(options.get('card') or 'CARD')} --setup {quote(f'{out}/{FRAGMENT_FILE}')}"
    closing = f"written to {out}: {FRAGMENT_FILE}, {PICK_PAGE_FILE}. Next: bayesplate fit {fit_arguments}"
    return CommandOutput(result.summary, result.printout, closing)


@command
def cite(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """References of exactly what a fit of CARD uses."""
    from bayesplate.commands.cite import cite_text

    sections = run(**options)
    content = {section.title.lower(): list(section.entries) for section in sections}
    return CommandOutput(content, closing=cite_text(sections).removesuffix("\n"))


@command
def batch(run: Callable[..., Any], **options: Any) -> CommandOutput:
    """Fit many boards: a folder of cards, or the rows of a table.

    One table of all, and a page that grades them. SOURCE is the folder or the table.
    """
    result = run(**options)
    closing = f"written to {result.folder}"
    return CommandOutput(result.summary, result.printout, closing, result.require_all)
