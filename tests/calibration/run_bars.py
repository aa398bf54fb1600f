"""Write the page of all bars: `python tests/calibration/run_bars.py --publish docs/validation`.

Runs the tests that measure something against a bar, quick and slow ones, and writes every bar with the worst value that
was measured beside it. A bar that no test measures is printed as not measured. Exit code 0: every bar is met; 1: some
are missed, and stay on the page as missed; 2: usage.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from bars import NOTES
from calibration.bar_rows import ROWS, Row

ROOT = Path(__file__).resolve().parents[2]
Note = dict[str, Any]
COMMAND = "make bars"


def measuring() -> list[Path]:
    """Test files that hold something against a bar."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [file for file in files if "from bars import" in file.read_text(encoding="utf-8")]


def measured(files: Sequence[Path], workers: int, *, with_slow: bool) -> tuple[list[Note], bool]:
    """Run tests; what they noted, and whether all of them passed."""
    with tempfile.TemporaryDirectory() as folder:
        notes = Path(folder, "notes.jsonl")
        notes.touch()
        chosen = [] if with_slow else ["-m", "not slow"]
        options = ["-q", "-n", str(workers), "--dist", "loadfile", *chosen]
        program = [sys.executable, "-m", "pytest", *options, *map(str, files)]
        ended = subprocess.run(program, cwd=ROOT, env={**os.environ, NOTES: str(notes)}, check=False)
        return [json.loads(line) for line in notes.read_text(encoding="utf-8").splitlines()], ended.returncode == 0


def page(notes: Sequence[Note]) -> list[str]:
    """Lines of the page."""
    unknown = {note["check"] for note in notes} - {row.check for rows in ROWS.values() for row in rows}
    if unknown:
        raise ValueError(f"no row for {', '.join(sorted(unknown))}")
    lines = [
        "# Every bar, and what was measured",
        "",
        f"Written by `{COMMAND}`; do not edit. Each figure was measured by the test that asserts its bar; of several "
        "boards, edges or parameters the worst is shown. The trial of `diagnose`, the calibration of recordings and "
        "that of spectra have pages of their own.",
    ]
    for heading, rows in ROWS.items():
        lines += ["", f"## {heading}", "", "| what must hold | bar | measured | |", "| --- | --- | --- | --- |"]
        lines += [line for row in rows for line in _lines(row, notes)]
    return lines


def _lines(row: Row, notes: Sequence[Note]) -> Iterable[str]:
    """One line for each quantity of a row."""
    own = [note for note in notes if note["check"] == row.check]
    if not own:
        yield f"| {row.words} | {row.bar} | | not measured |"
    for number, quantity in enumerate(dict.fromkeys(note["quantity"] for note in own)):
        same = [note for note in own if note["quantity"] == quantity]
        words = (row.words, row.bar) if number == 0 else ("", "")
        state = "met" if all(note["met"] for note in same) else "**missed**"
        worst = max(same, key=_how_near)
        many = f", worst of {len(same)}" if len(same) > 1 else ""
        yield f"| {' | '.join(words)} | {quantity}: {_shown(worst)}{many} | {state} |"


def _how_near(note: Note) -> float:
    """How near a value lies to the bound that it could break; larger is worse."""
    low, high = note["bar"]
    gaps = [
        bound - note["value"] if bound is high else note["value"] - bound for bound in (low, high) if bound is not None
    ]
    return -min(gaps)


def _shown(note: Mapping[str, Any]) -> str:
    low, high = note["bar"]
    scale, unit = (100.0, " %") if note["unit"] == "%" else (1.0, f" {note['unit']}" if note["unit"] else "")
    bounds = " and ".join(
        f"{word} {scale * bound:.4g}" for word, bound in (("at least", low), ("at most", high)) if bound is not None
    )
    return f"{scale * note['value']:.3g}{unit} ({bounds})"


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--publish", type=Path, required=True, help="folder of the page")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--quick", action="store_true", help="leave the slow tests out, and say so on the page")
    options = parser.parse_args()
    notes, is_passed = measured(measuring(), options.workers, with_slow=not options.quick)
    lines = page(notes)
    if options.quick:
        lines[3:3] = ["", "The slow tests were left out."]
    options.publish.mkdir(parents=True, exist_ok=True)
    (options.publish / "bars.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    missed = [note for note in notes if not note["met"]]
    print(f"{len(notes)} figures, {len(missed)} bars missed")
    return 0 if is_passed and not missed else 1


if __name__ == "__main__":
    sys.exit(main())
