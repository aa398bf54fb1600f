"""Time the package on this machine: `python tests/validation/benchmarks/run.py [--publish FOLDER]`.

Prints what was measured beside what is aimed at; see README.md. With `--publish` only the ratios, written as a page.
Exit code 0 whatever the numbers are.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # as the sampler is used: one board a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.benchmarks import timing
from validation.benchmarks.ratios import EXACT_BOARD, LINEAR_BOARD, publish, ratios

BATCHES = (16, 256, 4096)
PACKAGES = ("bayesplate", "numpy", "scipy", "emcee", "scikit-fem")


@dataclass(frozen=True)
class Row:
    """One measurement; `aim` is None where there is none, and `larger_is_better` for rates."""

    what: str
    measured: float
    unit: str
    aim: float | None = None
    larger_is_better: bool = False

    @property
    def verdict(self) -> str:
        """Whether the aim was met."""
        if self.aim is None:
            return ""
        met = self.measured >= self.aim if self.larger_is_better else self.measured <= self.aim
        return "met" if met else "missed"


def measure(repeats: int) -> Iterator[Row]:
    """Every measurement, the quick ones first."""
    yield Row("bayesplate --help", timing.command("--help", repeats=3 * repeats), "s", 0.5)
    problems = {"linear": timing.posed(LINEAR_BOARD, "linear"), "exact": timing.posed(EXACT_BOARD, "exact")}
    cold, warm = timing.assembly(problems["exact"]), timing.twelve_modes(problems["exact"])
    yield Row("twelve modes, matrices there (warm)", 1e3 * warm, "ms", 30.0)
    yield Row("matrices of a plate not seen before (cold)", 1e3 * cold, "ms")
    yield Row("twelve modes from nothing", 1e3 * (cold + warm), "ms")
    yield Row("labelled modes of one draw, whole plate", 1e3 * timing.full_solve(problems["exact"]), "ms")
    for name, aim in (("linear", 1_000_000.0), ("exact", 50_000.0)):
        for batch in BATCHES:
            rate = batch / timing.likelihood(problems[name], batch)
            yield Row(f"likelihood, {name} law, {batch} draws at once", rate, "1/s", aim, larger_is_better=True)
    for board in (LINEAR_BOARD, EXACT_BOARD):
        yield Row(f"{board}: sampling's end to report", timing.after_sampling(board, repeats), "s", 2.0)
    yield Row(f"fit {LINEAR_BOARD} (linear law)", timing.whole_fit(LINEAR_BOARD, repeats=repeats), "s", 6.0)
    yield Row(f"fit {EXACT_BOARD} (exact law)", timing.whole_fit(EXACT_BOARD, repeats=repeats), "s", 10.0)


def machine() -> dict[str, object]:
    """What the numbers depend on; nothing that names the machine."""
    return {
        "python": platform.python_version(),
        **{package: version(package) for package in PACKAGES},
        "system": platform.system(),
        "processor": platform.machine(),
        "cpu_count": os.cpu_count(),
        "load_average": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "threads": os.environ["OMP_NUM_THREADS"],
    }


def main() -> None:
    """Measure, print, and write JSON if asked to."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, help="write JSON to this file too")
    parser.add_argument("--repeats", type=int, default=1, help="whole fits of each board; the best one counts")
    parser.add_argument("--publish", type=Path, help="measure the ratios alone and write benchmarks.md to this folder")
    arguments = parser.parse_args()
    about = machine()  # the load before our own
    print(", ".join(f"{key} {value}" for key, value in about.items()))
    if arguments.publish is not None:
        found = []
        for ratio in ratios(arguments.repeats):
            found.append(ratio)
            print(ratio.row, flush=True)
        publish(found, about, arguments.publish)
        return
    rows = []
    for row in measure(arguments.repeats):
        rows.append(row)
        aim = "" if row.aim is None else f"{row.aim:>12,.4g}"
        print(f"{row.what:<52}{row.measured:>14,.4g} {row.unit:<4}{aim:>12}  {row.verdict}", flush=True)
    if arguments.out is not None:
        content = {"machine": about, "rows": [{**asdict(row), "verdict": row.verdict} for row in rows]}
        arguments.out.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
