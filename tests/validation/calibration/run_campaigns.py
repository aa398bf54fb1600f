"""Simulate campaigns: `python tests/validation/calibration/run_campaigns.py --campaigns 100 --out campaigns.jsonl`.

Prints how often 90 % intervals of what is shared hold the truth, and how often a shared effect is claimed that only
some boards have, or none. Exit code 0: all within their bands; 1: not, or not all of them were run; 2: usage. An
interrupted run goes on where it stopped if it is given the same file.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.campaigns import KINDS, CampaignDesign, identity, judge, simulate_one
from validation.calibration.records import Record, add_to, publish, read_done


def run(
    design: CampaignDesign, kinds: Sequence[str], n_campaigns: int, workers: int, out: Path, *, quiet: bool = False
) -> list[Record]:
    """Do what is not done yet of some kinds in turn, and return the records of all kinds.

    Without workers nothing is done, and those that were done before are returned.
    """
    records = read_done(out, identity(design))
    done = {(one["kind"], one["campaign"]) for one in records}
    jobs = [(design, kind, i) for i in range(n_campaigns) for kind in kinds if (kind, i) not in done]
    records += add_to(out, simulate_one, jobs, workers, quiet=quiet) if workers else []
    asked = {(kind, i): place for place, (kind, i) in enumerate(product(KINDS, range(n_campaigns)))}
    kept = (one for one in records if (one["kind"], one["campaign"]) in asked)
    return sorted(kept, key=lambda one: asked[one["kind"], one["campaign"]])


def main() -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--campaigns", type=int, default=100, help="of each kind")
    parser.add_argument("--boards", type=int, default=8)
    parser.add_argument("--kinds", default=",".join(KINDS), help="of them that are simulated")
    parser.add_argument("--workers", type=int, default=2, help="0: judge what was simulated before")
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--publish", type=Path, help="folder for a page of what was found")
    given = parser.parse_args()
    kinds = given.kinds.split(",")
    if not set(kinds) <= set(KINDS):
        parser.error(f"--kinds: wanted some of {','.join(KINDS)}, got {given.kinds}")
    design = CampaignDesign(n_boards=given.boards)
    records = run(design, kinds, given.campaigns, given.workers, given.out)
    lines, well = judge(records)
    wanted = len(KINDS) * given.campaigns
    if len(records) < wanted:
        lines.append(f"not whole: {len(records)} of {wanted} campaigns were run")
    print("\n".join(lines))
    if given.publish:
        publish(given.publish, "campaigns", "Simulated campaigns", "make campaigns", lines)
    return 0 if well and len(records) == wanted else 1


if __name__ == "__main__":
    sys.exit(main())
