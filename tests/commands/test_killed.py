"""Killed at any moment and started again: the same bytes as if nothing had happened; nobody shares a folder."""

from __future__ import annotations

import os
import signal
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner
from killed_runs import SAMPLING, killed, quickly
from made_batches import write_cards
from made_campaigns import MASS, write_campaign
from runs import files_in

from bayesplate.cli import main
from bayesplate.commands.campaign_fit import fit_boards
from bayesplate.commands.fitting import Run
from bayesplate.errors import InputError
from bayesplate.locks import lock_folder
from bayesplate.posterior import checkpoint
from bayesplate.posterior.checkpoint import CHAINS
from bayesplate.results.folder import OutputFolder

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")

FIT = ("fit", "fiemme-spruce-clamped", "--quiet")
DIAGNOSE = ("diagnose", "paper-cantilever-fe", "--quiet", "--no-report")


@pytest.fixture
def arguments(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, ...]:
    """A command line without its folder; what runs in this process is as quick as what is killed in another."""
    for place in (*(f"{name}.SamplerSettings" for name in SAMPLING), "diagnose.full_search"):
        home, name = place.split(".")
        module = __import__(f"bayesplate.commands.{home}", fromlist=[name])
        monkeypatch.setattr(module, name, getattr(module, name))  # to be put back at the end
    for name in ("EVERY_SECONDS", "_LEAST_PAUSE"):
        monkeypatch.setattr(checkpoint, name, getattr(checkpoint, name))
    quickly()
    if request.param == "batch":
        return ("batch", str(write_cards(tmp_path / "cards", "abcd")), "--workers", "1", "--quiet", "--no-report")
    if request.param == "campaign":
        (tmp_path / "cards").mkdir()
        return ("diagnose", str(write_campaign(tmp_path / "cards", (MASS, MASS))), "--quiet", "--no-report")
    return {"fit and report": FIT, "diagnose": DIAGNOSE}[request.param]


def run(folder: Path, *arguments: str):
    return CliRunner().invoke(main, [*arguments, "--out", str(folder)])


def is_saved(folder: Path) -> bool:
    """Whether a run left something to go on from."""
    journals = [path.read_bytes() for path in folder.glob("boards.jsonl")]
    return any(folder.rglob(CHAINS)) or b"\n" in b"".join(journals)


def go_on(folder: Path, *arguments: str) -> None:
    """Resume as a user would: where nothing had been saved the message says that --force runs it anew."""
    was_saved = is_saved(folder)
    again = run(folder, *arguments, "--resume")
    if again.exit_code == 6:
        assert not was_saved, again.stderr
        assert "--force runs it anew" in again.stderr
        again = run(folder, *arguments, "--force")
    assert again.exit_code == (7 if arguments[0] == "batch" else 0), again.stderr


def folders_in(folder: Path) -> set[Path]:
    """Paths of the folders below one."""
    return {path.relative_to(folder) for path in folder.rglob("*") if path.is_dir()}


def moments(n: int, n_of: int, seed: int) -> list[int]:
    """So many moments of all, one in each of as many equal parts of the run."""
    ends = np.linspace(0, n_of, n + 1).astype(int)
    rng = np.random.default_rng(seed)
    return [int(rng.integers(first, last)) + 1 for first, last in pairwise(ends)]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "n"),
    [("fit and report", 20), ("diagnose", 20), ("batch", 20), ("campaign", 20)],
    indirect=["arguments"],
)
def test_killed_at_any_moment_and_resumed_the_files_are_the_same(tmp_path, arguments, n):
    """That the kills hit a run in progress is the negative control: what they leave is never the whole.

    At the last moments only folders are left to be removed.
    """
    n_of = killed(tmp_path / "whole", 0, *arguments)
    whole, folders = files_in(tmp_path / "whole"), folders_in(tmp_path / "whole")
    assert n_of > 20

    for moment in moments(n, n_of, seed=n):
        folder = tmp_path / f"killed-{moment}"
        assert killed(folder, moment, *arguments) == -signal.SIGKILL
        left = files_in(folder), folders_in(folder)
        go_on(folder, *arguments)
        assert left != (whole, folders) or moment == n_of, moment
        assert files_in(folder) == whole, moment


