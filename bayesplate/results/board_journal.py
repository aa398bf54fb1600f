"""The journal of a run over many boards: a line for each board that is done, kept for the next run over them.

A line is written at once and whole; what a killed run left of its last one is cut off, and one that was altered later
is none. A row is found by a key that says all that decides it, so that a card that was changed is another board, and
one that was moved is not.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bayesplate.files import whole_file, writing
from bayesplate.results.board_rows import BoardRow


class Journal:
    """Rows of boards on disk; in memory is only where those of earlier runs stand, by their keys.

    Parameters
    ----------
    path : Path
        Made if it is not there; what it holds is read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._places: dict[str, int] = {}
        with writing(path):
            self._stream = path.open("ab", buffering=0)
            self._lines = path.open("rb")
            self._read()

    def _read(self) -> None:
        """Where each row stands; the last line of a killed run, and any other that is damaged, are none."""
        end = 0
        for line in self._lines:
            if line.endswith(b"\n"):
                key = _key_of(line)
                if key is not None:
                    self._places[key] = end
                end += len(line)
        self._stream.truncate(end)

    def place(self, key: str) -> int | None:
        """Where the row of a key stands; None where no earlier run left one."""
        return self._places.get(key)

    def row(self, place: int) -> BoardRow:
        """The row that stands there."""
        return BoardRow.from_json(json.loads(self._line(place))["row"])

    def append(self, key: str, row: BoardRow) -> int:
        """Add a row, and return where it stands; raises UnwritableError at a full disk."""
        line = _line(key, row)
        with writing(self.path):
            start = os.fstat(self._stream.fileno()).st_size
            if self._stream.write(line) != len(line):
                self._stream.truncate(start)
                raise OSError("no space left")
        return start

    def rows(self, places: Sequence[int]) -> Sequence[BoardRow]:
        """The rows that stand there, in this order; each is read when it is asked for."""
        return _Rows(self, places)

    def keep(self, places: Iterable[int]) -> None:
        """Write the journal anew with these rows alone, in this order; it is closed then."""
        with writing(self.path), whole_file(self.path) as stream:
            stream.writelines(self._line(place) for place in places)
        self.close()

    def close(self) -> None:
        """Let go of the file."""
        self._stream.close()
        self._lines.close()

    def _line(self, place: int) -> bytes:
        self._lines.seek(place)
        return self._lines.readline()


@dataclass(frozen=True)
class _Rows(Sequence[BoardRow]):
    journal: Journal
    places: Sequence[int]

    def __len__(self) -> int:
        return len(self.places)

    def __getitem__(self, at: Any) -> Any:
        return self.journal.row(self.places[at])


def _line(key: str, row: BoardRow) -> bytes:
    """A row with its key and the hash of both, so that a line which was altered later is known."""
    content = row.to_json()
    whole = {"key": key, "sha256": _hash_of(key, content), "row": content}
    return json.dumps(whole, allow_nan=False).encode() + b"\n"


def _hash_of(key: str, content: Any) -> str:
    return hashlib.sha256(json.dumps([key, content], allow_nan=False).encode()).hexdigest()


def _key_of(line: bytes) -> str | None:
    """The key of a line; None if it is not as it was written."""
    try:
        found: Any = json.loads(line)
        key = str(found["key"])
        return key if found["sha256"] == _hash_of(key, found["row"]) else None
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
