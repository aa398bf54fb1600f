"""Records of simulations, one JSON line each, in a file that an interrupted run goes on with."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

Record = dict[str, Any]


def read_done(path: Path, identity: Record) -> list[Record]:
    """Records of a file of the same identity, its first line; a last line that was cut off is forgotten.

    A file that does not exist is begun.
    """
    if not path.exists() or not path.read_text().strip():
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(identity) + "\n")
        return []
    lines = path.read_text().splitlines(keepends=True)
    if json.loads(lines[0]) != identity:
        raise SystemExit(f"{path}: made with another design, wanted {json.dumps(identity)}")
    whole = [line for line in lines if line.endswith("\n")]
    if len(whole) < len(lines):
        path.write_text("".join(whole))
    return [json.loads(line) for line in whole[1:]]


def add_to(
    path: Path, simulate: Callable[..., Record], jobs: Sequence[tuple[Any, ...]], workers: int, *, quiet: bool = False
) -> list[Record]:
    """Simulate every job in processes of its own, and append each record to the file as soon as it is there.

    Parameters
    ----------
    path : Path
    simulate : callable
        Of the items of a job; a function that another process can import.
    jobs : sequence of tuple
    workers : int
        Processes.
    quiet : bool
        Without a word on how long it takes.

    Returns
    -------
    list of dict
        In the order in which they were finished.
    """
    started = time.perf_counter()
    records: list[Record] = []
    with ProcessPoolExecutor(workers) as pool, path.open("a") as file:
        futures = [pool.submit(simulate, *job) for job in jobs]
        try:
            for count, future in enumerate(as_completed(futures), start=1):
                records.append(future.result())
                file.write(json.dumps(records[-1]) + "\n")
                file.flush()
                if not quiet and (count % 10 == 0 or count == len(futures)):
                    left = (time.perf_counter() - started) / count * (len(futures) - count)
                    print(f"{count} of {len(futures)} done, {left / 60:.1f} minutes left", file=sys.stderr, flush=True)
        except BaseException:
            pool.shutdown(cancel_futures=True)  # or all that are left would be simulated, and no record written
            raise
    return records
