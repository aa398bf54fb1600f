"""Killed, truncated and foreign checkpoints: the same draws or a refusal, never a fresh start in silence."""

from __future__ import annotations

import errno
import hashlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from emcee.backends import HDFBackend

from bayesplate.errors import CheckpointError
from bayesplate.posterior import checkpoint as checkpoint_module
from bayesplate.posterior import sampling
from bayesplate.posterior.checkpoint import CHAINS, Checkpoint
from bayesplate.posterior.convergence import Gate
from bayesplate.posterior.sampling import SamplerSettings, sample

CHUNK = 10
NEVER = Gate(ess_min=1e9)


@pytest.fixture(autouse=True)
def saved_at_every_chunk(monkeypatch):
    monkeypatch.setattr(checkpoint_module, "EVERY_SECONDS", 0.0)
    monkeypatch.setattr(checkpoint_module, "_LEAST_PAUSE", 0.0)


def settings(max_steps=50, seed=4, n_walkers=8):
    return SamplerSettings(
        seed=seed, n_ensembles=2, n_walkers=n_walkers, chunk_steps=CHUNK, max_steps=max_steps, gate=NEVER
    )


def log_posterior(theta):
    return -0.5 * (theta[:, 0] ** 2 + theta[:, 1] ** 2)


def run(checkpoint=None, density=log_posterior, **changes):
    chains, _ = sample(density, np.zeros(2), np.eye(2), settings(**changes), checkpoint=checkpoint)
    return hashlib.sha256(chains.draws.tobytes() + chains.log_prob.tobytes()).hexdigest()


@pytest.fixture(scope="module")
def uninterrupted():
    return run()


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    """A run stopped after three of five chunks."""
    folder = tmp_path_factory.mktemp("saved") / "checkpoint"
    run(Checkpoint(folder, "f"), max_steps=30)
    return folder


@pytest.fixture
def folder(saved, tmp_path):
    return shutil.copytree(saved, tmp_path / "checkpoint")


def n_saved(folder):
    return int(HDFBackend(str(folder / CHAINS), name="ensemble-00", read_only=True).iteration)


def test_a_run_continued_equals_the_uninterrupted_one(folder, uninterrupted):
    assert n_saved(folder) == 30
    assert run(Checkpoint(folder, "f")) == uninterrupted
    assert n_saved(folder) == 50


def test_a_run_continued_in_its_second_walk_equals_the_uninterrupted_one(tmp_path, monkeypatch):
    monkeypatch.setattr(sampling, "_FIRST_WALKS", (20,))
    checkpoint = Checkpoint(tmp_path, "f")
    run(checkpoint, max_steps=40)
    assert [n_saved(folder) for folder in (tmp_path, tmp_path / "walk-2")] == [20, 20]
    assert run(checkpoint) == run()
    assert [n_saved(folder) for folder in (tmp_path, tmp_path / "walk-2")] == [20, 30]


def test_emcee_reads_the_chains(folder):
    backend = HDFBackend(str(folder / CHAINS), name="ensemble-01", read_only=True)
    assert backend.get_chain().shape == (30, 8, 2)
    assert backend.random_state[0] == "MT19937"
    np.testing.assert_allclose(backend.get_log_prob(), log_posterior(backend.get_chain(flat=True)).reshape(30, 8))


def test_a_finished_run_is_read_back_without_new_steps(folder):
    def must_not_be_called(theta):
        raise AssertionError

    sample(must_not_be_called, np.zeros(2), np.eye(2), settings(max_steps=30), checkpoint=Checkpoint(folder, "f"))


def test_it_is_saved_at_once_then_every_few_seconds_only(tmp_path, monkeypatch):
    """And once more at the end."""
    monkeypatch.setattr(checkpoint_module, "EVERY_SECONDS", 1e3)
    written = []
    monkeypatch.setattr(checkpoint_module, "_content", lambda snapshot, _: written.append(snapshot.n_steps) or b"")
    run(Checkpoint(tmp_path, "f"))
    assert written == [10, 50]


def test_an_interrupt_saves_the_last_whole_chunk_and_frees_the_lock(tmp_path, uninterrupted, monkeypatch):
    monkeypatch.setattr(checkpoint_module, "EVERY_SECONDS", 1e3)
    calls = []
    run(density=lambda theta: calls.append(1) or log_posterior(theta), max_steps=25)
    n_calls = len(calls)
    calls.clear()

    def interrupted(theta):
        calls.append(1)
        if len(calls) == n_calls:
            raise KeyboardInterrupt
        return log_posterior(theta)

    checkpoint = Checkpoint(tmp_path / "checkpoint", "f")
    with pytest.raises(KeyboardInterrupt):
        run(checkpoint, interrupted)
    assert checkpoint.exists()
    assert n_saved(tmp_path / "checkpoint") == 20
    assert run(checkpoint) == uninterrupted


def refused(folder, message):
    """That the saved run is refused with its remedy, and its file left as it is."""
    before = (folder / CHAINS).read_bytes()
    with pytest.raises(CheckpointError, match=rf"{message}.*--force"):
        run(Checkpoint(folder, "f"))
    return (folder / CHAINS).read_bytes() == before


