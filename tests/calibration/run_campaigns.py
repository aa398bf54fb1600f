"""Simulate campaigns: `python tests/calibration/run_campaigns.py --campaigns 100 --workers 2 --out campaigns.jsonl`.

Prints how often 90 % intervals of a shared mass hold the truth, and how often a shared effect is claimed that only some
boards have, or none. Exit code 0: all within their bands; 1: not; 2: usage. An interrupted run goes on where it stopped
if it is given the same file.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from calibration.campaigns import KINDS, CampaignDesign, identity, judge, simulate_one
from calibration.records import Record, add_to, publish, read_done


def run(design: CampaignDesign, n_campaigns: int, workers: int, out: Path, *, quiet: bool = False) -> list[Record]:
    """Do what is not done yet, the kinds in turn, and return the records of all campaigns asked for."""
    records = read_done(out, identity(design))
    done = {(one["kind"], one["campaign"]) for one in records}
    jobs = [(design, kind, i) for i in range(n_campaigns) for kind in KINDS if (kind, i) not in done]
    records += add_to(out, simulate_one, jobs, workers, quiet=quiet)
    return sorted(
        (one for one in records if one["campaign"] < n_campaigns),
        key=lambda one: (KINDS.index(one["kind"]), one["campaign"]),
    )


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=100, help="of each kind")
    parser.add_argument("--boards", type=int, default=8)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--publish", type=Path, help="folder for a page of what was found")
    given = parser.parse_args()
    records = run(CampaignDesign(n_boards=given.boards), given.campaigns, given.workers, given.out)
    lines, well = judge(records)
    print("\n".join(lines))
    if given.publish:
        publish(given.publish, "campaigns", "Simulated campaigns", "make campaigns", lines)
    return 0 if well else 1


if __name__ == "__main__":
    sys.exit(main())
