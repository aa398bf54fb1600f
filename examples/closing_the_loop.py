"""Closing the loop: from a measured board's residual to an effect, and the error before and after.

The page has two tables. The first is of measured boards whose cards state what acts on them, an exciter, the air, the
water: each is fitted without it and with it, nothing chosen by the readings, and beside the errors stands what is known
of the board apart from its frequencies. In the second every board goes through the same steps: fit, find the residual,
search for an effect that the plate lacks, add it where the readings name one, and compare the errors. Two columns of
computed frequencies there come from a shear-flexible finite element model of somebody else; the ideal plate that is
fitted to them knows nothing of shear, and the search has to find it.

    python examples/closing_the_loop.py --out closing-the-loop

prints both tables and writes them.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import bayesplate
from bayesplate.commands.diagnose import diagnose
from bayesplate.diagnosis.result import Diagnosis
from bayesplate.diagnosis.words import MERITS
from bayesplate.effects.words import effect_names

BOARDS = (
    "paper-cantilever-fe",
    "paper-clamped-fe",
    "finnish-spruce-cantilever",
    "fiemme-spruce-clamped",
    "nemus-D",
    "steel-air-water",
    "foam-panel-exciter",
    "acrylic-panel",
    "spruce-free-2L",
    "spruce-free-2R",
    "spruce-free-3R",
    "spruce-free-1R",
    "spruce-free-1L",
    "spruce-free-3L",
)


@dataclass(frozen=True)
class Stated:
    """A measured board on which something acts that is known apart from its frequencies.

    Attributes
    ----------
    board : str
    effects : tuple of str
    known : str
        Where they are known from.
    fact : str
        What else is known, to compare a constant or a size with.
    """

    board: str
    effects: tuple[str, ...]
    known: str
    fact: str


STATED = (
    Stated(
        "fiemme-spruce-clamped",
        ("fluid_loading", "exciter"),
        "the paper names the drive, 48 g, and a board in a room is in air",
        "the drive is named; of its suspension only a prior is known, from such drives",
    ),
    Stated(
        "foam-panel-exciter",
        ("fluid_loading", "exciter"),
        "coil and suspension measured on four samples, sizes taken as stated",
        "the author's model without air was tuned to less, E = 0.028 GPa",
    ),
    Stated(
        "steel-air-water",
        ("fluid_loading", "transverse_shear"),
        "the plate rang in air and under water",
        "two papers compute with more, E = 208.8 GPa",
    ),
)
STATED_COLUMNS = ("board", "with", "how", "error, cents", "left out", "E_x, GPa", "known from", "compare")
SHORT_COLUMNS = ("board", "what acts on it", "leave-one-out error, cents", "E_x, GPa", "known from elsewhere")
COMPUTED, FITTED = "computed, nothing of it fitted", "fitted"
STATED_HEAD = """# Closing the loop on measured boards

Written by `examples/closing_the_loop.py`; do not edit.

## What is known to act on a board, taken in

The first row of a board takes it for an ideal plate. "Computed": what is known to be there is added, with its stated
size or the middle of the prior of such things, and nothing but the constants is fitted. "Fitted": its sizes and places
are marginalised within these priors. Error: of the fit, rms over the modes, cents; left out: of each mode by a fit that
has not seen it. Where one cause alone makes the error larger and two together make it smaller, they act in opposite
directions.

"""
HEAD = """## What was searched for: error before and after, board by board

Each board is fitted as an ideal plate with what its card declares, an effect that it lacks is searched for, and where
the verdict is a name or a group, the most probable effect is fitted too. "In part": it explains most of the residual
and leaves more than noise.

- In sample, left out, nested: error in cents, rms over the modes, without the effect → with it. In sample: of the fit
  itself; left out: of each mode by a fit that has not seen it; nested: the same, and the effect is searched for again
  without that mode.
- E_x, E_y, G_xy: what the effect changes each constant by, in standard deviations of the first fit.
- Nearest: where nothing explains the board, the effect that comes nearest, and its leave-one-out error, in cents.
- Known: what the card states, its sizes not chosen by the readings, and the error that may be said to be reduced.
- Fact: what is known of the board apart from its frequencies, and speaks for or against the verdict.

