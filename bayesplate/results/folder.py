"""The output folder of a run: never overwritten unasked, every file complete or absent."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import IO

from bayesplate.errors import CheckpointError, Fault, InputError, RunInterrupted, UnwritableError
from bayesplate.files import make_folder, names_in
from bayesplate.locks import take
from bayesplate.posterior.checkpoint import CHAINS, Checkpoint

SUMMARY = "summary.json"
ARCHIVE = "posterior.nc"
DIAGNOSIS = "diagnosis.json"
CHECKPOINT = "checkpoint"
BEFORE = "before"
"""Subfolder of the fit that a diagnosis questioned, where it was fitted again."""
BOARDS = "boards"
"""Subfolder of a campaign, with one folder for each of its boards."""
OF_POPULATION = "-population"
"""What the name of the prior card ends with that a campaign leaves for its next board."""
PAGE = "report.html"
FIGURES = "figures"
CONSTANTS = ("constants.csv", "constants.tex")
BEFORE_AFTER = ("before-after.csv", "before-after.tex")
KNOWN_EFFECTS = ("known-effects.csv", "known-effects.tex")
EARLIER = "earlier"
"""Subfolder of the checkpoint with the results that a run replaces, until it is done."""
BATCH = ("batch.json", "boards.jsonl", "boards.csv", "boards.parquet", "grading.csv", "grading.html")
RESULTS = (SUMMARY, ARCHIVE, DIAGNOSIS, PAGE, *CONSTANTS, *BEFORE_AFTER, *KNOWN_EFFECTS, *BATCH)
"""What a run leaves besides its figures, and the next one in the same folder replaces."""
BESIDE = ("compare.json", "modes.png", "modes.svg", "plan.json")
"""Files of commands that share the folder with a fit: they do not make it a used one."""
_DRAWN_BESIDE = ("modes-", "plan.", "plan-bench")


class OutputFolder:
    """Where the files of a run go; made by `open`, not before."""

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self._is_new = False
        self._lock: IO[bytes] | None = None

    @property
    def checkpoint(self) -> Path:
        """Folder of the unfinished run's chains."""
        return self.path / CHECKPOINT

    @property
    def earlier(self) -> Path:
        """Where the results of an earlier run lie until those of this one are whole."""
        return self.checkpoint / EARLIER

    def require_usable(self, *, force: bool, resume: bool) -> None:
        """Check, before any work and without writing, that the run may use this folder: InputError, CheckpointError."""
        has_content = any(map(_is_of_a_run, names_in(self.path)))
        self._is_new = not force and not resume
        if resume:
            if not os.path.isdir(self.checkpoint):
                state = "a finished run" if os.path.exists(self.path / SUMMARY) else "nothing to resume"
                raise CheckpointError(
                    f"{self.path}: wanted the checkpoint of an interrupted run, got {state} (--force runs it anew)"
                )
        elif has_content and not force:
            raise self._not_new()

    def _not_new(self) -> InputError:
        wanted, got = "a new folder", "one that exists"
        remedy = "--force replaces its results, --resume continues an interrupted run, --out takes another place"
        return InputError(Fault(f"--out {self.path}", wanted, got, remedy))

    def open(self, *, resume: bool) -> None:
        """Make the folder and take it; unless resuming, remove the checkpoint of an earlier run.

        The results of an earlier run are laid aside until this one is done (`earlier`). A run that is resumed may yet
        turn out to be another one: what it left stays until there is something better. InputError where it cannot be
        written or has been used since it was found to be new, CheckpointError where another run is at work in it.
        """
        make_folder(self.path)
        self._lock = take(self.checkpoint)
        if (held := _HELD.get()) is not None:
            held.append(self)
        if self._is_new and (self.has_checkpoint or any(path.exists() for path in self._results())):
            raise self._not_new()
        try:
            if not resume:
                self._lay_aside()
                for path in self.checkpoint.iterdir():
                    if path.is_dir() and path != self.earlier:
                        shutil.rmtree(path)
        except OSError as error:
            fault = Fault(f"--out {self.path}", "a folder that can be written", error.strerror or str(error))
            raise InputError(fault) from error

    def _lay_aside(self) -> None:
        """Move the results of an earlier run away; what a run left that has some there already was never whole."""
        for path in self._results():
            kept = self.earlier / path.relative_to(self.path)
            if kept.exists():
                path.unlink(missing_ok=True)
            elif path.exists():
                kept.parent.mkdir(parents=True, exist_ok=True)
                path.rename(kept)
            _remove_empty(path.parent, self.path)

    def _put_back(self) -> None:
        """Move the earlier results back from where a run left nothing in their place."""
        if not self.earlier.is_dir() or any(path.exists() for path in self._results()):
            return
        for kept in [path for path in self.earlier.rglob("*") if path.is_file()]:
            place = self.path / kept.relative_to(self.earlier)
            place.parent.mkdir(parents=True, exist_ok=True)
            kept.rename(place)
        shutil.rmtree(self.earlier)

    def _results(self) -> list[Path]:
        """Where results and figures of a run are, not what else somebody keeps in the folder."""
        before, boards = self.path / BEFORE, self.path / BOARDS
        places = [self.path, before, *before.glob("*/"), *boards.glob("*/")]
        drawn = (path for place in places for path in (place / FIGURES).glob("*") if path.suffix in (".png", ".svg"))
        priors = self.path.glob(f"*{OF_POPULATION}.toml")
        return [*(place / name for place in places for name in RESULTS), *drawn, *priors]

    @property
    def has_checkpoint(self) -> bool:
        """Whether there are chains of a run to go on from."""
        return any(self.checkpoint.rglob(CHAINS))

    def close(self) -> None:
        """Remove the checkpoint of a run that is done, and what it replaces."""
        shutil.rmtree(self.earlier, ignore_errors=True)
        for chains in sorted(self.checkpoint.rglob(CHAINS), reverse=True):
            Checkpoint(chains.parent, "").discard()
        shutil.rmtree(self.checkpoint, ignore_errors=True)

    def release(self) -> None:
        """Let others use the folder, and leave none behind that holds nothing."""
        if not self.has_checkpoint:
            with suppress(OSError):
                self._put_back()
        if not self.has_checkpoint and not self.earlier.exists():
            shutil.rmtree(self.checkpoint, ignore_errors=True)
            with suppress(OSError):  # not empty
                self.path.rmdir()
        if self._lock is not None:
            self._lock.close()


