"""Calibrate plans: `python tests/validation/calibration/run_plans.py --boards 200 --out results/plans.jsonl`.

Prints how often the first proposal of a plan settles which of two explanations is true, beside a random proposal, a
random line of the plan and the next modes up, and whether expected gains are realised. Exit code 0: every limit met; 1:
some are missed, and stay there as missed; 2: usage. A run that was interrupted goes on where it stopped if it is given
the same file.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from validation.calibration.plans import (
    ASKED,
    CHOSEN,
    NEXT,
    NOISE_CENTS,
    WAYS,
    Settings,
    calibration,
    foremost,
    is_group,
    judged,
    limits,
    settled,
    shares,
    simulate_one,
    wrongly,
)
from validation.calibration.records import Record
from validation.calibration.study import Page, Study, arguments, carry_out, numbered

from bayesplate.diagnosis.verdict import ALTERNATIVE_FACTOR

SEED = 2
"""Boards of seed 1 were looked at while the trial was written."""
ABOUT = (
    "Boards whose readings leave two explanations, two effects or an effect and none; each is measured further, in one "
    f"of four ways. Settled: the true explanation is then at least {ALTERNATIVE_FACTOR:g} times as probable as the "
    "other; wrongly: the false one is. Min: mean minutes that it takes, by the plan's own costs. Boards passed over "
    "left more explanations than two, or fewer, or not the true one, or had a label in doubt. The doubt is the entropy "
    "of the probabilities of the two."
)
PAGE = Page("plans", "Plans, calibrated", ABOUT)
_WORDS = {
    "first": "the plan's first proposal",
    "random": "a random proposal",
    "listed": "a random line of the plan",
    "next": f"the next {NEXT} modes up",
}


def study(settings: Settings, n_boards: int) -> Study:
    """So many boards."""
    asked = {design: list(effects) for design, effects in ASKED.items()}
    identity = {
        "format": 6, "settings": asdict(settings), "designs": list(CHOSEN), "asked": asked, "noise_cents": NOISE_CENTS,
    }  # fmt: skip
    jobs = numbered(settings, n=n_boards)
    return Study(simulate_one, identity, jobs, lambda records: (told(records), all(limits(records).values())))


def told(records: Sequence[Record]) -> list[str]:
    """What came out, line by line."""
    every = judged(records)
    silent = [record for record in records if "silent" in record]
    failed = [record for record in records if "error" in record]
    passed_over = sum(one["boards"] for one in every) - len(every)
    stated, true = foremost(records)
    lines = [
        f"{len(every)} boards with two surviving explanations, {passed_over} passed over, {len(failed)} failed; of "
        f"{len(silent)} more the plan says that nothing would help",
        f"before: the more probable explanation is the true one on {100 * true:.0f} % of the boards, stated "
        f"{100 * stated:.0f} %",
        "",
    ]
    kinds = {
        "all": every,
        "two effects": [one for one in every if is_group(one)],
        "an effect or none": [one for one in every if not is_group(one)],
    }
    for words, some in kinds.items():
        if not some:
            continue
        lines.append(f"{f'{words}, {len(some)} boards':36s}  settled  wrongly  min")
        for way in WAYS:
            n, false = sum(settled(one, way) for one in some), sum(wrongly(one, way) for one in some)
            minutes = sum(one[way]["cost"] for one in some) / len(some)
            share = 100.0 * n / len(some)
            lines.append(f"  {_WORDS[way]:34s} {share:6.1f} % {100.0 * false / len(some):6.1f} % {minutes:4.0f}")
        lines.append("")
    lines += ["what the plan puts first: " + _counted(every, "first"), ""]
    lines += ["drop of the doubt, share of the entropy: first and random proposals and lines", "  expected  realised"]
    lines += [f"  {row['expected']:8.3f}  {row['realised']:8.3f} +- {row['sd']:.3f}  n = {row['n']}"
              for row in calibration(records)]  # fmt: skip
    lines += ["", *(f"{'met   ' if met else 'MISSED'} {limit}" for limit, met in limits(records).items())]
    return [*lines, "first error: " + failed[0]["error"][:200]] if failed else lines


def _counted(records: Sequence[Record], way: str) -> str:
    counts = Counter(one[way]["what"] for one in records)
    return ", ".join(f"{what} {n}" for what, n in counts.most_common())


def draw(records: Sequence[Record], folder: Path) -> None:
    """The calibration plot: realised against expected drop, and the share that each way settles."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    left, right = figure.subplots(1, 2)
    rows = calibration(records)
    left.plot([0, 1], [0, 1], color="0.6", lw=1)
    left.errorbar(
        [row["expected"] for row in rows], [row["realised"] for row in rows], [2 * row["sd"] for row in rows],
        fmt="o", color="#0072B2", capsize=3,
    )  # fmt: skip
    left.set(xlabel="expected drop of the doubt", ylabel="realised drop", xlim=(0, 1), ylim=(-0.1, 1.05))
    left.set_title("Expected and realised, two standard errors", fontsize=9)
    found = shares(records)
    colours = ["#0072B2", "0.7", "0.5", "#E69F00"]
    right.barh(range(len(WAYS)), [100 * found[way] for way in WAYS], color=colours)
    right.set_yticks(range(len(WAYS)), [_WORDS[way] for way in WAYS], fontsize=8)
    right.invert_yaxis()
    right.set(xlabel="boards settled, %", xlim=(0, 100))
    right.set_title("Which explanation is true, settled", fontsize=9)
    figure.savefig(folder / "plans.png", dpi=150, metadata={"Software": None})
    with (folder / "plans.md").open("a", encoding="utf-8") as page:
        page.write("\n![Realised against expected drop of the doubt, and boards settled](plans.png)\n")


def main() -> int:
    """Run the command."""
    parser = arguments(__doc__, 200, "boards")
    parser.add_argument("--base-seed", type=int, default=SEED)
    options = parser.parse_args()
    return carry_out(study(Settings(options.base_seed), options.n), PAGE, options, beside=draw)


if __name__ == "__main__":
    sys.exit(main())
