"""Calibrate picked modes: `python tests/validation/calibration/run_recordings.py --out recordings.jsonl`.

Prints how many errors lie within one and two standard errors, the bias, and false and missed modes, beside a control
that reads the highest line. Exit code 0: as stated; 1: not; 2: usage. A run that was interrupted goes on where it
stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one recording a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.picked import N_HITS, N_PLACES, RATE, SECONDS, is_calibrated, simulate_one, told
from validation.calibration.study import Page, Study, arguments, carry_out, numbered

BASE_SEED = 22
ABOUT = (
    "The acceptance limits on standard errors ask for at least as many errors within them as a normal law has, so that "
    "errors stated somewhat too large meet them. The probability of no mode is a cautious figure, not a calibrated "
    "one: its limit asks for no more false peaks among the likely ones than it states, and fewer meet it."
)
PAGE = Page("recordings", "Picked modes of recordings: are their errors as stated?", ABOUT)


def study(n_recordings: int) -> Study:
    """So many recordings."""
    identity = {
        "format": 1, "seed": BASE_SEED, "places": N_PLACES, "hits": N_HITS, "rate": RATE, "seconds": SECONDS,
    }  # fmt: skip
    jobs = numbered(BASE_SEED, n=n_recordings)
    return Study(simulate_one, identity, jobs, lambda records: (told(records), is_calibrated(records)))


def main() -> int:
    """Run the command."""
    options = arguments(__doc__, 200, "recordings").parse_args()
    return carry_out(study(options.n), PAGE, options)


if __name__ == "__main__":
    sys.exit(main())