_HELD: ContextVar[list[OutputFolder] | None] = ContextVar("folders that the run in progress holds", default=None)


@contextmanager
def run_of_its_own() -> Iterator[None]:
    """A run that keeps the folder it opens until it ends, however it ends; to be put above a function.

    After the first checkpoint a KeyboardInterrupt becomes a RunInterrupted, an UnwritableError a CheckpointError.
    """
    held: list[OutputFolder] = []
    token = _HELD.set(held)
    try:
        yield
    except KeyboardInterrupt:
        if any(folder.has_checkpoint for folder in held):
            raise RunInterrupted("interrupted; --resume continues from the last checkpoint") from None
        raise
    except CheckpointError as error:
        if where := _where_the_earlier_are(held):
            raise CheckpointError(f"{error}{where}") from error
        raise
    except UnwritableError as error:
        if any(folder.has_checkpoint for folder in held):
            saved = "what was sampled is saved: make room, and --resume continues"
            raise CheckpointError(f"{error}\n{saved}{_where_the_earlier_are(held)}") from error
        raise
    finally:
        _HELD.reset(token)
        for folder in held:
            folder.release()


def _where_the_earlier_are(held: list[OutputFolder]) -> str:
    """A line for each folder whose earlier results lie aside."""
    return "".join(f"\nwhat was there before is in {folder.earlier}" for folder in held if folder.earlier.is_dir())


def _remove_empty(folder: Path, above: Path) -> None:
    """Remove a folder that is empty now, and those that it leaves empty; all of them lie below another one."""
    with suppress(OSError):  # not there, or not empty
        while folder != above:
            folder.rmdir()
            folder = folder.parent


def _is_of_a_run(name: str) -> bool:
    return name not in BESIDE and not (name.startswith(_DRAWN_BESIDE) and name.endswith((".png", ".svg")))
