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
from bayesplate.asking import asked_answers
from bayesplate.terminal import print_json, print_shown, progress_line, reporting, say

if TYPE_CHECKING:
    from bayesplate.commands.options import Joined, Option
    from bayesplate.commands.shown import Shown

_SHARED = ("out", "seed", "effects", "setup", "law", "robust", "report", "force", "resume")
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
    """What a command found, and what it prints; an error of `then`, called at the end, is the command's."""

    content: Any  # what `--json` prints
    shown: Callable[[], Shown] | None = None
    closing: str = ""  # where things were written, and what comes next
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


class Command(click.Command):
    """A public function as a command of its name: what it takes is what the signature says.

    The function, and with it the libraries, is loaded when the command is called or its help is read.
    """

    def __init__(self, answer: Callable[..., Answer]) -> None:
        super().__init__(answer.__name__, callback=self._run, help=inspect.getdoc(answer))
        self._answer = answer

    @cached_property
    def _function(self) -> Callable[..., Any]:
        found: Callable[..., Any] = getattr(bayesplate, self._answer.__name__)
        return found

    @cached_property
    def _arguments(self) -> Mapping[str, inspect.Parameter]:
        """Parameters of the function itself, without those of its wrappers."""
        return inspect.signature(inspect.unwrap(self._function)).parameters

    @cached_property
    def _options(self) -> dict[str, Option | Joined]:
        from bayesplate.commands.options import options_of

        found = options_of(self._function)
        alone = [name for name in found if name not in _SHARED]
        return {name: found[name] for name in (*alone, *_SHARED) if name in found}

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Parameters of the function, and those of the printing."""
        if not self.params:
            for name, part in self._options.items():
                self.params += part.parameters(name, self._arguments[name].default)
            self.params += _printing()
        return super().get_params(ctx)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Load what is needed, which can be interrupted, and read the arguments."""
        with reporting(as_json="--json" in args, debug="--debug" in args):
            self.get_params(ctx)
        return super().parse_args(ctx, args)

    def _run(self, as_json: bool, quiet: bool, debug: bool, **told: Any) -> None:
        from bayesplate.commands.arguments import contradictions

        has_progress = "progress" in self._arguments
        with reporting(as_json=as_json, debug=debug):
            about = told[next(iter(self._options))]
            given = {name: part.value(name, told, about) for name, part in self._options.items()}
            for fault in contradictions(given):
                raise click.UsageError(str(fault))
            with progress_line(shown=has_progress and not quiet and not as_json) as tell:
                given |= {"progress": tell}
                answer = self._answer(
                    self._function, **{name: value for name, value in given.items() if value is not None}
                )
            answer.print(as_json=as_json, quiet=quiet)
        if answer.then is not None:
            with reporting(as_json=False, debug=debug):
                answer.then()


def _printing() -> list[click.Parameter]:
    return [
        click.Option(["--json", "as_json"], is_flag=True, help="Print JSON instead of tables."),
        click.Option(["--quiet"], is_flag=True, help="Print nothing but errors."),
        click.Option(["--debug"], is_flag=True, help="Show the traceback of an error."),
    ]


def command(answer: Callable[..., Answer]) -> Command:
    """A command of the public function that has the same name."""
    made = Command(answer)
    main.add_command(made)
    return made


@command
def check(run: Callable[..., Any], **asked: Any) -> Answer:
    """Every fault of CARD, or what a fit of it can identify."""
    report = run(**asked)
    return Answer(report, report.shown)


@command
def fit(run: Callable[..., Any], **asked: Any) -> Answer:
    """Posterior of the elastic constants of CARD.

    Writes report.html, summary.json and posterior.nc.
    """
    result = run(**asked)
    return Answer(result.summary, result.shown, f"written to {result.folder}")


@command
def modes(run: Callable[..., Any], **asked: Any) -> Answer:
    """Lowest modes of CARD, and a sheet of their Chladni figures."""
    result = run(**asked)
    return Answer(result.summary, result.shown)


@command
def compare(run: Callable[..., Any], **asked: Any) -> Answer:
    """Every method on CARD side by side.

    Each as a thin and as a shear-flexible plate.
    """
    result = run(**asked)
    return Answer(result, result.shown)


@command
def diagnose(run: Callable[..., Any], **asked: Any) -> Answer:
    """Trace what the plate model misses on CARD to a physical effect.

    Adds the effect, and reports the error before and after.
    """
    result = run(**asked)
    return Answer(result.to_json(), result.shown, f"written to {result.folder}")


@command
def plan(run: Callable[..., Any], **asked: Any) -> Answer:
    """What to measure next on CARD.

    Ranks measurements by what they are expected to give and what they cost.
    """
    result = run(**asked)
    closing = f"written to {asked['out']}: {', '.join(path.name for path in result.files)}"
    return Answer(result.summary, result.shown, closing)


@command
def new(run: Callable[..., Any], **asked: Any) -> Answer:
    """Write a first card to PATH.

    It asks, or takes the options where there are any.
    """
    path, given = asked.get("path"), {name: value for name, value in asked.items() if value and name != "path"}
    printing = click.get_current_context().params
    may_ask = not given and not printing["as_json"] and not printing["quiet"]
    told = asked_answers(path) if may_ask else {"path": path or "my-board", **given}
    card = run(**told)
    shown = quote(str(card))
    following = (
        f"check {shown}, which tells every fault, or what it can say"
        if told.get("frequencies")
        else f"modes {shown}, which shows the figures and where to listen; bayesplate plan {shown}, where to tap; "
        f"with frequencies bayesplate check {shown}"
    )
    return Answer({"path": str(card)}, closing=f"written to {card}. Next: bayesplate {following}")


@command
def pick(run: Callable[..., Any], **asked: Any) -> Answer:
    """Frequencies of the modes in recordings FILES.

    Writes the [setup] that a card takes, too.
    """
    from bayesplate.commands.pick import FRAGMENT, PAGE

    out = asked["out"]
    result = run(**asked)
    completes = f"{quote(asked.get('card') or 'CARD')} --setup {quote(f'{out}/{FRAGMENT}')}"
    closing = f"written to {out}: {FRAGMENT}, {PAGE}. Next: bayesplate fit {completes}"
    return Answer(result.summary, result.shown, closing)


@command
def cite(run: Callable[..., Any], **asked: Any) -> Answer:
    """References of exactly what a fit of CARD uses."""
    from bayesplate.commands.cite import cite_text

    sections = run(**asked)
    content = {section.title.lower(): list(section.entries) for section in sections}
    return Answer(content, closing=cite_text(sections).removesuffix("\n"))


@command
def batch(run: Callable[..., Any], **asked: Any) -> Answer:
    """Fit many boards: a folder of cards, or the rows of a table.

    One table of all, and a page that grades them. SOURCE is the folder or the table.
    """
    result = run(**asked)
    closing = f"written to {result.folder}"
    return Answer(result.summary, result.shown, closing, result.require_all)
