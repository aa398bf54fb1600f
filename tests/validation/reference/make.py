"""Make the reference anew: `python tests/validation/reference/make.py --parts plates boards`.

Each result is written as soon as it is there; an interrupted run goes on with `--resume`.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # processor times; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.reference.results import PARTS, make, names

HERE = Path(__file__).resolve().parent


def arguments(about: str) -> argparse.ArgumentParser:
    """Options that say which results are meant."""
    parser = argparse.ArgumentParser(description=about)
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="default: all")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="results of these names alone")
    parser.add_argument("--long", action="store_true", help="searches over six boards and more as well")
    parser.add_argument("--resume", action="store_true", help="skip what this tree, unchanged, has made already")
    return parser


def chosen(options: argparse.Namespace) -> Iterator[tuple[str, Sequence[str]]]:
    """Parts with the names that are meant."""
    every = {part: names(part, long=options.long or bool(options.only)) for part in options.parts}
    unknown = set(options.only or ()) - {name for each in every.values() for name in each}
    if unknown:
        raise SystemExit(f"no result is named {', '.join(sorted(unknown))}")
    for part, each in every.items():
        yield part, [name for name in each if not options.only or name in options.only]


def main() -> None:
    """Make what the options name."""
    options = arguments(__doc__.splitlines()[0]).parse_args()
    for part, wanted in chosen(options):
        make(part, wanted, HERE, resume=options.resume, told=lambda line: print(line, flush=True))


if __name__ == "__main__":
    main()
