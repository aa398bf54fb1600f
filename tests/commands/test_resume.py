"""A run that was stopped is continued to the same bytes, and refused where it is another run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import runs
from runs import files_in, read_json

from bayesplate.posterior.checkpoint import CHAINS

BOARD = "fiemme-spruce-clamped"
UNCONVERGED = {"format", "name", "seed", "versions", "card_sha256", "model", "converged", "sampler", "warnings"}
RESULTS = {"summary.json", "posterior.nc"}
"""What a fit without a report leaves; that a report is the same too is shown where threads are counted."""


def results_of(files: dict[str, bytes]) -> dict[str, bytes]:
    return {name: files[name] for name in RESULTS}


def start(folder: Path, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    """A fit in a process of its own, which heeds an interrupt even where the tests themselves run in the background."""

    def heed_interrupts() -> None:
        signal.signal(signal.SIGINT, signal.SIG_DFL)

    program = [sys.executable, "-m", "bayesplate", "fit", *arguments, "--out", str(folder)]
    variables = {**os.environ, **environment}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(program, **pipes, text=True, env=variables, preexec_fn=heed_interrupts)


def stop_while_sampling(folder: Path, *stops: signal.Signals) -> tuple[int, str]:
    """Send a signal once a chunk is saved; the exit code and what was said. The first of two only holds it."""
    with start(folder, BOARD, "--no-report") as process:
        saved = folder / "checkpoint" / "linear" / CHAINS
        deadline = time.monotonic() + 600
        while not saved.exists() and process.poll() is None:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        for stop in stops:
            process.send_signal(stop)
            if stop == signal.SIGSTOP:
                for beside in ("--force", "--resume"):
                    assert_taken(folder, beside, process.pid)
        _, stderr = process.communicate(timeout=600)
    return process.returncode, stderr


def assert_taken(folder: Path, option: str, owner: int) -> None:
    """Another run in the folder of one in progress is refused and touches nothing."""
    before = files_in(folder)
    run = runs.fit(folder, BOARD, option)

    assert run.exit_code == 6
    assert f"wanted sole use, got another run (process {owner}) that writes to it" in run.stderr
    assert files_in(folder) == before


@pytest.mark.parametrize("stop", [signal.SIGINT, pytest.param(signal.SIGTERM, marks=pytest.mark.slow)])
def test_an_interrupted_fit_resumes_to_the_same_bytes(tmp_path, fiemme_files, stop):
    exit_code, stderr = stop_while_sampling(tmp_path / "out", stop)

    assert exit_code == 130
    assert stderr == "interrupted; --resume continues from the last checkpoint\n"
    assert RESULTS & set(files_in(tmp_path / "out")) == set()
    assert runs.fit(tmp_path / "out", BOARD, "--resume", "--no-report").exit_code == 0
    assert files_in(tmp_path / "out") == results_of(fiemme_files)


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="needs a signal that cannot be caught")
def test_a_killed_fit_resumes_to_the_same_bytes(tmp_path, fiemme_files):
    """And while it was alive, though it did nothing, no other run could take its folder."""
    exit_code, _ = stop_while_sampling(tmp_path / "out", signal.SIGSTOP, signal.SIGKILL)

    assert exit_code == -signal.SIGKILL
    left = files_in(tmp_path / "out")
    assert RESULTS & set(left) == set()
    assert f"checkpoint/linear/{CHAINS}" in left
    assert runs.fit(tmp_path / "out", BOARD, "--resume", "--no-report").exit_code == 0
    assert files_in(tmp_path / "out") == results_of(fiemme_files)


def test_an_interrupt_before_sampling_leaves_nothing(tmp_path, monkeypatch):
    def interrupted(*_: object, **__: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(10)

    monkeypatch.setattr("bayesplate.commands.problem.pose", interrupted)
    run = runs.fit(tmp_path / "out", BOARD)

    assert run.exit_code == 130
    assert not run.folder.exists()
    assert signal.getsignal(signal.SIGTERM) == signal.SIG_DFL


@pytest.mark.parametrize("earlier", [(), ("summary.json", "posterior.nc", "figures/modes.png")])
def test_an_interrupt_before_the_first_checkpoint_promises_nothing_and_leaves_what_was_there(
    tmp_path, monkeypatch, earlier
):
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    folder = tmp_path / "out"
    for name in earlier:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(b"old")
    monkeypatch.setattr("bayesplate.commands.fitting.infer", interrupted)
    run = runs.fit(folder, BOARD, *["--force"] * bool(earlier))

    assert (run.exit_code, run.stderr) == (130, "interrupted\n")
    assert run.files == dict.fromkeys(earlier, b"old")
    assert folder.exists() == bool(earlier)


def test_a_run_that_does_not_converge_says_so_and_gives_no_constants(stopped):
    assert stopped.exit_code == 5
    assert stopped.summary["converged"] is False
    assert set(stopped.summary) == UNCONVERGED
    assert stopped.summary["sampler"]["steps"] == 200
    assert stopped.summary["sampler"]["tau_max"] > 0
    assert any("autocorrelation" in sentence for sentence in stopped.summary["warnings"])
    assert "posterior.nc" not in stopped.files
    assert "the sampler did not converge, so no constants are given" in stopped.stderr
    assert read_json(stopped.stdout)["error"]["exit_code"] == 5
    assert not any(name in stopped.stdout + stopped.stderr for name in ("E_x", "GPa"))


def test_a_run_that_did_not_converge_is_continued_where_more_steps_are_allowed(stopped, fiemme_files):
    """200 steps and then the others are the same draws as all of them at once, and the same burn-in is dropped."""
    assert runs.fit(stopped.folder, BOARD, "--resume", "--quiet", "--no-report").exit_code == 0
    assert stopped.files == results_of(fiemme_files)


def test_neither_another_run_nor_a_damaged_checkpoint_is_continued_and_all_stays_as_it_is(stopped, own_card):
    def refused(code: int, said: str, *options: str) -> None:
        before = stopped.files
        run = runs.fit(stopped.folder, str(own_card), *options)
        lock = {name: data for name, data in run.files.items() if name == "checkpoint/linear/lock"}

        assert run.exit_code == code, said
        assert said in run.stderr
        assert "--force" in run.stderr or code == 3
        assert run.files == before | lock

    text, chains = own_card.read_text(encoding="utf-8"), stopped.folder / "checkpoint" / "linear" / CHAINS
    refused(6, "differs in its seed: wanted 2, got 1", "--resume", "--seed", "2")
    refused(6, "wanted a saved run of this command under the exact law, got none to resume", "--resume", "--exact")
    own_card.write_text(text.replace('"(0,0)" = 57', '"(0,0)" = 58'), encoding="utf-8")
    refused(6, "the saved run is of another card", "--resume")
    own_card.write_text(text.replace("= 600", "= -600"), encoding="utf-8")
    refused(3, "length_x_mm: wanted a positive number", "--force")
    own_card.write_text(text, encoding="utf-8")
    chains.write_bytes(chains.read_bytes()[:1000])
    refused(6, "got a damaged one; start anew with --force", "--resume")


def test_force_replaces_the_results_the_report_and_the_checkpoint_and_nothing_else(stopped, quick_fit):
    """Also where the new run writes no report: a page must not stand beside numbers that are not its own."""
    (stopped.folder / "figures").mkdir()
    tables = [
        f"{table}.{ending}" for table in ("constants", "before-after", "known-effects") for ending in ("csv", "tex")
    ]
    for name in ("posterior.nc", "report.html", "figures/board.svg", *tables):
        (stopped.folder / name).write_bytes(b"old")
    mine = {"notes.txt": b"mine", "figures/mine.txt": b"mine"}
    for name, content in mine.items():
        (stopped.folder / name).write_bytes(content)
    run = quick_fit(BOARD, "--force", "--quiet")

    assert run.folder == stopped.folder
    assert run.exit_code == 0
    assert set(run.files) == RESULTS | set(mine)
    assert {name: run.files[name] for name in mine} == mine
    assert run.summary["converged"] is True
    assert run.files["posterior.nc"] != b"old"


def test_the_same_seed_gives_the_same_bytes_whatever_the_number_of_threads(tmp_path, fiemme_files):
    """The report's too. Another process, asked for another number of threads: long sums must not follow it."""
    other = "2" if os.environ.get("OMP_NUM_THREADS") == "1" else "1"
    with start(tmp_path / "out", BOARD, "--quiet", OMP_NUM_THREADS=other, OPENBLAS_NUM_THREADS=other) as process:
        assert process.communicate(timeout=300) == ("", "")

    assert files_in(tmp_path / "out") == fiemme_files


def test_a_campaign_does_not_take_the_place_of_an_interrupted_fit(tmp_path):
    """Chains of another command in the folder are not those of its boards, and are kept."""
    folder = tmp_path / "out"
    exit_code, _ = stop_while_sampling(folder, signal.SIGINT)
    before = files_in(folder)
    text = f'format = 1\nname = "both"\nboards = ["{BOARD}", "finnish-spruce-cantilever"]\n'
    (tmp_path / "both.toml").write_text(text)
    refused = runs.fit(folder, str(tmp_path / "both.toml"), "--resume")

    assert (exit_code, refused.exit_code) == (130, 6)
    assert "wanted a saved run of this command" in refused.stderr
    assert files_in(folder) == before
