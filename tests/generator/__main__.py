"""Print the card of a simulated board.

    python -m tests.generator --design cantilever-6 --effect attached_mass --seed 3

The truth goes to the standard error stream with `--truth`, so that a card can be redirected to a file without it.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

_TESTS = str(Path(__file__).resolve().parents[1])
if _TESTS not in sys.path:  # pytest does the same: the generator's modules are found in tests/
    sys.path.insert(0, _TESTS)


def main(arguments: Sequence[str] | None = None) -> None:
    """Read the options, simulate, print."""
    import numpy as np

    from generator.boards import plant
    from generator.designs import DESIGNS, STEEL_DESIGNS
    from generator.recipes import RECIPES

    parser = argparse.ArgumentParser(prog="python -m tests.generator", description="Print a simulated board card.")
    parser.add_argument("--design", choices=[*DESIGNS, *STEEL_DESIGNS], default="cantilever-6")
    parser.add_argument("--effect", action="append", choices=[*RECIPES, "none"], help="repeat for two; absent: drawn")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--size", type=float, help="multiple of the nominal size; absent: drawn from 1/2 to 2")
    parser.add_argument("--noise-cents", type=float, help="absent: drawn from 2 to 17")
    parser.add_argument("--name", default="planted", help="name of the card")
    parser.add_argument("--truth", action="store_true", help="print the truth to the standard error stream")
    options = parser.parse_args(arguments)
    names = options.effect and [name for name in options.effect if name != "none"]
    board = plant(
        np.random.default_rng(options.seed),
        options.design,
        names,
        options.size,
        options.noise_cents,
        name=options.name,
    )
    print(board.card_text(), end="")
    if options.truth:
        print(json.dumps(asdict(board.truth)), file=sys.stderr)


if __name__ == "__main__":
    main()
