"""A full disk: the path is named, nothing half-written stays, and what was sampled can be resumed."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

import numpy as np
import pytest
import runs
from click.testing import CliRunner
from killed_runs import CHANGES, WRITES
from made_batches import write_cards
from made_recordings import hits, write_wav

from bayesplate.cli import main
from bayesplate.posterior.checkpoint import CHAINS

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


@pytest.mark.parametrize("name", ["summary.json", "sampler.png"])
@pytest.mark.usefixtures("quickly")
def test_a_fit_keeps_what_it_sampled_and_what_it_was_to_replace(name, full_at, tmp_path):
    full_at(name)
    out, earlier = tmp_path / "out", ("summary.json", "constants.csv", "figures/modes.png")
    (out / "figures").mkdir(parents=True)
    for one in earlier:
        (out / one).write_bytes(b"earlier")
    run = runs.fit(out, BOARD, "--force")
    left = run.files

    assert {left.pop(f"checkpoint/earlier/{one}") for one in earlier} == {b"earlier"}
    assert f"what was there before is in {out / 'checkpoint' / 'earlier'}" in run.stderr.replace("\n", "")
    assert run.exit_code == 6
    assert REASON in run.stderr
    assert "internal error" not in run.stderr
    assert name in run.stderr or (name == "sampler.png" and "report.html" in run.stderr)
    assert "resume" in run.stderr
    assert f"checkpoint/linear/{CHAINS}" in left
    assert [path for path in left if path.endswith((".partial", name))] == []


@pytest.mark.usefixtures("quickly")
def test_a_fit_that_can_save_nothing_leaves_what_it_was_to_replace(full_at, tmp_path):
    full_at(CHAINS)
    (tmp_path / "summary.json").write_bytes(b"earlier")
    run = runs.fit(tmp_path, BOARD, "--force")

    assert run.exit_code == 6
    assert REASON in run.stderr
    assert CHAINS in run.stderr
    assert run.files == {"summary.json": b"earlier"}


@pytest.fixture(scope="module")
def places(tmp_path_factory) -> dict[str, str]:
    """A folder with two cards that are refused, so that nothing is fitted; a recorded hit."""
    folder = tmp_path_factory.mktemp("places")
    force, heard = hits(np.random.default_rng(2), [0.05], (0.02, 0.02))
    return {
        "CARDS": str(write_cards(folder / "cards", names="")),
        "HIT": str(write_wav(folder / "hit.wav", 4000.0, force, heard)),
    }


@pytest.mark.parametrize(
    ("command", "place", "name"),
    [
        ("batch", "CARDS", "boards.jsonl"),
        ("pick", "HIT", "recordings.html"),
        ("modes", BOARD, "modes.svg"),
        pytest.param("compare", BOARD, "compare.json", marks=pytest.mark.slow),
    ],
)
def test_the_file_is_named_and_what_stood_in_its_place_stays(command, place, name, places, full_at, tmp_path):
    """But for what a batch makes anew from its beginning: there the earlier results are laid aside."""
    out = tmp_path / "out"
    out.mkdir()
    (out / name).write_bytes(b"earlier")
    full_at(name)
    result = CliRunner().invoke(main, [command, places.get(place, place), "--out", str(out), "--force"])

    assert result.exit_code == 3, result.output
    assert f"{out / name}: wanted a file that can be written, got {REASON}" in result.stderr
    left = runs.files_in(out)
    assert [path for path in left if path.endswith(".partial")] == []
    if name == "boards.jsonl":
        assert left[name].count(b"\n") == 2  # what --resume goes on from
    assert left[f"checkpoint/earlier/{name}" if command == "batch" else name] == b"earlier"


READ_ONLY = "Read-only file system"


@pytest.mark.parametrize(("command", "place", "code"), [("fit", BOARD, 6), ("pick", "HIT", 3)])
def test_a_folder_that_cannot_be_written_is_left_as_it_is(command, place, code, places, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    for name in ("summary.json", "diagnosis.json", "boards.csv", "setup.toml", "modes.svg"):
        (out / name).write_bytes(b"earlier")
    before = runs.files_in(out)

    def refuse(event: str, arguments: tuple[object, ...]) -> None:
        is_change = event in CHANGES or (event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITES)
        if refused and is_change and str(arguments[0]).startswith(str(out)) and not Path(str(arguments[0])).is_dir():
            raise OSError(errno.EROFS, READ_ONLY)

    refused = [True]
    sys.addaudithook(refuse)
    result = CliRunner().invoke(main, [command, places.get(place, place), "--out", str(out), "--force"])
    refused.clear()

    assert result.exit_code == code, result.output
    assert READ_ONLY in result.stderr
    assert runs.files_in(out) == before
