"""Judge boards of the published trial again: `python tests/validation/trial/again.py --out results/trial-again.jsonl`.

The same boards, by their seeds, the first of each cell, judged by the package as it is now. Prints question by question
how many answer yes, in the published trial and now, and the verdicts that changed. Exit code 0: nothing is worse than
the scatter between two judgements would make it; 1: something is; 2: usage. A run that was interrupted goes on where it
stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from scipy import stats
from validation.calibration.study import Page, arguments
from validation.trial.cells import CELLS
from validation.trial.counts import (
    Record,
    is_best,
    is_claimed,
    is_covered,
    is_flagged,
    is_named,
    is_right_name,
    is_wrong_name,
)
from validation.trial.published import published_records
from validation.trial.run import DOCS, run

LEVEL = 0.01
"""Chance, one-sided, below which a count that is worse than before is no scatter."""
PAGE = Page(
    "trial-again",
    "Boards of the trial, judged again",
    "The first boards of each cell of [the trial](trial.md), by the same seeds, judged by the package as it was when "
    "this page was made. Worse: of the boards on which the two differ, more than chance would make it are worse now "
    f"(sign test, {100 * LEVEL:g} %). A claim counts as bad where nothing is planted, or nothing that is known.",
)
Question = Callable[[Record], bool]
QUESTIONS: dict[str, dict[str, tuple[Question, int]]] = {
    "null": {"flagged": (is_flagged, -1), "named": (is_named, -1), "claimed": (is_claimed, -1)},
    "one": {
        "right name": (is_right_name, 1),
        "wrong name": (is_wrong_name, -1),
        "in the set given": (is_covered, 1),
        "best is right": (is_best, 1),
        "claimed": (is_claimed, 0),
    },
    "two": {"both in the set": (is_covered, 1), "wrong name": (is_wrong_name, -1), "claimed": (is_claimed, 0)},
    "outside": {"falsely unique": (is_named, -1), "claimed": (is_claimed, -1)},
}
"""By kind of cell: questions of a record, and whether yes is good (1), bad (-1) or neither (0)."""


def told(before: Sequence[Record], now: Sequence[Record]) -> tuple[list[str], bool]:
    """Line by line what the same boards came out as, and whether nothing is worse."""
    lines, well = [f"{'':8s} {'question':18s} {'boards':>6s} {'then':>6s} {'now':>6s}"], True
    for kind, questions in QUESTIONS.items():
        pairs = [(a, b) for a, b in zip(before, now, strict=True) if a["cell"].split()[0] == kind]
        for words, (question, good) in questions.items():
            answers = [(bool(question(a)), bool(question(b))) for a, b in pairs]
            worse = sum((b - a) * good < 0 for a, b in answers)
            better = sum((b - a) * good > 0 for a, b in answers)
            p = stats.binomtest(worse, worse + better, 0.5, "greater").pvalue if worse else 1.0
            well &= p >= LEVEL
            then, today = (sum(each) for each in zip(*answers, strict=True)) if answers else (0, 0)
            mark = f"  WORSE, p {p:.1g}" if p < LEVEL else ""
            lines.append(f"{kind:8s} {words:18s} {len(pairs):6d} {then:6d} {today:6d}{mark}")
    changed = [(a, b) for a, b in zip(before, now, strict=True) if _answer(a) != _answer(b)]
    lines += ["", f"{len(changed)} of {len(now)} boards have another verdict, other effects in it, or another claim:"]
    lines += [f"  {b['cell']}, board {b['index']}: {_answer(a)} -> {_answer(b)}" for a, b in changed]
    return lines, well


def _answer(record: Record) -> str:
    effects = f" ({', '.join(record['effects'])})" if record["effects"] else ""
    return f"{record['word']}{effects}{', claimed' if record['claim'] else ''}"


def main() -> int:
    """Run the command."""
    options = arguments(__doc__, 16, "boards", "of each cell").parse_args()
    now = run(CELLS, options.out, workers=options.workers or 2, most=options.n, only_read=not options.workers)
    published = {(one["cell"], one["index"]): one for one in published_records(DOCS)}
    now = [one for one in now if "error" not in one and (one["cell"], one["index"]) in published]
    lines, well = told([published[one["cell"], one["index"]] for one in now], now)
    print("\n".join(lines))
    if options.publish is not None:
        PAGE.write(options.publish, lines)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
