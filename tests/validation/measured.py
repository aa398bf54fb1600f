"""When the pages of results were measured, and on which tree of the package: `measured.json` beside them.

`python tests/validation/measured.py docs/validation NAME` notes it of a page that an example wrote.
"""

from __future__ import annotations

import json
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

FILE = "measured.json"


def note(folder: Path, *names: str) -> None:
    """Note of pages, or of parts of one ("calibration, exact"), that they were measured today on the tree as it is."""
    path = folder / FILE
    known = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    entry = {"date": datetime.now(UTC).date().isoformat(), "tree": _tree()}
    path.write_text(json.dumps(known | dict.fromkeys(names, entry), indent=1, sort_keys=True) + "\n", encoding="utf-8")


def _tree() -> str:
    """The commit, marked where code or cards differ from it; empty without git."""

    def said(*words: str) -> str:
        root = Path(__file__).parents[2]
        return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True).stdout.strip()

    try:
        changed = said("status", "--porcelain", "--", "bayesplate", "models", "tests", "examples")
        return said("rev-parse", "--short=7", "HEAD") + (", changed" if changed else "")
    except (OSError, subprocess.CalledProcessError):
        return ""


if __name__ == "__main__":
    note(Path(sys.argv[1]), *sys.argv[2:])
