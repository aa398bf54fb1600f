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

from bayesplate.errors import BayesplateError, Fault, UnwritableError, printable

if TYPE_CHECKING:
    from bayesplate.commands.printout import Printout, Progress

EXIT_INTERRUPTED = 130
EXIT_INTERNAL = 70
_NARROWEST_WIDTH, _USUAL_WIDTH = 20, 80
"""Columns of a terminal."""


def print_tables(printout: Printout) -> None:
    """Print tables, remarks, warnings and the closing words on the standard output."""
    from rich.console import Console

    # Laid out apart from the output: rich itself would end the program where a reader like `head` has closed the pipe.
    output = Console()
    width = output.width if output.width >= _NARROWEST_WIDTH else _USUAL_WIDTH  # COLUMNS=0 is no terminal
    _write(printout.printed(width, styled=output.is_terminal))


def print_json(content: Any) -> None:
    """Print the result of a command as JSON, for other programs."""
    from bayesplate.commands.printout import json_text

    _write(json_text(content))


def print_text(text: str) -> None:
    """Print a text, codes of the terminal escaped: the name of a folder may hold them. Raises UnwritableError."""
    _write("\n".join(printable(line) for line in text.split("\n")) + "\n")


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
    """Discard the rest of the standard output, or of another stream, of which Python would complain at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), (stream or sys.stdout).fileno())


class _StandardError:
    """The standard error; a run goes on where it cannot be written: a closed pipe, a lost terminal."""

    def write(self, text: str) -> int:
        """Write at once; discard what cannot be written."""
        if sys.stderr is not None:
            try:
                sys.stderr.write(text)
                sys.stderr.flush()
            except OSError:
                _close_output(sys.stderr)
        return len(text)

    def flush(self) -> None:
        """Nothing is buffered."""

    def __getattr__(self, name: str) -> Any:
        """Whether it is a terminal, its encoding."""
        return getattr(sys.stderr, name)


_STANDARD_ERROR = cast(IO[str], _StandardError())


@contextmanager
def progress_line(*, is_shown: bool) -> Iterator[Callable[[Progress], None] | None]:
    """A status line on the standard error while a command runs; a line now and then where that is no terminal."""
    if not is_shown:
        yield None
        return
    from rich.console import Console

    console, started, stage = Console(file=_STANDARD_ERROR), monotonic(), ""
    with console.status("reading the card and solving the plate") as status:
        # Imported now, and not at the first message: Python gives another exit code to a run that is interrupted while
        # it defines classes of an import by executing text.
        from bayesplate.commands.printout import progress_text

        def tell(progress: Progress) -> None:
            nonlocal stage
            text = progress_text(progress, monotonic() - started)
            if console.is_terminal:
                status.update(text)
            elif progress.stage != stage or (progress.n_steps % 1000 == 0 and progress.n_steps):
                click.echo(text, file=_STANDARD_ERROR)
            stage = progress.stage

        yield tell


@contextmanager
def exit_on_error(*, as_json: bool, debug: bool) -> Iterator[None]:
    """Turn errors into one message and an exit code, and signals to stop into an interruption."""

    def interrupt(signum: int, frame: object) -> None:
        signal.signal(signum, signal.SIG_IGN)  # a second one must not cut off the message of the first
        raise KeyboardInterrupt

    # A run in the background of a shell ignores interrupts, and goes on doing so.
    signals = [s for s in (signal.SIGTERM, signal.SIGINT) if signal.getsignal(s) != signal.SIG_IGN]
    handlers = {s: signal.signal(s, interrupt) for s in signals}
    try:
        yield
    except BayesplateError as error:
        if debug:
            traceback.print_exc(file=_STANDARD_ERROR)
        _exit_with_message(str(error), error.exit_code, as_json, [vars(fault) for fault in error.faults])
    except (KeyboardInterrupt, click.Abort) as interruption:  # at a question both keys that end it abort
        _exit_with_message(str(interruption) or "interrupted", EXIT_INTERRUPTED, as_json)
    except BrokenPipeError:
        _close_output()
        sys.exit(0)
    except click.ClickException:
        raise  # click tells of options that exclude each other
    except Exception as error:
        if debug:
            traceback.print_exc(file=_STANDARD_ERROR)
        _exit_with_message(
            f"internal error: {type(error).__name__}: {error} (--debug shows where)", EXIT_INTERNAL, as_json
        )
    finally:
        for signum, handler in handlers.items():
            signal.signal(signum, handler)


def _exit_with_message(message: str, code: int, as_json: bool, faults: Sequence[Mapping[str, str]] = ()) -> None:
    click.echo("\n".join(printable(line) for line in message.split("\n")), file=_STANDARD_ERROR)
    if as_json:
        with suppress(UnwritableError):  # the message has been given
            _write(
                json.dumps({"error": {"exit_code": code, "message": message, "faults": list(faults)}}, indent=2) + "\n"
            )
    sys.exit(code)
