"""A folder for sole use."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO

from bayesplate.errors import CheckpointError


def lock_folder(folder: Path) -> IO[bytes]:
    """Lock a folder, made if need be, for sole use until the stream is closed; CheckpointError if another run has it.

    The system frees the lock of a process that died, so none is ever stale.
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
        # The run that held the lock may have removed the file meanwhile: then this locks a deleted file.
        if path.exists() and os.path.samestat(os.fstat(stream.fileno()), path.stat()):
            break
        stream.close()
    with suppress(OSError):  # a full disk: the lock holds without a name in it
        stream.truncate(0)
        stream.write(str(os.getpid()).encode())
        stream.flush()
    return stream


def _try_lock(stream: IO[bytes]) -> bool:
    """Lock an open file for as long as it stays open; False if another one holds it, OSError if there are no locks."""
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
