"""What physics knows of measured boards: the error with shear and air computed, nothing fitted but the constants.

Transverse shear and air act on every board, and their sizes are known: from what is published, and from the board. A
sensor weighs what its card states. They are computed in every combination of up to three, and the three constants are
fitted again. Where the error falls, the ideal plate lacked the effect; where it rises, something that acts the other
way is lacking, or the size is another one on that board. It is printed either way.

    python examples/known_effects.py --out known-effects

prints one table and writes it as Markdown and as CSV with full precision, for every measured board that comes with
the package.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from bayesplate.board.material import MODULI
from bayesplate.board.shelf import card_names
from bayesplate.commands.problem import Problem
from bayesplate.diagnosis.known import known_fits
from bayesplate.diagnosis.known_words import KnownModel, known_models, known_titles

COMPUTED = "paper-"
"""Beginning of the names of boards whose frequencies were computed and not measured."""
COLUMNS = ("board", "model", "in sample", "left out", *(f"{name}, %" for name in MODULI))


def measured_boards() -> tuple[str, ...]:
    """Names of the shipped boards that were measured."""
    return tuple(name for name in card_names("boards") if not name.startswith(COMPUTED))


def known_effects(boards: Sequence[str]) -> dict[str, tuple[KnownModel, ...]]:
    """Compute the known effects of each board.

    Parameters
    ----------
    boards : sequence of str
        Names of shipped cards, or paths.

    Returns
    -------
    dict of tuple of KnownModel
        By board; the board as it stands first.
    """
    return {board: known_models(known_fits(Problem.from_card(board).posed)) for board in boards}


def rows(found: Mapping[str, Sequence[KnownModel]]) -> list[tuple[str | float | None, ...]]:
    """One row a model: errors in cents, change of each modulus in percent."""
    return [
        (
            board,
            words,
            one.in_sample_rms_cents,
            one.leave_one_out_rms_cents,
            *(one.change_percent[name] for name in MODULI),
        )
        for board, models in found.items()
        for words, one in zip(known_titles(models), models, strict=True)
    ]


def markdown(found: Mapping[str, Sequence[KnownModel]]) -> str:
    """The table as Markdown, rounded."""
    lines = [COLUMNS, tuple("---" for _ in COLUMNS)]
    for board, models in found.items():
        for words, one in zip(known_titles(models), models, strict=True):
            errors = (_cents(one.in_sample_rms_cents), _cents(one.leave_one_out_rms_cents))
            changes = (f"{value:+.1f}" if one is not models[0] else "-" for value in one.change_percent.values())
            lines.append((board, words, *errors, *changes))
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def _cents(value: float | None) -> str:
    return "-" if value is None else f"{value:.1f}"


def main() -> None:
    """Compute, print the table, and write it where told."""
    parser = argparse.ArgumentParser(description="Error before and after known effects, board by board.")
    parser.add_argument("boards", nargs="*", help="cards (default: the measured boards that come with the package)")
    parser.add_argument("--out", type=Path, help="folder for known-effects.md and .csv")
    arguments = parser.parse_args()
    found = known_effects(arguments.boards or measured_boards())
    print(markdown(found))
    if arguments.out is not None:
        arguments.out.mkdir(parents=True, exist_ok=True)
        (arguments.out / "known-effects.md").write_text(markdown(found), encoding="utf-8")
        with (arguments.out / "known-effects.csv").open("w", newline="", encoding="utf-8") as stream:
            csv.writer(stream).writerows([COLUMNS, *rows(found)])


if __name__ == "__main__":
    main()
