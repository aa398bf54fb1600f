"""Files that are written completely or not at all; what the system refuses is told with the place."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bayesplate.errors import Fault, UnwritableError


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Writing a file or a folder's files: what the system refuses is told with the place.

    Raises
    ------
    UnwritableError
        In place of an OSError.
    """
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        wanted, remedy = "a file that can be written", "make room, or take another place with --out"
        raise UnwritableError(Fault(str(path), wanted, reason, remedy)) from error


def make_folder(folder: Path) -> None:
    """Make the folder of an output.

    Raises
    ------
    InputError
        If it cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fault = Fault(f"--out {folder}", "a folder that can be written", error.strerror or str(error))
        raise UnwritableError(fault) from error


def write_text(path: Path, text: str) -> None:
    """Write a text file completely or not at all; raises as `write_bytes`."""
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file completely or not at all.

    Raises
    ------
    UnwritableError
        If the disk is full or the place is not ours.
    """
    partial = path.with_name(path.name + ".partial")
    with writing(path):
        try:
            with partial.open("wb") as stream:
                stream.write(data)
                stream.flush()
                os.fsync(stream.fileno())
            os.replace(partial, path)
        finally:
            partial.unlink(missing_ok=True)
