"""The output folder of a run: never overwritten without --force, every file complete or absent."""

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
from bayesplate.locks import lock_folder
from bayesplate.posterior.checkpoint import CHAINS, Checkpoint

SUMMARY_FILE = "summary.json"
ARCHIVE_FILE = "posterior.nc"
DIAGNOSIS_FILE = "diagnosis.json"
CHECKPOINT_FOLDER = "checkpoint"
BEFORE_FOLDER = "before"
"""Subfolder of the first fit, where a diagnosis fitted the board again."""
BOARDS_FOLDER = "boards"
"""Subfolder of a campaign, with one folder per board."""
POPULATION_SUFFIX = "-population"
"""End of the name of the prior card that a campaign writes for its next board."""
PAGE_FILE = "report.html"
FIGURES_FOLDER = "figures"
CONSTANTS_FILES = ("constants.csv", "constants.tex")
BEFORE_AFTER_FILES = ("before-after.csv", "before-after.tex")
KNOWN_EFFECTS_FILES = ("known-effects.csv", "known-effects.tex")
EARLIER_FOLDER = "earlier"
"""Subfolder of the checkpoint with the results that a run replaces, until it is done."""
GRADING_PAGE = "grading.html"
BATCH_FILES = ("batch.json", "boards.jsonl", "boards.csv", "boards.parquet", "grading.csv", GRADING_PAGE)
RESULT_FILES = (
    SUMMARY_FILE,
    ARCHIVE_FILE,
    DIAGNOSIS_FILE,
    PAGE_FILE,
    *CONSTANTS_FILES,
    *BEFORE_AFTER_FILES,
    *KNOWN_EFFECTS_FILES,
    *BATCH_FILES,
)
"""Files of a run besides its figures; the next run in the same folder replaces them."""
_MARKS = (SUMMARY_FILE, DIAGNOSIS_FILE, *BATCH_FILES[:2], CHECKPOINT_FOLDER)
"""What every run leaves in its folder: without one of these the files of a folder are the user's."""
COMPANION_FILES = ("compare.json", "modes.png", "modes.svg", "plan.json")
"""Files of commands that may share the folder with a fit: a folder with these alone counts as new."""
_COMPANION_FIGURES = ("modes-", "plan.", "plan-bench")
_MOST_NAMED = 3