def test_a_file_cut_at_any_byte_is_refused_and_left_as_it_is(folder, saved):
    whole = (saved / CHAINS).read_bytes()
    for cut in [0, 1, 10, *range(97, len(whole), len(whole) // 40), len(whole) - 1]:
        (folder / CHAINS).write_bytes(whole[:cut])
        assert refused(folder, "wanted a readable chains.h5, got a damaged one"), cut


def test_flipped_bits_in_the_draws_are_found(folder):
    with h5py.File(folder / CHAINS) as file:
        at = file["ensemble-00/chain"].id.get_chunk_info(0).byte_offset
    content = bytearray((folder / CHAINS).read_bytes())
    content[at + 500] ^= 1
    (folder / CHAINS).write_bytes(content)
    assert refused(folder, "got a damaged one")


@pytest.mark.parametrize("content", [b"[" * 100_000, b"3", b"\0"], ids=range(3))
def test_a_file_with_anything_in_it_is_refused(folder, content):
    (folder / CHAINS).write_bytes(content)
    assert refused(folder, "checkpoint: ")


def test_another_run_is_refused_and_the_difference_named(folder):
    with pytest.raises(CheckpointError, match="the saved run is of another card, prior, model or version"):
        run(Checkpoint(folder, "g"))
    with pytest.raises(CheckpointError, match="differs in its seed: wanted 5, got 4"):
        run(Checkpoint(folder, "f"), seed=5)
    with pytest.raises(CheckpointError, match="differs in its n_walkers: wanted 10, got 8"):
        run(Checkpoint(folder, "f"), n_walkers=10)


def test_a_newer_format_is_refused(folder):
    with h5py.File(folder / CHAINS, "a") as file:
        file.attrs["format"] = 99
    assert refused(folder, f"differs in its format: wanted {checkpoint_module.FORMAT}, got 99")


def test_two_writers_are_refused(folder):
    writer = Checkpoint(folder, "f")
    with writer.session(), pytest.raises(CheckpointError, match=rf"another run \(process {os.getpid()}\)"):
        run(writer)
    run(writer)


def test_the_lock_of_a_dead_process_is_no_obstacle(folder, uninterrupted):
    (folder / "lock").write_text("999999")
    assert run(Checkpoint(folder, "f")) == uninterrupted


@pytest.mark.skipif(sys.platform == "win32", reason="other locks")
def test_a_file_system_without_locks_is_not_taken_for_another_run(folder, monkeypatch):
    import fcntl

    def refused(descriptor, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    with pytest.raises(CheckpointError, match="wanted a folder to write to, got: No locks available"):
        run(Checkpoint(folder, "f"))


def test_a_full_disk_leaves_the_earlier_steps(folder, monkeypatch, uninterrupted):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        with pytest.raises(CheckpointError, match="No space left on device"):
            run(Checkpoint(folder, "f"))
    assert not list(folder.glob("*.partial"))
    assert n_saved(folder) == 30
    assert run(Checkpoint(folder, "f")) == uninterrupted


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CheckpointError, match="wanted a folder to write to"):
        run(Checkpoint(tmp_path / "file" / "checkpoint", "f"))


def test_discarding_removes_everything_that_is_ours(folder):
    (folder / "notes.txt").write_text("mine")
    Checkpoint(folder, "another run").discard()
    assert [path.name for path in folder.iterdir()] == ["notes.txt"]
    (folder / "notes.txt").unlink()
    run(Checkpoint(folder, "f"), max_steps=10)
    Checkpoint(folder, "f").discard()
    assert not folder.exists()


def slowly(theta):
    time.sleep(0.0005)
    return log_posterior(theta)


CHILD = """
import sys
from pathlib import Path
import test_checkpoint as test

test.checkpoint_module.EVERY_SECONDS = test.checkpoint_module._LEAST_PAUSE = 0.0
print("ready", flush=True)
test.run(test.Checkpoint(Path(sys.argv[1]), "f"), test.slowly, max_steps=400)
"""


def is_killed(folder, after):
    """Start the run in a process of its own and kill it so many seconds after it saved; whether it was still alive."""
    chains = folder / CHAINS
    before = chains.stat().st_ino if chains.exists() else None
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *sys.path])}
    command = [sys.executable, "-c", CHILD, str(folder)]
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        process.stdout.readline()
        deadline = time.monotonic() + 20
        while not chains.exists() or (chains.stat().st_ino == before and process.poll() is None):
            assert time.monotonic() < deadline
            time.sleep(0.002)
        time.sleep(after)
        process.send_signal(signal.SIGKILL)
    return process.returncode == -signal.SIGKILL


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
def test_kill_and_resume_gives_the_same_bytes(tmp_path):
    """Five runs, each killed four times."""
    rng = np.random.default_rng(20)
    folders = [tmp_path / f"checkpoint-{i}" for i in range(5)]
    n_killed = sum(is_killed(folder, rng.uniform(0, 0.1)) for folder in folders for _ in range(4))
    whole = run(max_steps=400)

    assert n_killed >= 10
    for folder in folders:
        assert (folder / CHAINS).exists()
        assert run(Checkpoint(folder, "f"), max_steps=400) == whole
