"""Whether intervals cover planted effects: `python tests/validation/calibration/coverage.py --out coverage.jsonl`.

Everything is drawn from the priors that the cards declare (`planted`). Prints how many intervals of 90 % hold the
truth, for the parameters of each effect and for E_x, E_y and G_xy, beside the binomial band of a fit that is right.
Exit code 0: all within, and intervals of half the width are outside; 1: not; 2: usage. An interrupted run goes on where
it stopped if it is given the same file.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")  # one board a core; before numpy is imported
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import numpy as np
from scipy import stats
from validation.calibration.cases import CASES, effect_of
from validation.calibration.planted import Settings, cover_one, identity
from validation.calibration.records import Record
from validation.calibration.study import Page, Study, arguments, carry_out

NOMINAL = 0.90
LEAST, MOST = 0.84, 0.95
"""What 200 boards may show: 168 to 190 of them; a fit that is right leaves this seven times in a thousand."""
POOLED_FROM = 200
FAMILY_LEVEL = 0.05
"""Chance that a fit that is right leaves any of the bands; each band takes its share."""
CONSTANTS = ("E_x", "E_y", "G_xy")
ABOUT = (
    "Allowed: counts that a fit which is right keeps to; the chance that it leaves any of these bands, "
    f"{100 * FAMILY_LEVEL:g} %, is shared among all rows. The rows pooled "
    f"over the effects must lie within {100 * LEAST:g} to {100 * MOST:g} % too, and an effect speaks there by its main "
    "parameter. The last column is how much the readings narrow a parameter: the posterior's standard deviation over "
    "the prior's, the median of the boards. The control, intervals of half the width, must fail."
)
PAGES = {
    "coverage": "Coverage: how many 90 % intervals hold the planted value of a declared effect",
    "two-setups": "Coverage: a board clamped and free, with a clamp that gives and whose grip is not known",
}
"""Titles of what may be published, by the name of the page and of the command."""

Interval = dict[str, float]


@dataclass(frozen=True)
class Count:
    """How many intervals hold their truth.

    Attributes
    ----------
    effect, name : str
        An effect and one of its quantities; "pooled" over the effects.
    held, n : int
    narrowing : float
        Median of the posterior's sd over the prior's; not a number where no prior sd was recorded.
    """

    effect: str
    name: str
    held: int
    n: int
    narrowing: float = float("nan")

    def band(self, level: float) -> tuple[int, int]:
        """Counts that a fit that is right stays within, with the probability 1 - level."""
        low, high = stats.binom.ppf([0.5 * level, 1.0 - 0.5 * level], self.n, NOMINAL)
        return int(low), int(high)

    def is_within(self, level: float) -> bool:
        """Whether the count stays within its band, and from 200 boards on within 84 to 95 percent."""
        low, high = self.band(level)
        pooled = self.effect != "pooled" or self.n < POOLED_FROM or LEAST <= self.held / self.n <= MOST
        return low <= self.held <= high and pooled


def holds(interval: Interval) -> bool:
    """Whether the interval from q05 to q95 holds the truth."""
    return interval["q05"] <= interval["truth"] <= interval["q95"]


def half_holds(interval: Interval) -> bool:
    """The same of an interval of half the width about the median: what a fit too sure of itself would claim."""
    low, high = (0.5 * (interval["q50"] + interval[end]) for end in ("q05", "q95"))
    return low <= interval["truth"] <= high


def counts(records: Sequence[Record], rule: Callable[[Interval], bool] = holds) -> list[Count]:
    """One count for each parameter of each effect and each constant, then for all boards together.

    Pooled, an effect speaks by its main parameter, so that boards count once.
    """
    found, pooled = [], dict.fromkeys(("effect", *CONSTANTS), (0, 0))
    for effect in dict.fromkeys(record["effect"] for record in records):
        boards = [record["quantities"] for record in records if record["effect"] == effect]
        case, main = CASES[effect], f"{effect_of(effect)}.{CASES[effect].main}"
        own = [
            name
            for name in boards[0]
            if name.startswith(f"{effect_of(effect)}.") or name.split("[")[0] in (case.main, *case.others)
        ]
        for name in (*own, *CONSTANTS):
            held = sum(rule(board[name]) for board in boards)
            narrowing = float(np.median([board[name].get("narrowing", np.nan) for board in boards]))
            found.append(Count(effect, name, held, len(boards), narrowing))
            is_main = name.split("[")[0] in (case.main, main)
            key = name if name in CONSTANTS else "effect" if is_main else ""
            if key:
                pooled[key] = (pooled[key][0] + held, pooled[key][1] + len(boards))
    return [*found, *(Count("pooled", name, held, n) for name, (held, n) in pooled.items())]


def judge(records: Sequence[Record]) -> tuple[list[str], bool]:
    """Lines to print, and whether all is well."""
    failed = [record for record in records if "error" in record]
    good = [record for record in records if "quantities" in record]
    lines = [f"{r['effect']}, board {r['board']}: {r['error']}" for r in failed]
    if not good:
        return lines, False
    table = counts(good)
    level = FAMILY_LEVEL / len(table)
    lines += [_line(count, level) for count in table]
    halved = [count for count in counts(good, half_holds) if count.effect == "pooled"]
    caught = not any(count.is_within(level) for count in halved)
    well = all(count.is_within(level) for count in table)
    shown = ", ".join(f"{count.name} {_share(count)}" for count in halved)
    lines.append(f"control, must fail: half the width, pooled: {shown}: {'outside' if caught else 'NOT CAUGHT'}")
    again = sum(record["attempts"] > 1 for record in good)
    redraws = sum(record["redraws"] for record in good)
    seconds = float(np.median([record["seconds"] for record in good]))
    linear = sum(record["law"] == "linear" for record in good)
    lines.append(
        f"{len(good)} boards, {len(failed)} without draws, linear law in {linear}, started anew {again}, "
        f"{redraws} passed over for a label in doubt, median {seconds:.1f} s"
    )
    pooled = ", ".join(f"{c.name} {_share(c)}" for c in table if c.effect == "pooled")
    low, high = table[-1].band(level)
    verdict = "covered" if well and caught else "NOT COVERED"
    missed = f"; MISSED: {len(failed)} of {len(records)} boards without draws" if failed else ""
    lines.append(f"{verdict}: 90 % intervals hold the truth of {pooled}; {low} to {high} allowed{missed}")
    return lines, well and caught and not failed


def _share(count: Count) -> str:
    return f"{count.held}/{count.n} = {100.0 * count.held / count.n:.1f} %"


def _line(count: Count, level: float) -> str:
    low, high = count.band(level)
    mark = "" if count.is_within(level) else "  OUTSIDE"
    narrowing = "" if np.isnan(count.narrowing) else f"  sd {count.narrowing:.2f} of the prior's"
    band = f"{low}-{high} allowed"
    return f"  {count.effect:30} {count.name:42} {_share(count):20} {band:18}{narrowing}{mark}"


def study(settings: Settings, effects: Sequence[str], n_boards: int) -> Study:
    """So many boards of each effect, or five times as many."""
    wanted = [(effect, i) for effect in effects for i in range(n_boards * CASES[effect].times)]
    wanted.sort(key=lambda one: one[1])
    jobs = [({"effect": effect, "board": i}, (settings, effect, i)) for effect, i in wanted]
    return Study(cover_one, identity(settings), jobs, judge)


def main() -> int:
    """Run the command."""
    parser = arguments(__doc__, 40, "boards", "of each effect, or five times as many")
    parser.add_argument("--effect", action="append", choices=list(CASES), help="repeat for several; absent: all")
    parser.add_argument("--base-seed", type=int, default=1)
    parser.add_argument("--page", choices=list(PAGES), default="coverage", help="which page it is")
    options = parser.parse_args()
    asked = study(Settings(base_seed=options.base_seed), options.effect or list(CASES), options.n)
    return carry_out(asked, Page(options.page, PAGES[options.page], ABOUT), options)


if __name__ == "__main__":
    sys.exit(main())
