"""Compare the present tree with the reference: `python tests/validation/reference/compare.py --parts plates`.

Computes the same results, into results/reference, and prints those that differ by more than their tolerance. What
`known-differences.toml` explains is listed with its reason and not counted. Exit code 0: nothing differs; 1: something
does, or all takes more than a fifth longer.
"""

from __future__ import annotations

import os
import sys
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # as `make`; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.reference.differences import MOST_TIME, Difference, differences, times
from validation.reference.make import HERE, arguments, chosen
from validation.reference.results import make, read

KNOWN = HERE / "known-differences.toml"
COMPUTED = HERE.parents[2] / "results" / "reference"
_WIDEST = 60


def main() -> int:
    """Compare what the options name; the number of parts that differ decides the exit code."""
    parser = arguments(__doc__.splitlines()[0])
    parser.add_argument("--into", type=Path, default=COMPUTED, help="folder of what is computed (results/reference)")
    parser.add_argument("--stored", action="store_true", help="compute nothing: compare what the folder holds")
    options = parser.parse_args()
    known = {"": ""} if not KNOWN.exists() else tomllib.loads(KNOWN.read_text())
    mesh, n_differing = read(HERE / "mesh.json"), 0
    for part, wanted in chosen(options):
        reference, path = read(HERE / f"{part}.json"), options.into / f"{part}.json"
        names = [name for name in wanted if name in reference]
        if options.stored:
            there = read(path)
            computed = {name: there[name] for name in names if name in there}
        else:
            computed = make(part, names, options.into, resume=options.resume, told=lambda line: print(line, flush=True))
        n_differing += _told(part, len(computed), differences(part, reference, computed, mesh), known)
        n_differing += _timed(times(reference, computed))
    return 1 if n_differing else 0


def _told(part: str, n: int, found: Sequence[Difference], known: Mapping[str, str]) -> int:
    """Print a table of what differs, then what is known with its reasons; return how many differ unexplained."""
    reasons = {one: _reason(one, known) for one in found}
    unknown = [one for one, reason in reasons.items() if not reason]
    print(f"\n{part}: {n} compared, {len(unknown)} differences, {len(found) - len(unknown)} more with a known reason")
    for one in unknown:
        told = f"{_short(one.stored)} -> {_short(one.computed)}"
        print(f"  {one.name}: {one.what}  {told}  {one.size}".rstrip())
    for one, reason in reasons.items():
        if reason:
            print(f"  known: {one.name}: {one.what} {one.size}: {reason}")
    return len(unknown)


def _reason(one: Difference, known: Mapping[str, str]) -> str:
    """Why a difference is known: by the name of its result, or by that and the beginning of what differs."""
    both = f"{one.name} {one.what}"
    return next((reason for key, reason in known.items() if key == one.name or (key and both.startswith(key))), "")


def _timed(taken: Mapping[str, tuple[float, float]]) -> int:
    """Print times as ratios to those of the reference; return 1 if all together take more than a fifth longer."""
    if not taken:
        return 0
    for name, (before, now) in taken.items():
        print(f"  {name}: {before:.1f} -> {now:.1f} s, {now / before:.2f} times")
    before, now = (sum(each) for each in zip(*taken.values(), strict=True))
    is_slow = now > MOST_TIME * before
    told = f": more than {MOST_TIME:g} times" if is_slow else ""
    print(f"  processor time of all: {before:.0f} -> {now:.0f} s, {now / before:.2f} times{told}")
    return int(is_slow)


def _short(text: str) -> str:
    return text if len(text) <= _WIDEST else text[: _WIDEST - 1] + "…"


if __name__ == "__main__":
    sys.exit(main())
