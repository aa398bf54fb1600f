"""Calibrate the inference: `python tests/calibration/run.py --simulations 200 --workers 2 --out ranks.jsonl`.

Prints a table of every quantity and mutant. Exit code 0: calibrated and every mutant caught; 1: not; 2: usage. A run
that was interrupted goes on where it stopped if it is given the same file.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from dataclasses import fields
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one simulation a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from calibration.records import add_to, publish, read_done
from calibration.sbc import Design, identity, simulate_one
from calibration.table import MUTANTS, family_p_value, is_calibrated, is_caught, rows, text


def run(
    design: Design, n_simulations: int, n_mutants: int, workers: int, out: Path, *, quiet: bool = False
) -> list[dict[str, Any]]:
    """Do what is not done yet, and return the records of all simulations asked for, in their order."""
    records = read_done(out, identity(design))
    done = {(r["simulation"], "noise fixed too low" in r.get("ranks", {})) for r in records}
    open_ones = [
        (i, i < n_mutants)
        for i in range(n_simulations)
        if (i, True) not in done and ((i, False) not in done or i < n_mutants)
    ]
    jobs = [(design, i, mutant) for i, mutant in open_ones]
    records += add_to(out, simulate_one, jobs, workers, quiet=quiet)
    latest = {record["simulation"]: record for record in records if record["simulation"] < n_simulations}
    return [latest[i] for i in sorted(latest)]


def judge(records: list[dict[str, Any]]) -> tuple[list[str], bool]:
    """Paragraphs to print, and whether all is well."""
    failed = [r for r in records if "error" in r]
    good = [r for r in records if "ranks" in r]
    paragraphs = []
    if failed:
        paragraphs.append(f"{len(failed)} simulations gave no draws; the first: {failed[0]['error']}")
    if not good:
        return paragraphs, False
    table = rows([r["ranks"]["production"] for r in good])
    well = is_calibrated(table) and not failed
    paragraphs.append(text("production", table, len(good)))
    paragraphs.append(
        f"  family-wise p {family_p_value(table):.3f}; relabelled at a veering: {sum(r['relabelled'] for r in good)}; "
        f"started anew: {sum(r['attempts'] > 1 for r in good)}; linear law: {sum(r['law'] == 'linear' for r in good)}; "
        f"median {sorted(r['seconds'] for r in good)[len(good) // 2]:.1f} s"
    )
    for mutant, fewest in MUTANTS.items():
        ranks = [r["ranks"][mutant] for r in good if mutant in r["ranks"]]
        if len(ranks) < fewest:
            paragraphs.append(f"mutant: {mutant}: {len(ranks)} simulations, {fewest} are needed to judge")
            well = False
            continue
        found = rows(ranks)
        caught = is_caught(mutant, found)
        well &= caught
        paragraphs.append(text(f"mutant: {mutant}", found, len(ranks)))
        paragraphs.append("  caught" if caught else "  NOT CAUGHT")
    return paragraphs, well


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--simulations", type=int, default=200)
    parser.add_argument(
        "--mutants", type=int, default=50, help="simulations that are also fitted with too little noise"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--edges", choices=("free", "cantilever"), default="free")
    parser.add_argument(
        "--generator", choices=("package", "ritz"), default="package", help="whose frequencies are true"
    )
    parser.add_argument("--law", choices=("exact", "auto", "fixed-linear"), default="exact")
    parser.add_argument("--resolution", type=float, default=1.0, help="Hz; 0 for readings that are not rounded")
    parser.add_argument("--base-seed", type=int, default=1)
    parser.add_argument("--publish", type=Path, help="folder for a page of what was found")
    arguments = vars(parser.parse_args())
    design = Design(**{f.name: arguments[f.name] for f in fields(Design) if f.name in arguments})
    started = time.perf_counter()
    records = run(design, arguments["simulations"], arguments["mutants"], arguments["workers"], arguments["out"])
    paragraphs, well = judge(records)
    print("\n".join(paragraphs))
    if arguments["publish"]:
        title = "Calibration of the posterior: ranks of the truth among its draws"
        publish(arguments["publish"], "calibration", title, "make calibration", "\n".join(paragraphs).splitlines())
    print(f"{'calibrated' if well else 'NOT CALIBRATED'}, {(time.perf_counter() - started) / 60:.1f} minutes")
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
