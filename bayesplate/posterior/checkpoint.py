"""The checkpoint of a sampling run: the chains of its ensembles in one file, rewritten every few seconds.

A folder holds `chains.h5`, in the format of emcee's HDF backend with one group for each ensemble, and `lock`. Only
whole chunks of steps are saved, with emcee's random state after them, so that a continued run makes the same draws.
"""

from __future__ import annotations

import io
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bayesplate.errors import CheckpointError, UnwritableError
from bayesplate.files import write_bytes
from bayesplate.locks import lock_folder

FORMAT = 9
"""To be raised whenever the same seed would give other draws, so that two programs never share one run."""
CHAINS = "chains.h5"
EVERY_SECONDS = 5.0
_LEAST_PAUSE = 20.0
"""Least pause between two saves, over the time that a save takes."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """State of a run at the end of a chunk."""

    backends: Sequence[Any]  # emcee's, one per ensemble; steps beyond `n_steps` are of an unfinished chunk
    random_states: Sequence[Any]  # of emcee's samplers, as numpy states them
    n_steps: int


class Checkpoint:
    """The checkpoint folder of one run, made when first needed.

    The fingerprint is a hash of all that defines the run except the sampler settings: card, priors, effects, law.
    """

    def __init__(self, folder: Path, fingerprint: str) -> None:
        self.folder = Path(folder)
        self.fingerprint = fingerprint

    @property
    def file(self) -> Path:
        return self.folder / CHAINS

    def exists(self) -> bool:
        """Whether the folder, or one of a part of the run, holds chains to continue."""
        return any(self.folder.rglob(CHAINS))

    def part(self, name: str) -> Checkpoint:
        """The checkpoint of a part of the run."""
        return Checkpoint(self.folder / name, self.fingerprint)

    @contextmanager
    def session(self, **identity: int) -> Iterator[Session]:
        """Lock the folder; a run that is interrupted is saved up to its last whole chunk.

        `identity` holds the sampler settings that decide the draws. CheckpointError if the folder is in use.
        """
        with lock_folder(self.folder):
            session = Session(self, {"format": FORMAT, "fingerprint": self.fingerprint, **identity})
            try:
                yield session
            except KeyboardInterrupt:
                session.save()
                raise

    def discard(self) -> None:
        """Remove the checkpoint: after success or to start anew, outside a session."""
        if not self.folder.is_dir():
            return
        with lock_folder(self.folder):
            self.file.unlink(missing_ok=True)
        (self.folder / "lock").unlink(missing_ok=True)
        with suppress(OSError):  # not empty: something is not ours
            self.folder.rmdir()

    def error(self, what: str) -> CheckpointError:
        """The error of a checkpoint that cannot be used, and its remedy."""
        return CheckpointError(f"{self.folder}: {what}; start anew with --force, or give another --out")


class Session:
    """Exclusive use of a checkpoint by a run; a continued run must have the same `identity`."""

    def __init__(self, checkpoint: Checkpoint, identity: dict[str, int | str]) -> None:
        self.checkpoint, self.identity = checkpoint, identity
        self._latest: Snapshot | None = None
        self._n_saved = 0
        self._due = 0.0  # the first chunk is saved at once

    def load(self) -> Snapshot | None:
        """The saved run, None if there is none; CheckpointError if it is damaged or of another run."""
        if not self.checkpoint.file.exists():
            return None
        import h5py
        from emcee.backends import Backend, HDFBackend

        path = str(self.checkpoint.file)
        try:
            with h5py.File(path, "r") as file:
                attributes = {key: getattr(value, "item", lambda v=value: v)() for key, value in file.attrs.items()}
                names = sorted(file)
            saved_backends = [HDFBackend(path, name=name, read_only=True) for name in names]
            states = [backend.random_state for backend in saved_backends]
            chains = [(backend.get_chain(), backend.get_log_prob()) for backend in saved_backends]
        except (OSError, KeyError, ValueError, RuntimeError, AttributeError):
            raise self.checkpoint.error(f"wanted a readable {CHAINS}, got a damaged one") from None
        for key in [*self.identity, *(key for key in attributes if key not in self.identity)]:
            if attributes.get(key) != self.identity.get(key):
                if key == "fingerprint":
                    raise self.checkpoint.error("the saved run is of another card, prior, model or version")
                difference = f"wanted {self.identity.get(key)!r}, got {attributes.get(key)!r}"
                raise self.checkpoint.error(f"the saved run differs in its {key}: {difference}")
        backends = []
        for (chain, log_prob), state in zip(chains, states, strict=True):
            backend = Backend()
            backend.reset(*chain.shape[1:])
            backend.chain, backend.log_prob = chain, log_prob
            backend.iteration, backend.random_state = len(chain), state
            backends.append(backend)
        self._n_saved = len(backends[0].chain)
        return Snapshot(backends, states, self._n_saved)

    def reached(self, snapshot: Snapshot) -> None:
        """Record the state of the run, and save it if it is the first or the last save is long enough ago."""
        self._latest = snapshot
        if time.monotonic() >= self._due:
            start = time.monotonic()
            self.save()
            duration = time.monotonic() - start
            self._due = start + duration + max(EVERY_SECONDS, _LEAST_PAUSE * duration)

    def save(self) -> None:
        """Save the state of the run; CheckpointError if it cannot be written: the last file stays intact."""
        if self._latest is None or self._latest.n_steps == self._n_saved:
            return
        try:
            write_bytes(self.checkpoint.file, _content(self._latest, self.identity))
        except UnwritableError as error:
            raise CheckpointError(f"{error}; what was saved before is intact: make room and resume") from None
        self._n_saved = self._latest.n_steps


def _content(snapshot: Snapshot, identity: dict[str, int | str]) -> bytes:
    """Content of a file that emcee's HDF backend reads, one group for each ensemble.

    It is made in memory: where the disk is full, HDF5 would crash the process at its exit.
    """
    import emcee
    import h5py

    content, n_steps = io.BytesIO(), snapshot.n_steps
    with h5py.File(content, "w") as file:
        file.attrs.update(identity)
        for i, (backend, state) in enumerate(zip(snapshot.backends, snapshot.random_states, strict=True)):
            group = file.create_group(f"ensemble-{i:02d}")
            _, n_walkers, n_dim = backend.chain.shape
            shape = {"nwalkers": n_walkers, "ndim": n_dim, "iteration": n_steps, "has_blobs": False}
            group.attrs.update({"version": emcee.__version__, **shape})
            group.attrs.update({f"random_state_{k}": value for k, value in enumerate(state)})
            group.create_dataset("accepted", data=np.zeros(n_walkers))
            group.create_dataset("chain", data=backend.chain[:n_steps], fletcher32=True)
            group.create_dataset("log_prob", data=backend.log_prob[:n_steps], fletcher32=True)
    return content.getvalue()
