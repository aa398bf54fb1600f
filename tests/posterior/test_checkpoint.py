"""Killed, truncated and foreign checkpoints: the same draws, a shorter beginning or a refusal, never a fresh start."""

from __future__ import annotations

import errno
import hashlib
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bayesplate.errors import CheckpointError
from bayesplate.posterior import checkpoint as checkpoint_module
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.sampling import SamplerSettings, sample
from bayesplate.posterior.warm_up import FEWEST

CHUNK = 10
IDENTITY = {"seed": 4, "n_ensembles": 2, "n_walkers": 8, "n_corrected": 8, "n_dim": 2, "chunk_steps": CHUNK}


def settings(max_steps=50, seed=4, n_walkers=8):
    return SamplerSettings(seed=seed, n_ensembles=2, n_walkers=n_walkers, chunk_steps=CHUNK, max_steps=max_steps)


def log_posterior(theta):
    return -0.5 * (theta[:, 0] ** 2 + theta[:, 1] ** 2)


def run(checkpoint=None, **changes):
    chains, _ = sample(log_posterior, np.zeros(2), np.eye(2), settings(**changes), checkpoint=checkpoint)
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


def n_usable_chunks(folder):
    checkpoint = Checkpoint(folder, "f")
    with checkpoint.session(**IDENTITY) as chunks:
        return len(chunks), checkpoint


def test_a_run_continued_equals_the_uninterrupted_one(folder, uninterrupted):
    assert run(Checkpoint(folder, "f")) == uninterrupted
    assert len(list(folder.glob("chunk-*.npz"))) == 5


def surrogate(theta):
    return log_posterior(theta - 0.3)


def evaluate(theta):
    return log_posterior(theta), np.exp(theta)


