"""Calibrate picked modes: `python tests/validation/calibration/run_recordings.py --out recordings.jsonl`.

Prints how many errors lie within one and two standard errors, the bias, and false and missed modes, beside a control
that reads the highest line. Exit code 0: as stated; 1: not; 2: usage. A run that was interrupted goes on where it
stopped if it is given the same file.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one recording a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.picked import N_HITS, N_PLACES, RATE, SECONDS, Record, is_calibrated, simulate_one, told
from validation.calibration.records import add_to, publish, read_done

BASE_SEED = 22
ABOUT = (
    "The bars on standard errors ask for at least as many errors within them as a normal law has, so that errors "
    "stated somewhat too large meet them. The probability of no mode is a cautious figure, not a calibrated one: its "
    "bar asks for no more false peaks among the likely ones than it states, and fewer meet it."
)


def run(n_recordings: int, workers: int, out: Path, *, quiet: bool = False) -> list[Record]:
    """Do what is not done yet, and return the records of all recordings asked for, in their order."""
    identity = {
        "format": 1, "seed": BASE_SEED, "places": N_PLACES, "hits": N_HITS, "rate": RATE, "seconds": SECONDS,
    }  # fmt: skip
    records = read_done(out, identity)
    done = {record["simulation"] for record in records}
    jobs = [(BASE_SEED, i) for i in range(n_recordings) if i not in done]
    records += add_to(out, simulate_one, jobs, workers, quiet=quiet)
    return sorted((one for one in records if one["simulation"] < n_recordings), key=lambda one: one["simulation"])


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--publish", type=Path, help="folder of the page")
    options = parser.parse_args()
    records = run(options.recordings, options.workers, options.out)
    lines = told(records)
    print("\n".join(lines))
    if options.publish is not None:
        command = "make recordings"
        publish(
            options.publish,
            "recordings",
            "Picked modes of recordings: are their errors as stated?",
            command,
            lines,
            ABOUT,
        )
    return 0 if is_calibrated(records) else 1


if __name__ == "__main__":
    sys.exit(main())
