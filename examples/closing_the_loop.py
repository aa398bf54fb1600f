"""Closing the loop: from a measured board's residual to an effect, and the error before and after.

Eleven boards go through the same steps: fit, find the residual, search for an effect that the plate lacks, add it
where the readings name one, and compare the errors. Two columns of computed frequencies come from a shear-flexible
finite element model of somebody else; the ideal plate that is fitted to them knows nothing of shear, and the search has
to find it. The other boards are measured, and what their readings cannot tell is said as plainly as what they can.

    python examples/closing_the_loop.py --out closing-the-loop

prints one table and writes it as CSV.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from bayesplate.diagnosis.wording.diagnosis import Diagnosis
from bayesplate.diagnosis.wording.words import MERITS
from bayesplate.workflow.diagnose import diagnose

BOARDS = (
    "paper-cantilever-fe",
    "paper-clamped-fe",
    "finnish-spruce-cantilever",
    "fiemme-spruce-clamped",
    "nemus-D",
    "spruce-free-2L",
    "spruce-free-2R",
    "spruce-free-3R",
    "spruce-free-1R",
    "spruce-free-1L",
    "spruce-free-3L",
)
HEAD = """# Error before and after, board by board

Written by `examples/closing_the_loop.py`; do not edit. Each board is fitted as an ideal plate, an effect that it lacks
is searched for, and where the verdict is a name or a group, the most probable effect is fitted too.

- In sample, left out, nested: error in cents, rms over the modes, without the effect → with it. In sample: of the fit
  itself; left out: of each mode by a fit that has not seen it; nested: the same, and the effect is searched for again
  without that mode.
- E_x, E_y, G_xy: what the effect changes each constant by, in standard deviations of the first fit.
- Nearest: where nothing explains the board, the effect that comes nearest, and the error left out with it, in cents.

"""
COLUMNS = ("board", "verdict", "effects", "claim", "in sample", "left out", "nested", "E_x", "E_y", "G_xy", "nearest")


def close_the_loop(boards: Sequence[str] = BOARDS, seed: int = 1) -> dict[str, Diagnosis]:
    """Diagnose each board, and print its verdict as soon as it is there.

    Parameters
    ----------
    boards : sequence of str
        Names of shipped cards, or paths.
    seed : int

    Returns
    -------
    dict of Diagnosis
        By board.
    """
    found = {}
    for board in boards:
        found[board] = diagnose(board, seed=seed).diagnosis
        print(f"{len(found)} of {len(boards)} boards: {found[board]!r}", flush=True)
    return found


def rows(diagnoses: Mapping[str, Diagnosis]) -> list[tuple[str, ...]]:
    """One row per board: errors in cents before -> after, shift of each constant in standard deviations.

    The last column is for a board that nothing explains: what comes nearest, and the left-out error with it.
    """
    return [
        (
            name,
            one.verdict,
            ", ".join(one.effects) or "-",
            "error reduced" if one.claim else "no claim",
            *(f"{_cents(merit.of(one.before))} → {_cents(merit.of(one.after))}" for merit in MERITS if merit.is_rms),
            *(_signed(shift.shift_in_sd) for shift in one.elastic_shift.values()),
            _nearest(one),
        )
        for name, one in diagnoses.items()
    ]


def page(diagnoses: Mapping[str, Diagnosis]) -> str:
    """What the columns are, and the table."""
    return HEAD + markdown(diagnoses)


def markdown(diagnoses: Mapping[str, Diagnosis]) -> str:
    """The table as Markdown."""
    lines = [COLUMNS, tuple("---" for _ in COLUMNS), *rows(diagnoses)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _nearest(one: Diagnosis) -> str:
    if one.verdict != "unexplained" or not one.finalists:
        return "-"
    nearest = one.finalists[0]
    return f"{', '.join(nearest.effects)}: {_cents(nearest.leave_one_out_rms_cents)}"


def _signed(value: float) -> str:
    """With its sign; what rounds to nothing is 0."""
    shown = f"{value:+.1f}"
    return "0" if float(shown) == 0.0 else shown


def _cents(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def main() -> None:
    """Diagnose the boards, print the table, and write it where told."""
    parser = argparse.ArgumentParser(description="Error before and after, board by board.")
    parser.add_argument("boards", nargs="*", default=BOARDS, help="cards (default: the shipped boards)")
    parser.add_argument("--out", type=Path, help="folder for closing-the-loop.csv and .md")
    arguments = parser.parse_args()
    diagnoses = close_the_loop(arguments.boards)
    print(markdown(diagnoses))
    if "paper-cantilever-fe" in diagnoses:
        assert "transverse_shear" in diagnoses["paper-cantilever-fe"].effects
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / "closing-the-loop.md").write_text(page(diagnoses), encoding="utf-8")
        with (arguments.out / "closing-the-loop.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([COLUMNS, *rows(diagnoses)])


if __name__ == "__main__":
    main()
