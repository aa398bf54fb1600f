"""Runs of the command line as tests see them: exit code, both outputs, and the files that are left."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from bayesplate.cli import main
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import SamplerSettings

LOOSE_GATE = Gate(rhat_max=10.0, tau_count_min=1.0, ess_min=1.0)
"""Passes at its first judgement: for tests of files, pages and options, not of constants."""


def sample_loosely(patch: pytest.MonkeyPatch, module: str = "fitting") -> None:
    """Let the sampler of a module of commands pass its first judgement."""
    patch.setattr(f"bayesplate.commands.{module}.SamplerSettings", partial(SamplerSettings, gate=LOOSE_GATE))


@dataclass(frozen=True)
class Run:
    """What a command left."""

    exit_code: int
    stdout: str
    stderr: str
    folder: Path

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json."""
        return read_json((self.folder / "summary.json").read_text(encoding="utf-8"))

    @property
    def files(self) -> dict[str, bytes]:
        """Content of every file in the output folder, by its path inside."""
        return files_in(self.folder)


def fit(folder: Path, *arguments: str) -> Run:
    """Run `bayesplate fit` in this process, its output in `folder`."""
    result = CliRunner().invoke(main, ["fit", *arguments, "--out", str(folder)])
    return Run(result.exit_code, result.stdout, result.stderr, folder)


def files_in(folder: Path) -> dict[str, bytes]:
    """Content of every file below a folder, by its path inside; empty if there is no such folder."""
    paths = (path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def read_json(text: str) -> dict[str, Any]:
    """JSON of numbers that JSON has: Python's reader alone would accept NaN and Infinity."""

    def refuse(word: str) -> None:
        raise ValueError(f"{word} is no JSON")

    return json.loads(text, parse_constant=refuse)
