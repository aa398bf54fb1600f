"""The records of a whole trial as they are published: compressed, or by their digest where that is too large."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from validation.trial.counts import Record

FILE = "trial-records.jsonl.gz"
MOST_BYTES = 3_000_000
COMMAND = "python tests/validation/trial/run.py --base-seed {} --out results/trial.jsonl"


def publish_records(
    records: Sequence[Record], base_seed: int, folder: Path, most_bytes: int = MOST_BYTES
) -> dict[str, Any]:
    """Write the records compressed, unless that takes too many bytes; what was there before goes.

    Parameters
    ----------
    records : sequence of dict
        In the order of the cells.
    base_seed : int
    folder : Path
    most_bytes : int
        Of the compressed file.

    Returns
    -------
    dict
        file (its name; None if there is none), lines, sha256 (of the text before it is compressed), command.
    """
    text = as_text(records)
    packed = packed_text(text)
    file = folder / FILE
    file.unlink(missing_ok=True)
    is_kept = len(packed) < most_bytes
    if is_kept:
        file.write_bytes(packed)
    return {
        "file": FILE if is_kept else None,
        "lines": len(records),
        "sha256": hashlib.sha256(text).hexdigest(),
        "command": COMMAND.format(base_seed),
    }


def as_text(records: Sequence[Record]) -> bytes:
    """One line of JSON a record, without the seconds that it took, which no second run would repeat."""
    kept = ({key: value for key, value in record.items() if key != "seconds"} for record in records)
    return "".join(json.dumps(record, separators=(",", ":")) + "\n" for record in kept).encode()


def packed_text(text: bytes) -> bytes:
    """The same bytes whenever they are packed: no name and no time."""
    into = io.BytesIO()
    with gzip.GzipFile(filename="", mode="wb", compresslevel=9, fileobj=into, mtime=0) as file:
        file.write(text)
    return into.getvalue()


def published_records(folder: Path) -> list[Record]:
    """The records of the compressed file."""
    return [json.loads(line) for line in gzip.decompress((folder / FILE).read_bytes()).splitlines()]