def test_a_checkpoint_that_is_removed_goes_part_by_part_and_the_first_last(tmp_path, monkeypatch):
    """Results are there by then; killed meanwhile a run can be resumed from what is left."""
    folder, remove, n_left = OutputFolder(tmp_path / "out"), os.unlink, 0

    def stops(*where, **how):
        nonlocal n_left
        n_left -= 1
        if n_left < 0:
            raise KeyboardInterrupt
        remove(*where, **how)

    monkeypatch.setattr(os, "unlink", stops)
    parts, found = ("before", "refit"), []
    for n_removed in range(20):
        for part in parts:
            (folder.checkpoint / part / "linear").mkdir(parents=True, exist_ok=True)
            (folder.checkpoint / part / "linear" / CHAINS).touch()
        n_left = n_removed
        with suppress(KeyboardInterrupt):
            folder.close()
        found.append([part for part in parts if (folder.checkpoint / part / "linear" / CHAINS).exists()])
        if not folder.checkpoint.exists():
            break

    assert [list(one) for one in dict.fromkeys(map(tuple, found))] == [["before", "refit"], ["before"], []]


@pytest.mark.parametrize("arguments", ["diagnose", "batch"], indirect=True)
def test_a_folder_that_another_run_holds_is_left_as_it_is(tmp_path, arguments):
    """Results of an earlier run and of the one in progress; without the other run the same command goes ahead."""
    folder = tmp_path / "out"
    folder.mkdir()
    for name in ("summary.json", "diagnosis.json", "boards.csv", "grading.html"):
        (folder / name).write_text("earlier")
    before = files_in(folder)
    with lock_folder(folder / "checkpoint"):
        refused = run(folder, *arguments, "--force")
        after = {name: data for name, data in files_in(folder).items() if name != "checkpoint/lock"}

    assert refused.exit_code == 6
    assert "wanted sole use, got another run" in refused.stderr
    assert after == before


def test_a_folder_that_another_run_has_used_meanwhile_is_not_new(tmp_path):
    folder = OutputFolder(tmp_path / "out")
    folder.require_usable(force=False, resume=False)
    folder.path.mkdir()
    (folder.path / "summary.json").write_text("of the other run")

    with pytest.raises(InputError, match="wanted a new folder, got one that exists"):
        folder.open(resume=False)
    folder.release()
    assert files_in(folder.path) == {"summary.json": b"of the other run"}


def test_force_lays_aside_what_runs_left_and_nothing_else_until_there_is_something_better(tmp_path):
    """Of a fit, of a diagnosis and of each board of a campaign; it comes back where the new run leaves nothing."""
    names = ["summary.json", "before/summary.json", "before/a/posterior.nc", "boards/a/summary.json"]
    names += ["boards/a/figures/modes.svg", "boards/b/figures/modes.svg"]
    folder = OutputFolder(tmp_path / "out")
    for name in (*names, "boards/b/notes.txt"):
        (folder.path / name).parent.mkdir(parents=True, exist_ok=True)
        (folder.path / name).write_text(name)
    before = files_in(folder.path)

    folder.open(resume=False)
    aside = {f"checkpoint/earlier/{name}" for name in names}
    assert files_in(folder.path).keys() == aside | {"boards/b/notes.txt", "checkpoint/lock"}
    assert folders_in(folder.path).isdisjoint({Path("boards/a"), Path("boards/b/figures"), Path("before")})
    folder.release()
    assert files_in(folder.path) == before

    folder.open(resume=False)
    (folder.path / "summary.json").write_text("new")
    folder.close()
    folder.release()
    assert files_in(folder.path) == {"summary.json": b"new", "boards/b/notes.txt": b"boards/b/notes.txt"}


def test_a_folder_that_no_run_has_written_is_its_owners(tmp_path):
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures" / "photo.png").write_text("mine")
    (tmp_path / "boards.csv").write_text("mine")
    folder = OutputFolder(tmp_path)

    for force in (False, True):
        with pytest.raises(InputError, match=r"or one of an earlier run, got other files: boards\.csv, figures"):
            folder.require_usable(force=force, resume=False)
    (tmp_path / "summary.json").touch()
    folder.require_usable(force=True, resume=False)


def test_files_of_commands_that_share_the_folder_with_a_fit_do_not_make_it_a_used_one(tmp_path):
    for name in ("compare.json", "modes.png", "modes-water.svg", "plan.json", "plan.svg", "plan-bench-2.png"):
        (tmp_path / name).touch()

    OutputFolder(tmp_path).require_usable(force=False, resume=False)
    (tmp_path / "plan.txt").touch()
    with pytest.raises(InputError, match=r"got other files: plan\.txt"):
        OutputFolder(tmp_path).require_usable(force=False, resume=False)


def test_a_board_of_a_campaign_may_have_the_name_of_a_file_of_the_checkpoint(monkeypatch):
    kept = []
    monkeypatch.setattr(Run, "fit", lambda run, problem, place, *others, **told: kept.append(place))
    problems = [SimpleNamespace(board=SimpleNamespace(name=name)) for name in ("lock", "earlier", "before")]
    fit_boards(SimpleNamespace(problems=problems), Run())

    assert kept == ["boards/lock", "boards/earlier", "boards/before"]