class OutputFolder:
    """The folder of a run's files; `open` makes it."""

    def __init__(self, path: Path) -> None:
        self.path = Path(path)
        self._is_new = False
        self._lock: IO[bytes] | None = None

    @property
    def checkpoint(self) -> Path:
        """Folder of the unfinished run's chains."""
        return self.path / CHECKPOINT_FOLDER

    @property
    def earlier(self) -> Path:
        """Folder of an earlier run's results until those of this run are complete."""
        return self.checkpoint / EARLIER_FOLDER

    def require_usable(self, *, force: bool, resume: bool) -> None:
        """Check, before any work and without writing, that the run may use this folder: InputError, CheckpointError."""
        names = names_in(self.path)
        has_content = any(map(_is_run_file, names))
        self._is_new = not force and not resume
        if resume:
            if not os.path.isdir(self.checkpoint):
                is_finished = os.path.exists(self.path / SUMMARY_FILE)
                state = "a finished run (--force runs it anew)" if is_finished else "nothing to resume"
                raise CheckpointError(f"{self.path}: wanted the checkpoint of an interrupted run, got {state}")
        elif has_content and not {*_MARKS} & {*names}:
            other_files = ", ".join(sorted(filter(_is_run_file, names))[:_MOST_NAMED])
            wanted, remedy = "a new folder, or one of an earlier run", "--out takes another place"
            raise InputError(Fault(f"--out {self.path}", wanted, f"other files: {other_files}", remedy))
        elif has_content and not force:
            raise self._used_folder_error()

    def _used_folder_error(self) -> InputError:
        wanted, got = "a new folder", "one that exists"
        remedy = "--force replaces its results, --resume continues an interrupted run, --out takes another place"
        return InputError(Fault(f"--out {self.path}", wanted, got, remedy))

    def open(self, *, resume: bool) -> None:
        """Make the folder and lock it; unless resuming, remove the checkpoint of an earlier run.

        The results of an earlier run are moved to `earlier` until this run is done. A resumed run leaves them in place,
        for its checkpoint may turn out to belong to another run. InputError where the folder cannot be written or has
        been used since `require_usable`, CheckpointError where another run holds its lock.
        """
        make_folder(self.path)
        self._lock = lock_folder(self.checkpoint)
        if (open_folders := _OPEN_FOLDERS.get()) is not None:
            open_folders.append(self)
        if self._is_new and (self.has_checkpoint or any(path.exists() for path in self._result_paths())):
            raise self._used_folder_error()
        try:
            if not resume:
                self._set_results_aside()
                for path in self.checkpoint.iterdir():
                    if path.is_dir() and path != self.earlier:
                        shutil.rmtree(path)
        except OSError as error:
            fault = Fault(f"--out {self.path}", "a folder that can be written", error.strerror or str(error))
            raise InputError(fault) from error

    def _set_results_aside(self) -> None:
        """Move the results of an earlier run to `earlier`; where it has a file already, the newer one is incomplete."""
        for path in self._result_paths():
            earlier_path = self.earlier / path.relative_to(self.path)
            if earlier_path.exists():
                path.unlink(missing_ok=True)
            elif path.exists():
                earlier_path.parent.mkdir(parents=True, exist_ok=True)
                path.rename(earlier_path)
            _remove_empty_folders(path.parent, self.path)

    def _restore_results(self) -> None:
        """Move the earlier results back, unless this run has left results."""
        if not self.earlier.is_dir() or any(path.exists() for path in self._result_paths()):
            return
        for earlier_path in [path for path in self.earlier.rglob("*") if path.is_file()]:
            target = self.path / earlier_path.relative_to(self.earlier)
            target.parent.mkdir(parents=True, exist_ok=True)
            earlier_path.rename(target)
        shutil.rmtree(self.earlier)

    def _result_paths(self) -> list[Path]:
        """Paths of a run's results and figures; other files in the folder are the user's."""
        before_folder, boards_folder = self.path / BEFORE_FOLDER, self.path / BOARDS_FOLDER
        folders = [self.path, before_folder, *before_folder.glob("*/"), *boards_folder.glob("*/")]
        figures = (
            path
            for folder in folders
            for path in (folder / FIGURES_FOLDER).glob("*")
            if path.suffix in (".png", ".svg")
        )
        priors = self.path.glob(f"*{POPULATION_SUFFIX}.toml")
        return [*(folder / name for folder in folders for name in RESULT_FILES), *figures, *priors]

    @property
    def has_checkpoint(self) -> bool:
        """Whether there are chains from which a run can be resumed."""
        return any(self.checkpoint.rglob(CHAINS))

    def close(self) -> None:
        """Remove the checkpoint of a finished run, and the earlier results that it replaces."""
        shutil.rmtree(self.earlier, ignore_errors=True)
        for chains in sorted(self.checkpoint.rglob(CHAINS), reverse=True):
            Checkpoint(chains.parent, "").discard()
        shutil.rmtree(self.checkpoint, ignore_errors=True)

    def release(self) -> None:
        """Unlock the folder, and remove it if it is empty."""
        if not self.has_checkpoint:
            with suppress(OSError):
                self._restore_results()
        if not self.has_checkpoint and not self.earlier.exists():
            shutil.rmtree(self.checkpoint, ignore_errors=True)
            with suppress(OSError):  # not empty
                self.path.rmdir()
        if self._lock is not None:
            self._lock.close()


_OPEN_FOLDERS: ContextVar[list[OutputFolder] | None] = ContextVar(
    "folders that the run in progress holds", default=None
)


@contextmanager
def hold_output_folders() -> Iterator[None]:
    """Release the output folders that a run opens when it ends, however it ends; a decorator or a context.

    After the first checkpoint a KeyboardInterrupt becomes a RunInterrupted, an UnwritableError a CheckpointError.
    """
    open_folders: list[OutputFolder] = []
    token = _OPEN_FOLDERS.set(open_folders)
    try:
        yield
    except KeyboardInterrupt:
        if any(folder.has_checkpoint for folder in open_folders):
            raise RunInterrupted("interrupted; --resume continues from the last checkpoint") from None
        raise
    except CheckpointError as error:
        if note := _earlier_results_note(open_folders):
            raise CheckpointError(f"{error}{note}") from error
        raise
    except UnwritableError as error:
        if any(folder.has_checkpoint for folder in open_folders):
            saved = "what was sampled is saved: make room, and --resume continues"
            raise CheckpointError(f"{error}\n{saved}{_earlier_results_note(open_folders)}") from error
        raise
    finally:
        _OPEN_FOLDERS.reset(token)
        for folder in open_folders:
            folder.release()


def _earlier_results_note(open_folders: list[OutputFolder]) -> str:
    """A line for each folder whose earlier results are set aside."""
    return "".join(
        f"\nwhat was there before is in {folder.earlier}" for folder in open_folders if folder.earlier.is_dir()
    )


def _remove_empty_folders(folder: Path, above: Path) -> None:
    """Remove a folder if it is empty, then its parents that are empty, up to `above`."""
    with suppress(OSError):  # not there, or not empty
        while folder != above:
            folder.rmdir()
            folder = folder.parent


def _is_run_file(name: str) -> bool:
    return name not in COMPANION_FILES and not (name.startswith(_COMPANION_FIGURES) and name.endswith((".png", ".svg")))
