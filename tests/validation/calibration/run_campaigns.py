"""Simulate campaigns: `python tests/validation/calibration/run_campaigns.py --campaigns 100 --out campaigns.jsonl`.

Prints how often 90 % intervals of what is shared hold the truth, and how often a shared effect is claimed that only
some boards have, or none. Exit code 0: all within their bands; 1: not, or not all of them were run; 2: usage. An
interrupted run goes on where it stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.campaigns import KINDS, CampaignDesign, identity, judge, simulate_one
from validation.calibration.study import Page, Study, arguments, carry_out

PAGE = Page("campaigns", "Simulated campaigns")


def study(design: CampaignDesign, n_campaigns: int) -> Study:
    """So many campaigns of each kind, the kinds in turn."""
    jobs = [(kind, i) for i in range(n_campaigns) for kind in KINDS]
    return Study(
        simulate_one,
        identity(design),
        [({"kind": kind, "campaign": i}, (design, kind, i)) for kind, i in jobs],
        judge,
    )


def main() -> int:
    """Run the command."""
    parser = arguments(__doc__, 100, "campaigns", "of each kind")
    parser.add_argument("--boards", type=int, default=8, help="of each campaign")
    options = parser.parse_args()
    return carry_out(study(CampaignDesign(n_boards=options.boards), options.n), PAGE, options)


if __name__ == "__main__":
    sys.exit(main())
