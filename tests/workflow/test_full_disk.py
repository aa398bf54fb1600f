"""A full disk: the path is named, nothing half-written stays, and what was sampled can be resumed."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
import runs
from click.testing import CliRunner

from bayesplate.cli import main

BOARD = "fiemme-spruce-clamped"
REASON = "No space left on device"


@pytest.fixture
def full_at(monkeypatch):
    """Let the disk be full when the file of a name is to take its place: every file here is written by a rename."""

    def fill(name: str) -> None:
        def replace(source, target, rename=os.replace):
            if Path(target).name == name:
                raise OSError(errno.ENOSPC, REASON)
            rename(source, target)

        monkeypatch.setattr(os, "replace", replace)

    return fill


@pytest.mark.parametrize("name", ["chunk-0001.npz", "posterior.nc", "summary.json", "report.html", "sampler.png"])
@pytest.mark.usefixtures("quickly")
def test_a_fit_keeps_what_it_sampled(name, full_at, tmp_path):
    full_at(name)
    run = runs.fit(tmp_path / "out", BOARD)
    left = run.files

    assert run.exit_code == 6
    assert REASON in run.stderr
    assert "internal error" not in run.stderr
    assert name in run.stderr or (name == "sampler.png" and "report.html" in run.stderr)
    assert "resume" in run.stderr
    assert "checkpoint/linear/chunk-0000.npz" in left
    assert [path for path in left if path.endswith((".partial", name))] == []


@pytest.mark.parametrize(
    ("command", "name"), [pytest.param("compare", "compare.json", marks=pytest.mark.slow), ("modes", "modes.svg")]
)
def test_what_keeps_no_checkpoint_names_the_file(command, name, full_at, tmp_path):
    full_at(name)
    result = CliRunner().invoke(main, [command, BOARD, "--out", str(tmp_path / "out")])

    assert result.exit_code == 3
    assert f"{tmp_path / 'out' / name}: wanted a file that can be written, got {REASON}" in result.stderr
    assert [path for path in runs.files_in(tmp_path) if path.endswith((".partial", name))] == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
@pytest.mark.parametrize("options", [("--json",), ()])
def test_an_output_that_cannot_be_written_is_one_line(options):
    program = [sys.executable, "-m", "bayesplate.cli", "check", BOARD, *options]
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(program, stdout=full, stderr=subprocess.PIPE, text=True, check=False)

    assert done.returncode == 3
    assert done.stderr == f"standard output: wanted a place that can be written, got {REASON}\n"
