"""Checkpoints of a sampling run: immutable chunks on disk that a killed run continues from.

A folder holds `manifest.json` (what defines the run), `chunk-0000.npz` and so on with a `.sha256` beside each (in the
form that `sha256sum -c` reads), and `lock`.  Nothing is ever rewritten: a chunk appears complete or not at all, and one
that was damaged later is set aside under another name.  Arrays only, no pickle.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import sys
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import CheckpointError

FloatArray = NDArray[np.float64]

FORMAT = 6  # to be raised whenever the same seed would give other chunks, so that two programs never share one run


@dataclass(frozen=True)
class Chunk:
    """Some steps of all ensembles; the walkers go on from the last of them.

    Attributes
    ----------
    draws : (n_ensembles, n_steps, n_walkers, n_dim) array
    log_prob : (n_ensembles, n_steps, n_walkers) array
    blobs : (n_ensembles, n_steps, n_walkers, n_blobs) array
        What the density found on the way, as emcee calls it; of no column where none was kept.
    """

    draws: FloatArray
    log_prob: FloatArray
    blobs: FloatArray


class Checkpoint:
    """The checkpoint folder of one run.

    Parameters
    ----------
    folder : Path
        Made when first needed.
    fingerprint : str
        Hash of everything that defines the run besides the sampler settings: card, priors, effects, law.

    Attributes
    ----------
    lost_steps : int
        Steps that were saved once but could not be used by the last session.
    notice : str
        A sentence about them for the user; empty if there are none.
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = Path(folder)
        self.fingerprint = fingerprint
        self.lost_steps = 0
        self.notice = ""
        self._n_chunks = 0

    def exists(self) -> bool:
        """Return True if the folder holds a run to continue."""
        return (self.folder / "manifest.json").exists() or bool(self._chunk_files())

    @contextmanager
    def session(self, **identity: int) -> Iterator[tuple[Chunk, ...]]:
        """Lock the folder, check that it belongs to this run and yield the chunks to continue from.

        Parameters
        ----------
        **identity : int
            The sampler settings that decide the draws: seed, n_ensembles, n_walkers, n_corrected, n_dim, chunk_steps.

        Raises
        ------
        CheckpointError
            If the folder belongs to another run, is in use, or cannot be read or written.
        """
        with take(self.folder):
            self._check_manifest(identity)
            chunks = self._load_prefix(identity)
            self._n_chunks = len(chunks)
            yield chunks

    def append(self, chunk: Chunk) -> None:
        """Save the next chunk; only within a session.

        Raises
        ------
        CheckpointError
            If it cannot be written; the earlier chunks stay intact.
        """
        path = self._chunk(self._n_chunks)
        buffer = io.BytesIO()
        np.savez(buffer, **vars(chunk))
        content = buffer.getvalue()
        # The hash first: then a chunk that is there has its hash, wherever the process is killed.
        _write_atomically(_side(path), f"{hashlib.sha256(content).hexdigest()}  {path.name}\n".encode())
        _write_atomically(path, content)
        self._n_chunks += 1

    def discard(self) -> None:
        """Remove the checkpoint, all but what was set aside: after success or to start anew, outside a session."""
        if not self.folder.is_dir():
            return
        with take(self.folder):
            for path in reversed(self._chunk_files()):  # a kill leaves the beginning of a known run behind
                path.unlink()
                _side(path).unlink(missing_ok=True)
            for pattern in ("chunk-*.sha256", "*.partial", "manifest.json"):
                for path in self.folder.glob(pattern):
                    path.unlink()
        (self.folder / "lock").unlink(missing_ok=True)
        with suppress(OSError):  # not empty: something was set aside, or is not ours
            self.folder.rmdir()

    def _chunk(self, index: int) -> Path:
        return self.folder / f"chunk-{index:04d}.npz"

    def _chunk_files(self) -> list[Path]:
        return sorted(self.folder.glob("chunk-*.npz"))

    def _error(self, what: str) -> CheckpointError:
        return CheckpointError(f"{self.folder}: {what}; start anew with --force, or give another --out")

    def _check_manifest(self, identity: Mapping[str, int]) -> None:
        """Compare the manifest with this run, or write it where there is none."""
        path = self.folder / "manifest.json"
        wanted: dict[str, object] = {"format": FORMAT, "fingerprint": self.fingerprint, **identity}
        if not path.exists():
            if self._chunk_files():
                raise self._error("wanted a manifest.json beside the saved chunks, got none")
            _write_atomically(path, (json.dumps(wanted, indent=1) + "\n").encode())
            return
        try:
            found = json.loads(path.read_bytes())
        except (OSError, ValueError, RecursionError):
            raise self._error("wanted a readable manifest.json, got a damaged one") from None
        if not isinstance(found, dict):
            raise self._error("wanted a manifest.json with keys, got something else")
        for key in [*wanted, *(key for key in found if key not in wanted)]:
            if found.get(key) != wanted.get(key):
                raise self._error(
                    f"the saved run differs in its {key}: wanted {wanted.get(key)!r}, got {found.get(key)!r}"
                )

    def _load_prefix(self, identity: Mapping[str, int]) -> tuple[Chunk, ...]:
        """Load the chunks up to the first unusable one and set aside whatever follows."""
        files = self._chunk_files()
        chunks: list[Chunk] = []
        fault = "is missing"
        while (path := self._chunk(len(chunks))).exists():
            chunk, fault = _read_chunk(path, identity)
            if chunk is None:
                break
            chunks.append(chunk)
            fault = "is missing"
        unused = [path for path in files if path.name >= self._chunk(len(chunks)).name]
        if unused and not chunks:
            raise self._error(f"chunk-0000.npz {fault}, so there is nothing to continue from")
        for path in unused:
            _set_aside(path)
        self.lost_steps = len(unused) * identity["chunk_steps"]
        self.notice = ""
        if unused:
            self.notice = (
                f"{self.folder}: {self._chunk(len(chunks)).name} {fault}; {self.lost_steps} saved steps are lost "
                f"(set aside as *.damaged), the run continues after step {len(chunks) * identity['chunk_steps']}"
            )
        return tuple(chunks)


