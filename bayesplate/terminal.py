"""How the command line talks: tables, progress, errors as one message with an exit code, and signals to stop."""

from __future__ import annotations

import json
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from time import monotonic
from typing import IO, TYPE_CHECKING, Any, TextIO, cast

import click

from bayesplate.errors import BayesplateError, Fault, UnwritableError, plain

if TYPE_CHECKING:
    from bayesplate.commands.shown import Progress, Shown

INTERRUPTED = 130
INTERNAL = 70
_NARROWEST, _USUAL = 20, 80
"""Columns of a terminal."""


def print_shown(shown: Shown) -> None:
    """Tables, remarks, warnings and the closing words on the standard output."""
    from rich.console import Console

    # Laid out apart from the output: rich itself would end the program where a reader like `head` has closed the pipe.
    output = Console()
    width = output.width if output.width >= _NARROWEST else _USUAL  # COLUMNS=0 is no terminal
    _write(shown.printed(width, styled=output.is_terminal))


def print_json(content: Any) -> None:
    """What a command found, for other programs."""
    from bayesplate.commands.shown import json_text

    _write(json_text(content))


def say(text: str, *, nl: bool = True) -> None:
    """Print a text; the name of a folder in it may hold anything, and steers nothing. Raises UnwritableError."""
    _write("\n".join(plain(line) for line in text.split("\n")) + "\n" * nl)


def _write(text: str) -> None:
    """Print what is ready for the standard output, with the codes of a terminal where it is one."""
    try:
        click.echo(text, nl=False)
    except BrokenPipeError:
        raise
    except OSError as error:
        _close_output()
        fault = Fault("standard output", "a place that can be written", error.strerror or str(error))
        raise UnwritableError(fault) from None


def _close_output(stream: TextIO | None = None) -> None:
    """Let the rest of the standard output, or of another stream, go nowhere: Python would complain of it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


class _Told:
    """The standard error of a run, which goes on where nobody can be told any more: a closed pipe, a lost terminal."""

    def write(self, text: str) -> int:
        """Write at once; what cannot be written goes nowhere."""
        if sys.stderr is not None:
            try:
                sys.stderr.write(text)
                sys.stderr.flush()
            except OSError:
                _close_output(sys.stderr)
        return len(text)

    def flush(self) -> None:
        """Nothing waits."""

    def __getattr__(self, name: str) -> Any:
        """Whether it is a terminal, its encoding."""
        return getattr(sys.stderr, name)


_TOLD = cast(IO[str], _Told())


@contextmanager
def progress_line(*, shown: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A status line on the standard error while at work; a line now and then where that is no terminal."""
    if not shown:
        yield None
        return
    from rich.console import Console

    console, started, stage = Console(file=_TOLD), monotonic(), ""
    with console.status("reading the card and solving the plate") as status:
        # Now, and not when first told: Python gives another exit code to a run that is interrupted while it defines
        # classes of an import by executing text.
        from bayesplate.commands.shown import progress_text

        def tell(progress: Progress) -> None:
            nonlocal stage
            text = progress_text(progress, monotonic() - started)
            if console.is_terminal:
                status.update(text)
            elif progress.stage != stage or (progress.n_steps % 1000 == 0 and progress.n_steps):
                click.echo(text, file=_TOLD)
            stage = progress.stage

        yield tell


@contextmanager
def reporting(*, as_json: bool, debug: bool) -> Iterator[None]:
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
            traceback.print_exc(file=_TOLD)
        _fail(str(error), error.exit_code, as_json, [vars(fault) for fault in error.faults])
    except (KeyboardInterrupt, click.Abort) as stopped:  # at a question both keys that end it abort
        _fail(str(stopped) or "interrupted", INTERRUPTED, as_json)
    except BrokenPipeError:
        _close_output()
        sys.exit(0)
    except click.ClickException:
        raise  # click tells of options that exclude each other
    except Exception as error:
        if debug:
            traceback.print_exc(file=_TOLD)
        _fail(f"internal error: {type(error).__name__}: {error} (--debug shows where)", INTERNAL, as_json)
    finally:
        for heard, handler in before.items():
            signal.signal(heard, handler)


def _fail(message: str, code: int, as_json: bool, faults: Sequence[Mapping[str, str]] = ()) -> None:
    click.echo("\n".join(plain(line) for line in message.split("\n")), file=_TOLD)
    if as_json:
        with suppress(UnwritableError):  # the message has been given
            _write(
                json.dumps({"error": {"exit_code": code, "message": message, "faults": list(faults)}}, indent=2) + "\n"
            )
    sys.exit(code)
