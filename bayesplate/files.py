"""Writing files: each is whole or absent, and none is replaced unasked."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from bayesplate.errors import Fault, InputError, UnwritableError


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """A stream to a partial file, which replaces the file when complete, even after a power cut; raises OSError."""
    partial = path.with_name(path.name + ".partial")
    try:
        with partial.open("wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def catch_write_errors(path: Path) -> Iterator[None]:
    """Write files at a path: an OSError becomes an UnwritableError that names it."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        wanted, remedy = "a file that can be written", "make room, or take another place with --out"
        raise UnwritableError(Fault(str(path), wanted, reason, remedy)) from error


def write_bytes(path: Path, data: bytes) -> None:
    """Write a file completely or not at all; raises UnwritableError."""
    with catch_write_errors(path), whole_file(path) as stream:
        stream.write(data)


def write_text(path: Path, text: str) -> None:
    """Write a text file completely or not at all; raises UnwritableError."""
    write_bytes(path, text.encode("utf-8"))


def make_folder(folder: Path) -> None:
    """Make the folder of an output; raises UnwritableError."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        fault = Fault(f"--out {folder}", "a folder that can be written", error.strerror or str(error))
        raise UnwritableError(fault) from error


def names_in(folder: Path) -> list[str]:
    """Names in a folder of outputs, none where there is no folder yet; raises InputError if it cannot be listed."""
    try:
        return os.listdir(folder)
    except FileNotFoundError:
        return []
    except OSError as error:
        is_file = os.path.exists(folder) and not os.path.isdir(folder)
        got = "a file" if is_file else error.strerror or str(error)
        raise InputError(Fault(f"--out {folder}", "a folder", got, "choose another place")) from None


def require_new_files(folder: Path, names: Iterable[str], *, force: bool) -> tuple[Path, ...]:
    """The files that a command will write, checked before any work; InputError if one is there and not `force`."""
    present = set(names_in(folder))
    paths = tuple(folder / name for name in names)
    conflicts = [path.name for path in paths if path.name in present]
    if conflicts and not force:
        wanted, remedy = "new files", "--force replaces them, --out takes another place"
        raise InputError(Fault(f"--out {folder}", wanted, f"{', '.join(conflicts)} already there", remedy))
    return paths
