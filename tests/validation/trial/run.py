"""Put the search on trial: `python tests/validation/trial/run.py --workers 2 --out results/trial.jsonl`.

Plants boards with the independent generator, cell by cell of `cells`, judges each as `diagnose` would, and writes what
came out to docs/validation/trial.json and trial.md; beside them the records of a whole trial, compressed, or their
digest. An interrupted run goes on where it stopped if it is given the same file; if the code has changed since, one
board of each cell is judged again, and must come out as it did. Exit code 0: every limit met; 1: some are missed, and
stay there as missed; 2: usage.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation import measured
from validation.calibration.records import add_to, read_done
from validation.trial.cells import CELLS, Cell, identity, jobs
from validation.trial.judge import Record, judge_one
from validation.trial.page import write

BASE_SEED = 9
"""Boards of seeds 1 to 8 were looked at, or begun with, while rules and sizes could still change."""
DOCS = Path(__file__).resolve().parents[3] / "docs" / "validation"
SAME = 1e-3
"""Probabilities that agree to this are the same: refactoring and other processors change the last digits."""


def run(
    cells: Sequence[Cell], out: Path, *, workers: int = 2, base_seed: int = BASE_SEED, most: int | None = None,
    only_read: bool = False, quiet: bool = False,
) -> list[Record]:  # fmt: skip
    """Judge what is not judged yet, and return the records of the boards asked for, cell after cell.

    Parameters
    ----------
    cells : sequence of Cell
    out : Path
        The file that is gone on with.
    workers, base_seed : int
    most : int, optional
        Boards of a cell at most.
    only_read : bool
        Judge no board: return what there is.
    quiet : bool
        Without a word on how long it takes.
    """
    records = _begun(out, cells, base_seed, check=not only_read)
    done = {(record["cell"], record["index"]) for record in records}
    wanted = jobs(cells, most)
    left = [(cell, base_seed, index) for cell, index in wanted if (cell.name, index) not in done]
    if left and not only_read:
        records += add_to(out, judge_one, left, workers, quiet=quiet)
    by_board = {(record["cell"], record["index"]): record for record in records}
    order = {cell.name: place for place, cell in enumerate(cells)}
    keys = sorted(((cell.name, index) for cell, index in wanted), key=lambda key: (order[key[0]], key[1]))
    return [by_board[key] for key in keys if key in by_board]


def _begun(out: Path, cells: Sequence[Cell], base_seed: int, check: bool) -> list[Record]:
    """Records that are there already, if they are of this trial and this search."""
    wanted = identity(cells, base_seed)
    begun = out.read_text().splitlines()[:1] if out.exists() else []
    code = json.loads(begun[0]).get("code") if begun else None
    if code is None or code == wanted["code"]:
        return read_done(out, wanted)
    records = read_done(out, wanted | {"code": code})
    if check:
        _judge_again(records, cells, base_seed, out)
    return records


def _judge_again(records: Sequence[Record], cells: Sequence[Cell], base_seed: int, out: Path) -> None:
    """Refuse records that the code of today would not have made, by one board of each cell."""
    by_name = {cell.name: cell for cell in cells}
    one_of_each = {record["cell"]: record for record in records if "error" not in record}
    for record in one_of_each.values():
        again = judge_one(by_name[record["cell"]], base_seed, record["index"])
        alike = all(again.get(key) == record[key] for key in ("truth", "word", "claim"))
        if not alike or any(abs(again["inclusion"][k] - record["inclusion"][k]) > SAME for k in record["inclusion"]):
            raise SystemExit(
                f"{out}: {record['cell']}, board {record['index']} comes out otherwise since the code has changed: "
                f"was {record['word']}, is {again.get('word')}; begin a new file"
            )


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--boards", type=int, help="of each cell at most; absent: as many as the cell asks for")
    parser.add_argument("--base-seed", type=int, default=BASE_SEED)
    parser.add_argument("--summary", type=Path, default=DOCS, help="folder of trial.json and trial.md")
    parser.add_argument("--only-summary", action="store_true", help="judge no board, sum up those in the file")
    options = parser.parse_args()
    started = time.perf_counter()
    records = run(
        CELLS,
        options.out,
        workers=options.workers,
        base_seed=options.base_seed,
        most=options.boards,
        only_read=options.only_summary,
    )
    print(f"{len(records)} boards, {(time.perf_counter() - started) / 60:.1f} minutes")
    summary = write(records, options.base_seed, options.summary)
    if not options.only_summary:
        measured.note(options.summary, "trial")
    for limit in summary["limits"]:
        print(f"{'met   ' if limit['met'] else 'MISSED'} {limit['quantity']}: {limit['shown']}")
    return 0 if all(limit["met"] for limit in summary["limits"]) else 1


if __name__ == "__main__":
    sys.exit(main())
