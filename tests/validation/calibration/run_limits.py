"""Write the page of acceptance limits: `python tests/validation/calibration/run_limits.py --publish docs/validation`.

Runs the tests that measure something against a limit, quick and slow ones, and writes every limit with the worst value
that was measured beside it. A limit that no test measures is printed as not measured. Exit code 0: every limit is met;
1: some are missed, and stay on the page as missed; 2: usage.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from limits import NOTES
from validation import measured as of_pages
from validation.calibration.limit_rows import ROWS, Row

ROOT = Path(__file__).resolve().parents[3]
Note = dict[str, Any]
COMMAND = "make limits"


def measuring() -> list[Path]:
    """Test files that hold something against a limit."""
    every = sorted((ROOT / "tests").rglob("test_*.py"))
    files = {file for file in every if "from limits import" in file.read_text(encoding="utf-8")}
    named = (test.partition("::")[0] for rows in ROWS.values() for row in rows for test in row.tests)
    return sorted(files | {ROOT / "tests" / name for name in named})


def measured(files: Sequence[Path], workers: int, *, with_slow: bool) -> tuple[list[Note], dict[str, bool]]:
    """Run tests; what they noted, and whether each of them passed, by file and name; skipped ones are left out."""
    with tempfile.TemporaryDirectory() as folder:
        notes, outcome = Path(folder, "notes.jsonl"), Path(folder, "outcome.xml")
        notes.touch()
        chosen = [] if with_slow else ["-m", "not slow"]
        options = ["-q", "-n", str(workers), "--dist", "loadfile", f"--junitxml={outcome}", *chosen]
        program = [sys.executable, "-m", "pytest", *options, *map(str, files)]
        subprocess.run(program, cwd=ROOT, env={**os.environ, NOTES: str(notes)}, check=False)
        lines = notes.read_text(encoding="utf-8").splitlines()
        return [json.loads(line) for line in lines], passed(ElementTree.parse(outcome).getroot())


def passed(outcome: ElementTree.Element) -> dict[str, bool]:
    """Whether each test passed, by file and name, from what pytest wrote of a run."""
    found = {}
    for case in outcome.iter("testcase"):
        if case.find("skipped") is None:
            file = case.get("classname", "").removeprefix("tests.").replace(".", "/")
            is_whole = case.find("failure") is None and case.find("error") is None
            found[f"{file}.py::{case.get('name')}"] = is_whole
    return found


def page(notes: Sequence[Note], tests: Mapping[str, bool]) -> list[str]:
    """Lines of the page.

    Parameters
    ----------
    notes : sequence of dict
    tests : dict of bool
        Whether each passed, by file and name.
    """
    unknown = {note["check"] for note in notes} - {row.check for rows in ROWS.values() for row in rows}
    if unknown:
        raise ValueError(f"no row for {', '.join(sorted(unknown))}")
    lines = [
        "# Acceptance limits, and what was measured",
        "",
        f"Written by `{COMMAND}`; do not edit. Each figure was measured by the test that asserts its limit; of several "
        "boards, edges or parameters the worst is shown. The trial of `diagnose`, the calibration of recordings and "
        "that of spectra have pages of their own.",
    ]
    for heading, rows in ROWS.items():
        lines += [
            "",
            f"## {heading}",
            "",
            "| what must hold | acceptance limit | measured | |",
            "| --- | --- | --- | --- |",
        ]
        lines += [line for row in rows for line in _lines(row, notes, tests)]
    return lines


def _lines(row: Row, notes: Sequence[Note], tests: Mapping[str, bool]) -> Iterable[str]:
    """One line for each quantity of a row."""
    found = [*_of_tests(row, tests), *_of_notes([note for note in notes if note["check"] == row.check])]
    if row.page:
        found.append((f"[on a page of its own]({row.page}.md)", ""))
    for number, (words, state) in enumerate(found or [("", "not measured")]):
        said = (row.words, row.limit) if number == 0 else ("", "")
        yield f"| {' | '.join(said)} | {words} | {state} |"


def _of_tests(row: Row, tests: Mapping[str, bool]) -> Iterable[tuple[str, str]]:
    """How many cases of a row's tests hold, and whether all do."""
    own = [is_passed for name, is_passed in tests.items() if name.startswith(row.tests)]
    if own:
        yield f"holds in {sum(own)} of {len(own)} cases", "met" if all(own) else "**missed**"


def _of_notes(own: Sequence[Note]) -> Iterable[tuple[str, str]]:
    """The worst value of each quantity, and whether all are within their limits."""
    for quantity in dict.fromkeys(note["quantity"] for note in own):
        same = [note for note in own if note["quantity"] == quantity]
        many = f", worst of {len(same)}" if len(same) > 1 else ""
        is_met = all(note["met"] for note in same)
        yield f"{quantity}: {_shown(max(same, key=_how_near))}{many}", "met" if is_met else "**missed**"


def _how_near(note: Note) -> float:
    """How near a value lies to the bound that it could break; larger is worse, and no number the worst."""
    low, high = note["limit"]
    if math.isnan(note["value"]):
        return math.inf
    below = math.inf if high is None else high - note["value"]
    above = math.inf if low is None else note["value"] - low
    return -min(below, above)


def _shown(note: Mapping[str, Any]) -> str:
    low, high = note["limit"]
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
    notes, tests = measured(measuring(), options.workers, with_slow=not options.quick)
    lines = page(notes, tests)
    if options.quick:
        lines[3:3] = ["", "The slow tests were left out."]
    options.publish.mkdir(parents=True, exist_ok=True)
    (options.publish / "limits.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    of_pages.note(options.publish, "limits")
    missed = [note for note in notes if not note["met"]]
    failed = [name for name, is_passed in tests.items() if not is_passed]
    print(f"{len(notes)} figures and {len(tests)} tests; {len(missed)} limits missed, {len(failed)} tests failed")
    print("\n".join(failed))
    return 1 if missed or failed else 0


if __name__ == "__main__":
    sys.exit(main())