def take(folder: Path) -> IO[bytes]:
    """Lock a folder for sole use until the stream that is returned is closed; made if it is not there.

    The system frees the lock of a process that died, so none is ever stale.

    Raises
    ------
    CheckpointError
        If another run holds it, or it cannot be written to; nothing in it is changed then.
    """
    path = folder / "lock"
    while True:
        try:
            folder.mkdir(parents=True, exist_ok=True)
            stream = path.open("a+b")
            is_ours = _try_lock(stream)
        except OSError as error:
            raise CheckpointError(f"{folder}: wanted a folder to write to, got: {error.strerror}") from None
        if not is_ours:
            stream.seek(0)
            owner = stream.read().decode(errors="replace").strip()
            stream.close()
            raise CheckpointError(
                f"{folder}: wanted sole use, got another run (process {owner}) that writes to it; "
                "wait for it, or give another --out"
            )
        # The run that held it may have removed the file in between: then this is the lock of nothing.
        if path.exists() and os.path.samestat(os.fstat(stream.fileno()), path.stat()):
            break
        stream.close()
    with suppress(OSError):  # a full disk: the lock holds without a name in it
        stream.truncate(0)
        stream.write(str(os.getpid()).encode())
        stream.flush()
    return stream


def _try_lock(stream: IO[bytes]) -> bool:
    """Lock an open file for as long as it stays open; False if another one holds it.

    Raises
    ------
    OSError
        If the file system knows no locks; the file is closed then.
    """
    try:
        if sys.platform == "win32":
            import msvcrt

            stream.seek(1 << 20)  # beyond the text, which others must be able to read
            msvcrt.locking(stream.fileno(), msvcrt.LK_NBLCK, 1)
        else:
            import fcntl

            fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if sys.platform != "win32" and not isinstance(error, BlockingIOError):
            stream.close()
            raise
        return False
    return True


def _side(path: Path) -> Path:
    """Path of a chunk's hash."""
    return path.with_name(path.name + ".sha256")


def _write_atomically(path: Path, content: bytes) -> None:
    """Write a file that is there completely or not at all, even after a power cut."""
    partial = path.with_name(path.name + ".partial")
    try:
        with partial.open("wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial, path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink()
        raise CheckpointError(
            f"{path}: could not be written ({error.strerror}); what was saved before is intact: make room and resume"
        ) from None


def _read_chunk(path: Path, identity: Mapping[str, int]) -> tuple[Chunk | None, str]:
    """Read and verify a chunk; otherwise None and what is wrong with it."""
    n_ensembles, n_steps = identity["n_ensembles"], identity["chunk_steps"]
    names = "draws", "log_prob", "blobs"
    try:
        content = path.read_bytes()
        if _side(path).read_bytes() != f"{hashlib.sha256(content).hexdigest()}  {path.name}\n".encode():
            return None, "does not match its hash"
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:
            chunk = Chunk(**{name: arrays[name] for name in names})
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return None, "cannot be read or has no hash beside it"
    last_of = {"draws": (identity["n_dim"],), "log_prob": (), "blobs": chunk.blobs.shape[-1:]}
    shapes = {name: getattr(chunk, name).shape for name in names}
    if not any(
        shapes == {name: (n_ensembles, n_steps, identity[walkers], *last) for name, last in last_of.items()}
        for walkers in ("n_walkers", "n_corrected")
    ):
        return None, "has other shapes than this run"
    if not all(np.isfinite(one).all() for one in (chunk.draws, chunk.log_prob)):
        return None, "holds numbers that are not finite"
    return chunk, ""


def _set_aside(path: Path) -> None:
    """Rename a chunk that cannot be used; never delete what someone may want to look at."""
    for source in (path, _side(path)):
        target = source.with_name(source.name + ".damaged")
        count = 1
        while target.exists():
            count += 1
            target = source.with_name(f"{source.name}.damaged-{count}")
        with suppress(FileNotFoundError):
            source.rename(target)
