"""A virtual environment for each peer, from fixed versions; what cannot be had is told, not raised."""

from __future__ import annotations

import subprocess
import sys
import venv
from pathlib import Path

from validation.benchmarks.peers.registry import Peer

LONGEST = 1800.0
"""Seconds that an installation may take."""


class Unavailable(Exception):
    """A peer that cannot be installed or imported here, with the last line of what went wrong."""


def python_of(peer: Peer, folder: Path) -> Path:
    """The interpreter of a peer's environment, made if it is not there yet.

    Raises
    ------
    Unavailable
        If pip or the import fails.
    """
    place = folder / peer.environment
    binaries = place / ("Scripts" if sys.platform == "win32" else "bin")
    python = binaries / ("python.exe" if sys.platform == "win32" else "python")
    stamp = place / "installed"
    wanted = "\n".join(peer.requirements) + "\n"
    if not stamp.exists() or stamp.read_text(encoding="utf-8") != wanted:
        venv.EnvBuilder(with_pip=True, clear=True).create(place)
        _run([str(python), "-m", "pip", "install", "--quiet", *peer.requirements], "pip")
        _run([str(python), "-c", f"import {peer.imports}"], "import")  # compiles its modules, as a user has them
        stamp.write_text(wanted, encoding="utf-8")
    return python


def _run(command: list[str], what: str) -> None:
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=LONGEST)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise Unavailable(f"{what}: {type(error).__name__}") from error
    if done.returncode:
        lines = [line for line in done.stderr.splitlines() if line.strip() and not line.startswith("WARNING")]
        raise Unavailable(f"{what}: {lines[-1] if lines else 'failed'}")