"""
COLUMNS = (
    "board", "verdict", "effects", "claim", "in sample", "left out", "nested", "E_x", "E_y", "G_xy", "nearest", "known",
    "fact",
)  # fmt: skip
_RIGID = "rigid-body peaks at 3 to 6 Hz, and nothing from 8 to 30 Hz, leave no stiffer support"
FACTS = {
    "paper-cantilever-fe": "computed with shear",
    "paper-clamped-fe": "computed with shear",
    "fiemme-spruce-clamped": "an exciter of 48 g and the air were there: see above",
    "steel-air-water": "measured in air and in water",
    "foam-panel-exciter": "air and exciter are declared: see above",
    "acrylic-panel": "a control: nothing strong is known to act on it",
    **{f"spruce-free-{pair}{side}": _RIGID for pair in range(1, 4) for side in "LR"},
}


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


def stated_rows(
    diagnoses: Mapping[str, Diagnosis], boards: Sequence[Stated] = STATED, seed: int = 1
) -> list[tuple[str, ...]]:
    """Boards without and with what is known to act on them.

    Parameters
    ----------
    diagnoses : dict of Diagnosis
        By board; they hold what is computed of known effects. Boards without one are left out.
    boards : sequence of Stated
    seed : int
        Of the fits.

    Returns
    -------
    list of tuple of str
    """
    found = []
    for one in boards:
        if one.board not in diagnoses:
            continue
        found.append((one.board, "nothing, an ideal plate", FITTED, *_fitted(one.board, (), seed), "", ""))
        for model in diagnoses[one.board].known:
            if model.combination and {*model.combination} <= {*one.effects}:
                error = _cents(model.in_sample_rms_cents)
                found.append(("", effect_names(model.combination), COMPUTED, error, "", "", "", ""))
        figures = _fitted(one.board, one.effects, seed)
        found.append(("", effect_names(one.effects), FITTED, *figures, one.known, one.fact))
    return found


def shortest(stated: Sequence[Sequence[str]]) -> list[tuple[str, ...]]:
    """The same in one row a board, without anything and with all that acts on it: the error of modes left out."""
    starts = [i for i, row in enumerate(stated) if row[0]]
    pairs = [(stated[i], stated[j - 1]) for i, j in zip(starts, [*starts[1:], len(stated)], strict=True)]
    return [(first[0], last[1], f"{first[4]} → {last[4]}", f"{first[5]} → {last[5]}", last[7]) for first, last in pairs]


def _fitted(board: str, effects: Sequence[str], seed: int) -> tuple[str, str, str]:
    """Errors of a fit with some effects, cents, and E_x, GPa."""
    summary = bayesplate.fit(board, effects=effects, seed=seed).summary
    error, E_x = summary.error, summary.elastic.E_x
    errors = (_cents(one) for one in (error.in_sample_rms_cents, error.leave_one_out_rms_cents))
    return (*errors, f"{1e-9 * E_x.mean:.4g} ± {1e-9 * E_x.sd:.2g}")


def rows(diagnoses: Mapping[str, Diagnosis]) -> list[tuple[str, ...]]:
    """One row per board: errors in cents before -> after, shift of each constant in standard deviations.

    Nearest is for a board that nothing explains: what comes nearest, and the leave-one-out error with it.
    """
    return [
        (
            name,
            f"{one.verdict}, in part" if one.named_in_part else one.verdict,
            ", ".join(one.named_in_part or one.effects) or "-",
            "error reduced" if one.claim else "no claim",
            *(
                f"{_cents(merit.value_of(one.before))} → {_cents(merit.value_of(one.after))}"
                for merit in MERITS
                if merit.is_rms
            ),
            *(_signed(shift.shift_in_sd) for shift in one.elastic_shift.values()),
            _nearest(one),
            _known(one),
            FACTS.get(name, "-"),
        )
        for name, one in diagnoses.items()
    ]


def page(stated: Sequence[Sequence[str]], diagnoses: Mapping[str, Diagnosis]) -> str:
    """What the columns are, and both tables."""
    return STATED_HEAD + markdown(STATED_COLUMNS, stated) + "\n" + HEAD + markdown(COLUMNS, rows(diagnoses))


def markdown(columns: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table as Markdown."""
    every = [columns, tuple("---" for _ in columns), *lines]
    return "\n".join("| " + " | ".join(line) + " |" for line in every) + "\n"


def _known(one: Diagnosis) -> str:
    """Claims without selection that hold."""
    told = [
        f"{', '.join(claim.effects)}{f' in {claim.predicts}' if claim.predicts else ''}: "
        f"{_cents(claim.before_rms_cents)} → {_cents(claim.after_rms_cents)}"
        for claim in one.stated_claims
        if claim.holds
    ]
    return "; ".join(told) or "-"


def _nearest(one: Diagnosis) -> str:
    if one.verdict != "unexplained" or one.named_in_part or not one.finalists:
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
    stated = stated_rows(diagnoses)
    print(page(stated, diagnoses))
    if "paper-cantilever-fe" in diagnoses:
        assert "transverse_shear" in diagnoses["paper-cantilever-fe"].effects
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / "closing-the-loop.md").write_text(page(stated, diagnoses), encoding="utf-8")
        with (arguments.out / "closing-the-loop.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream, lineterminator="\n").writerows([COLUMNS, *rows(diagnoses)])


if __name__ == "__main__":
    main()
