"""Put warp and the exciter on trial: `python tests/validation/trial/warped_or_driven.py --out results/warped.jsonl`.

As `run` does with the cells of the trial, with causes that joined the library later. Writes trial-warp-exciter.md.
Exit code 0: every limit met; 1: some are missed; 2: usage. An interrupted run goes on where it stopped if it is given
the same file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation import measured
from validation.calibration.study import arguments
from validation.trial.cells import WARPED_OR_DRIVEN
from validation.trial.counts import Record, truth
from validation.trial.page import judged, plain, tables
from validation.trial.run import run
from validation.trial.summary import summarise

BASE_SEED = 10
"""Boards that no rule was made on."""
NAME = "trial-warp-exciter"
HEAD = (
    "# The trial of warp and the exciter",
    "",
    "Written by `make trial-warp-exciter`; do not edit. Boards that are not flat, and boards that an exciter drives, "
    "planted and judged as those of [the trial](trial.md), whose words and acceptance limits these are; they joined "
    "the library after it. Beside them boards that lack nothing, or have another effect, in the same setups. Warp is "
    "drawn as sawn boards have it, cup, bow and twist each about flat, so that many boards have too little to be seen; "
    "in a frame a fifth of that. The exciter is one of 48 g, whose coil and suspension are drawn; the card names it "
    "and its place, and not what it weighs. Both keep the size that nature or the maker gave them.",
    "",
    "Two runs before this one, both of base seed 8, led to changes. The first named 28 of 150 free boards with warp "
    "wrongly, most as a stiff support: `diagnose` tried cup with bow, or twist, and not all three. It tries them at "
    "once since. The second named 9 of 100 boards of two setups outside the library, eight ribs as warp: an effect is "
    "needed only from odds of three to one since, a rule chosen on boards of the trial. These boards are new.",
    "",
)


def page(summary: Mapping[str, Any], records: Sequence[Record]) -> list[str]:
    """Lines of the page."""
    return [*HEAD, *judged(summary), "", *_in_part(records), "", *tables(summary)]


def _in_part(records: Sequence[Record]) -> list[str]:
    """Of each cell how many boards are unexplained, and of these how many are named in part, rightly or wrongly."""
    lines = ["Unexplained, and named in part:", ""]
    for name in dict.fromkeys(record["cell"] for record in records):
        own = [record for record in records if record["cell"] == name and record["word"] == "unexplained"]
        part = [record for record in own if record["in_part"]]
        right = sum(truth(record).issuperset(record["in_part"]) for record in part)
        lines.append(f"- {name}: {len(own)} unexplained, {len(part)} named in part, {right} of these rightly")
    return lines


def main() -> int:
    """Run the command."""
    most = max(cell.n for cell in WARPED_OR_DRIVEN)
    options = arguments(__doc__, most, "boards", "of each cell at most").parse_args()
    records = run(
        WARPED_OR_DRIVEN, options.out, workers=options.workers or 2, base_seed=BASE_SEED, most=options.n,
        only_read=not options.workers,
    )  # fmt: skip
    summary = plain(summarise(records, BASE_SEED, WARPED_OR_DRIVEN))
    lines = page(summary, [record for record in records if "error" not in record])
    print("\n".join(lines))
    if options.publish is not None:
        options.publish.mkdir(parents=True, exist_ok=True)
        (options.publish / f"{NAME}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
        measured.note(options.publish, NAME)
    return 0 if all(limit["met"] for limit in summary["limits"]) else 1


if __name__ == "__main__":
    sys.exit(main())
