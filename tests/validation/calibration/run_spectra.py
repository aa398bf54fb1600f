"""Calibrate fits of bare peaks: `python tests/validation/calibration/run_spectra.py --out spectra.jsonl`.

Prints how often pairs of a peak and a mode are true that were given some probability, and how often intervals of 90 %
hold the truth, beside the control that takes the most probable assignment for sure. Exit code 0: calibrated; 1: not;
2: usage. A run that was interrupted goes on where it stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.planted import Settings
from validation.calibration.records import Record
from validation.calibration.spectra import (
    ALLOWED,
    COVERED,
    MISSED,
    N_LABELLED,
    N_MODES,
    coverage,
    doubtful,
    is_calibrated,
    limits,
    reliability,
    simulate_one,
    taken_for_sure,
)  # fmt: skip
from validation.calibration.study import Page, Study, arguments, carry_out, numbered

ABOUT = (
    "Of pairs that are given a probability, a share as large should be true; the standard error beside it is that of "
    f"independent pairs, and {ALLOWED:g} of them, and one pair, are allowed. Intervals of 90 % should hold the truth "
    "on {:.0f} to {:.0f} % of the boards, as far as their number tells (one-sided bounds of 95 %). Boards in doubt are "
    "those on which half a peak or more is expected to be taken wrongly."
).format(*(100.0 * share for share in COVERED))
PAGE = Page("spectra", "Fits of bare peaks: are their probabilities as stated?", ABOUT)


def study(n_boards: int) -> Study:
    """So many boards."""
    settings = Settings()
    identity = {"format": 2, "settings": asdict(settings), "modes": N_MODES, "missed": MISSED, "labelled": N_LABELLED}
    return Study(
        simulate_one, identity, numbered(settings, n=n_boards), lambda records: (told(records), is_calibrated(records))
    )


def told(records: Sequence[Record]) -> list[str]:
    """What came out, line by line."""
    failed = [record for record in records if "error" in record]
    seconds = sorted(record["seconds"] for record in records)
    lines = [
        f"{len(records)} boards, {len(failed)} without an answer, median {seconds[len(seconds) // 2]:.0f} s",
        "",
        "pairs of a peak and a mode, or none",
        f"{'probability':>12s} {'pairs':>6s} {'true':>7s} {'expected':>9s}",
    ]
    lines += [
        f"{row['low']:5.2f}-{row['high']:5.2f}  {row['n']:6d} {row['true']:7.3f} {row['mean']:9.3f} +- {row['sd']:.3f}"
        for row in reliability(records)
    ]
    n_exchanged = sum(record.get("exchanged", 0) for record in records)
    n_sure, n_false = taken_for_sure(records)
    lines += [
        f"{n_exchanged} readings were exchanged by the noise with another; they count in the order of frequency",
        f"{n_sure} labels are the most probable: taken for sure, {n_false} of them are false",
    ]
    for words, some in ("all boards", records), ("boards in doubt", doubtful(records)):
        lines += [
            "",
            f"intervals of 90 % that hold the truth, {words}",
            f"{'':8s} {'summed':>12s} {'assigned for sure':>18s}",
        ]
        summed, control = coverage(some, "holds"), coverage(some, "control")
        for name, (hits, n) in summed.items():
            sure, m = control[name]
            lines.append(f"{name:8s} {hits:4d} of {n:4d} {sure:10d} of {m:4d}")
    lines += ["", *(f"{'met' if is_met else 'MISSED'}: {words}" for words, is_met in limits(records).items())]
    return [*lines, "first error: " + failed[0]["error"][:200]] if failed else lines


def main() -> int:
    """Run the command."""
    options = arguments(__doc__, 200, "boards").parse_args()
    return carry_out(study(options.n), PAGE, options)


if __name__ == "__main__":
    sys.exit(main())
