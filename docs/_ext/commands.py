"""The directive `command`: a command of the command line, run while the documentation is built, and what it prints.

    ```{command} check half-top.toml
    :exit: 3
    ```

It runs in a folder that holds copies of `docs/cards`, the cards of `designs.py` and the recordings of `taps.py`. What
is shown was printed by this very version; a command that ends with another exit code than the one given stops the
build.
"""

from __future__ import annotations

import contextlib
import shlex
import shutil
import textwrap
from pathlib import Path
from typing import Any, ClassVar

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

from designs import write_designs
from taps import write_taps

WIDTH = 92
"""Columns of the terminal that the commands believe to print on."""
FOLDED_AT = 100
"""Messages are not laid out for a terminal: lines longer than this are folded as one would do it."""

LEFT_OUT = "[...]"
_printed: dict[tuple[str, Path], tuple[int, str]] = {}


def bench(source: Path) -> Path:
    """The folder that the commands run in."""
    return source / "_generated" / "bench"


def setup(app: Any) -> dict[str, Any]:
    """Register the directive and clear the bench before each build."""
    app.add_directive("command", Command)
    app.connect("builder-inited", _clear_the_bench)
    return {"parallel_read_safe": False}


def _clear_the_bench(app: Any) -> None:
    folder = bench(Path(app.srcdir))
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(Path(app.srcdir) / "cards", folder)
    write_designs(folder)
    write_taps(folder)
    _printed.clear()


def printed(command: str, folder: Path) -> tuple[int, str]:
    """Exit code of a command and what it prints; each command runs once a build."""
    if (command, folder) not in _printed:
        from click.testing import CliRunner

        from bayesplate.cli import main

        with contextlib.chdir(folder):
            result = CliRunner(env={"COLUMNS": str(WIDTH)}).invoke(main, shlex.split(command))
        text = result.stdout if result.exit_code == 0 else result.stdout + result.stderr
        _printed[command, folder] = result.exit_code, text
    return _printed[command, folder]


def _as_in_a_terminal(line: str) -> list[str]:
    """A long line, folded."""
    return textwrap.wrap(line, FOLDED_AT, break_on_hyphens=False, subsequent_indent="  ") or [""]


class Command(SphinxDirective):
    """A command and its output; `from` and `until` show the lines between two that contain these words."""

    required_arguments = 1
    final_argument_whitespace = True
    option_spec: ClassVar[dict[str, Any]] = {
        "exit": directives.nonnegative_int,
        "from": directives.unchanged_required,
        "until": directives.unchanged_required,
        "silent": directives.flag,
    }

    def run(self) -> list[nodes.Node]:
        """Run the command and show it."""
        command = self.arguments[0]
        wanted = self.options.get("exit", 0)
        code, text = printed(command, bench(Path(self.env.srcdir)))
        if code != wanted:
            raise ExtensionError(f"{self.env.docname}: bayesplate {command} ended with {code}, not {wanted}:\n{text}")
        if "silent" in self.options:
            return []
        lines = self._between([line for long in text.splitlines() for line in _as_in_a_terminal(long)])
        shown = "\n".join([f"$ bayesplate {command}", *lines])
        block = nodes.literal_block(shown, shown, classes=["printed"])
        block["language"] = "text"
        return [block]

    def _between(self, lines: list[str]) -> list[str]:
        first = self._line(lines, "from", 0)
        last = self._line(lines, "until", len(lines) - 1)
        before = [LEFT_OUT] if first > 0 else []
        after = [LEFT_OUT] if last < len(lines) - 1 else []
        return [*before, *lines[first : last + 1], *after]

    def _line(self, lines: list[str], option: str, default: int) -> int:
        words = self.options.get(option)
        if words is None:
            return default
        for number, line in enumerate(lines):
            if words in line:
                return number
        raise ExtensionError(f"{self.env.docname}: no line of bayesplate {self.arguments[0]} contains {words!r}")