@pytest.mark.parametrize("stand_in", [None, surrogate])
@pytest.mark.parametrize("stopped_at", [30, 60, 90])
def test_a_run_stopped_in_or_after_its_warm_up_continues_to_the_same_bytes(tmp_path, stand_in, stopped_at):
    """In the warm-up, at its end, and where proposals are fixed or walks are corrected."""

    def drawn(max_steps, checkpoint=None):
        target = (log_posterior, np.zeros(2), np.eye(2), replace(settings(max_steps), n_corrected=5))
        chains, _ = sample(*target, surrogate=stand_in, evaluate=evaluate, checkpoint=checkpoint)
        assert (chains.blobs is not None) == (stand_in is not None and max_steps > 60)
        found = b"" if chains.blobs is None else chains.blobs.tobytes()
        return chains.draws.tobytes() + chains.log_prob.tobytes() + found

    drawn(stopped_at, Checkpoint(tmp_path / "checkpoint", "f"))
    walkers = [np.load(path)["log_prob"].shape[2] for path in sorted(tmp_path.glob("checkpoint/chunk-*.npz"))]
    assert walkers == [8 if stand_in is None or i < FEWEST else 5 for i in range(stopped_at // CHUNK)]
    assert drawn(120, Checkpoint(tmp_path / "checkpoint", "f")) == drawn(120)


def test_a_finished_run_is_read_back_without_new_steps(folder):
    def must_not_be_called(theta):
        raise AssertionError

    sample(must_not_be_called, np.zeros(2), np.eye(2), settings(max_steps=30), checkpoint=Checkpoint(folder, "f"))


def test_an_interrupt_keeps_the_chunks_and_frees_the_lock(tmp_path, uninterrupted):
    calls = []

    def interrupted(theta):
        calls.append(1)
        if len(calls) > 10:
            raise KeyboardInterrupt
        return log_posterior(theta)

    checkpoint = Checkpoint(tmp_path / "checkpoint", "f")
    with pytest.raises(KeyboardInterrupt):
        sample(interrupted, np.zeros(2), np.eye(2), settings(), checkpoint=checkpoint)
    assert checkpoint.exists()
    assert n_usable_chunks(tmp_path / "checkpoint")[0] >= 1
    assert run(checkpoint) == uninterrupted


@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_chunk_cut_at_any_byte_shortens_the_run_or_is_refused(folder, saved, index):
    name = f"chunk-{index:04d}.npz"
    whole = (saved / name).read_bytes()
    for cut in [0, 1, 10, *range(97, len(whole), len(whole) // 60), len(whole) - 1]:
        shutil.rmtree(folder)
        shutil.copytree(saved, folder)
        (folder / name).write_bytes(whole[:cut])
        if index == 0:
            with pytest.raises(CheckpointError, match=r"chunk-0000.npz does not match its hash.*--force"):
                n_usable_chunks(folder)
            assert (folder / name).stat().st_size == cut
        else:
            n_chunks, checkpoint = n_usable_chunks(folder)
            assert n_chunks == index
            assert checkpoint.lost_steps == (3 - index) * CHUNK
            assert f"{checkpoint.lost_steps} saved steps are lost" in checkpoint.notice
            assert (folder / f"{name}.damaged").read_bytes() == whole[:cut]


@pytest.mark.parametrize("index", [1, 2])
def test_the_shortened_run_continues_to_the_same_draws(folder, index, uninterrupted):
    path = folder / f"chunk-{index:04d}.npz"
    path.write_bytes(path.read_bytes()[:1000])
    assert run(Checkpoint(folder, "f")) == uninterrupted


def test_a_flipped_bit_is_found(folder):
    path = folder / "chunk-0002.npz"
    content = bytearray(path.read_bytes())
    content[500] ^= 1
    path.write_bytes(bytes(content))
    assert n_usable_chunks(folder)[0] == 2


@pytest.mark.parametrize("name", ["chunk-0001.npz", "chunk-0001.npz.sha256"])
def test_a_missing_file_ends_the_usable_beginning(folder, name):
    (folder / name).unlink()
    assert n_usable_chunks(folder)[0] == 1
    assert (folder / "chunk-0002.npz.damaged").exists()


def test_a_chunk_damaged_twice_is_kept_twice(folder, uninterrupted):
    for _ in range(2):
        (folder / "chunk-0002.npz").write_bytes(b"")
        assert run(Checkpoint(folder, "f")) == uninterrupted
    assert len(list(folder.glob("chunk-0002.npz.damaged*"))) == 2


def test_a_manifest_cut_at_any_byte_is_refused(folder):
    path = folder / "manifest.json"
    whole = path.read_bytes()
    for cut in range(len(whole) - 1):
        path.write_bytes(whole[:cut])
        with pytest.raises(CheckpointError, match=r"manifest.json.*--force"):
            n_usable_chunks(folder)


@pytest.mark.parametrize("content", ["[" * 100_000, "3", '{"format": [[]]}', "\0"], ids=range(4))
def test_a_manifest_with_anything_in_it_is_refused(folder, content):
    (folder / "manifest.json").write_text(content)
    with pytest.raises(CheckpointError, match=r"checkpoint: .*--force"):
        n_usable_chunks(folder)


def test_chunks_without_a_manifest_or_a_first_one_are_refused(folder):
    (folder / "chunk-0000.npz").unlink()
    with pytest.raises(CheckpointError, match=r"chunk-0000\.npz is missing"):
        n_usable_chunks(folder)
    (folder / "manifest.json").unlink()
    with pytest.raises(CheckpointError, match=r"wanted a manifest\.json"):
        n_usable_chunks(folder)


def test_another_run_is_refused_and_the_difference_named(folder):
    with pytest.raises(CheckpointError, match="differs in its fingerprint: wanted 'g', got 'f'"):
        run(Checkpoint(folder, "g"))
    with pytest.raises(CheckpointError, match="differs in its seed: wanted 5, got 4"):
        run(Checkpoint(folder, "f"), seed=5)
    with pytest.raises(CheckpointError, match="differs in its n_walkers: wanted 10, got 8"):
        run(Checkpoint(folder, "f"), n_walkers=10)


def test_a_newer_format_is_refused(folder):
    path = folder / "manifest.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"format": 99}))
    with pytest.raises(CheckpointError, match=f"differs in its format: wanted {checkpoint_module.FORMAT}, got 99"):
        n_usable_chunks(folder)


def test_a_pickled_payload_is_not_loaded(folder):
    path = folder / "chunk-0002.npz"
    with path.open("wb") as stream:
        np.savez(stream, draws=np.array([{"a": 1}], dtype=object), allow_pickle=True)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    path.with_name(path.name + ".sha256").write_text(f"{digest}  {path.name}\n")
    assert n_usable_chunks(folder)[0] == 2


def test_two_writers_are_refused(folder):
    refused = pytest.raises(CheckpointError, match=rf"another run \(process {os.getpid()}\)")
    with Checkpoint(folder, "f").session(**IDENTITY), refused:
        n_usable_chunks(folder)
    assert n_usable_chunks(folder)[0] == 3


def test_the_lock_of_a_dead_process_is_no_obstacle(folder):
    (folder / "lock").write_text("999999")
    assert n_usable_chunks(folder)[0] == 3


@pytest.mark.skipif(sys.platform == "win32", reason="other locks")
def test_a_file_system_without_locks_is_not_taken_for_another_run(folder, monkeypatch):
    import fcntl

    def refused(descriptor, operation):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    with pytest.raises(CheckpointError, match="wanted a folder to write to, got: No locks available"):
        n_usable_chunks(folder)


def test_a_full_disk_leaves_the_earlier_chunks(folder, monkeypatch, uninterrupted):
    def full(descriptor):
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(checkpoint_module.os, "fsync", full)
        with pytest.raises(CheckpointError, match="No space left on device"):
            run(Checkpoint(folder, "f"))
    assert not list(folder.glob("*.partial"))
    assert run(Checkpoint(folder, "f")) == uninterrupted


def test_a_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(CheckpointError, match="wanted a folder to write to"):
        run(Checkpoint(tmp_path / "file" / "checkpoint", "f"))


def test_discarding_removes_everything_but_what_was_set_aside(folder):
    (folder / "chunk-0002.npz").write_bytes(b"")
    n_usable_chunks(folder)
    Checkpoint(folder, "another run").discard()
    assert sorted(path.name for path in folder.iterdir()) == ["chunk-0002.npz.damaged", "chunk-0002.npz.sha256.damaged"]
    shutil.rmtree(folder)
    Checkpoint(folder, "f").discard()
    run(Checkpoint(folder, "f"), max_steps=10)
    Checkpoint(folder, "f").discard()
    assert not folder.exists()


CHILD = """
import sys, time
from pathlib import Path
import numpy as np
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.sampling import SamplerSettings, sample

def log_posterior(theta):
    time.sleep(0.0005)
    return -0.5 * (theta[:, 0] ** 2 + theta[:, 1] ** 2)

settings = SamplerSettings(seed=4, n_ensembles=2, n_walkers=8, chunk_steps=10, max_steps=200)
print("ready", flush=True)
sample(log_posterior, np.zeros(2), np.eye(2), settings, checkpoint=Checkpoint(Path(sys.argv[1]), "f"))
"""


def kill_and_resume(folder, n_kills, rng):
    """Start the run `n_kills` times and kill it each time; count the kills that came before its end."""
    package_root = Path(checkpoint_module.__file__).parents[2]
    environment = os.environ | {"PYTHONPATH": str(package_root)}
    killed = 0
    for _ in range(n_kills):
        command = [sys.executable, "-c", CHILD, str(folder)]
        with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
            process.stdout.readline()
            deadline = time.monotonic() + 20
            n_before = len(list(folder.glob("chunk-*.npz")))
            while len(list(folder.glob("chunk-*.npz"))) == n_before and process.poll() is None:
                assert time.monotonic() < deadline
                time.sleep(0.002)
            time.sleep(rng.uniform(0, 0.1))
            process.send_signal(signal.SIGKILL)
        killed += process.returncode == -signal.SIGKILL
    return killed


@pytest.mark.skipif(sys.platform == "win32", reason="needs SIGKILL")
@pytest.mark.parametrize("n_kills", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_kill_and_resume_gives_the_same_bytes(tmp_path, n_kills):
    rng = np.random.default_rng(n_kills)
    killed = 0
    for round_ in range(max(1, n_kills // 4)):
        folder = tmp_path / f"checkpoint-{round_}"
        killed += kill_and_resume(folder, min(n_kills, 4), rng)
        assert len(list(folder.glob("chunk-*.npz"))) >= 1
        assert run(Checkpoint(folder, "f"), max_steps=200) == run(max_steps=200)
    assert killed >= n_kills / 2
