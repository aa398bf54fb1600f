"""The bars of the trial: each a question, the estimate with its exact bounds, and whether the bounds satisfy it.

A bar is met if the bound that could break it does not: the upper one for "at most", the lower one for "at least". The
figures of the bars were set before any board was planted; what was changed since, which intervals of the constants and
which classes of effects they are put to, the page says. A bar that is missed stays here as missed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from trial.causes import narrowest, overlooked, taken_for, weakest
from trial.cells import Cell
from trial.counts import (
    Mean,
    Record,
    Share,
    holds,
    is_answered,
    is_best,
    is_covered,
    is_flagged,
    is_named,
    is_right_name,
    is_wrong_name,
    listed,
    mean,
    median,
    share,
    truth,
)
from trial.sizes import errors

Bar = dict[str, Any]
PLANNED = frozenset(
    (
        "clamp_rotation",
        "attached_mass",
        "air_loading",
        "transverse_shear",
        "grain_angle",
        "thickness_profile",
        "poisson_ratio",
    )
)
"""The classes for which the bars on the best answer were set; the trial plants further ones, harder to tell apart."""
Records = Sequence[Record]


def bars(cells: Sequence[Cell], by_cell: Mapping[str, Records]) -> list[Bar]:
    """Every bar for which there are records."""

    def of(kind: str, **wanted: Any) -> list[Record]:
        """Records of the cells of a kind that agree in what is asked for."""
        chosen = [c for c in cells if c.kind == kind and all(getattr(c, k) == v for k, v in wanted.items())]
        return [record for cell in chosen for record in by_cell[cell.name]]

    designs = list(dict.fromkeys(cell.design for cell in cells))
    six, nine, both = "cantilever-6", "cantilever-9", "cantilever-6-free-6"
    found: list[Bar | None] = []
    for design in designs:
        found.append(_at_most(f"null, {design}: uniquely named", share(of("null", design=design), is_named), 0.02))
        found.append(_at_most(f"null, {design}: flagged at all", share(of("null", design=design), is_flagged), 0.05))
    for cell in (cell for cell in cells if cell.kind == "one"):
        records = by_cell[cell.name]
        cause = taken_for(records, is_wrong_name)
        found.append(_at_most(f"{cell.name}: unique and wrong", share(records, is_wrong_name), 0.05, cause))
    for design in designs:
        answered = [record for record in of("one", design=design) if is_answered(record)]
        found.append(_at_least(f"one effect, {design}: in the set given", share(answered, is_covered), 0.90))
        size = mean([len(listed(record)) for record in answered])
        found.append(_number(f"one effect, {design}: mean size of the set", size, 2.5))
    for design, least in ((six, 0.70), (nine, 0.90), (both, 0.95)):
        records = of("one", design=design, noise_cents=5.0, size=2.0, noise_factor=1.65)
        planned = [record for record in records if truth(record) <= PLANNED]
        for which, among in (("", planned), (", further classes too", records)):
            quantity = f"top-1, {design}, 5 cents, 2x{which}"
            found.append(_at_least(quantity, share(among, is_best), least, weakest(among)))
    for design in designs:
        records = of("outside", design=design)
        cause = taken_for(records, is_named)
        found.append(_at_most(f"outside the library, {design}: falsely unique", share(records, is_named), 0.10, cause))
    planned = [record for record in of("two") if truth(record) <= PLANNED]
    for which, among in (("", planned), (", further classes too", of("two"))):
        quantity = f"two effects: both in the set{which}"
        found.append(_at_least(quantity, share(among, is_covered), 0.70, overlooked(among)))
    loud = of("one", noise_cents=17.0)
    found.append(_at_least("17 cents: not named", share(loud, lambda r: not is_named(r)), 0.80))
    found.append(_at_most("17 cents: unique and wrong", share(loud, is_wrong_name), 0.02))
    for design in designs:
        found += _of_constants(design, of("one", design=design, noise_cents=5.0, size=2.0, noise_factor=1.65))
    found += _of_sizes([record for record in of("one") if is_right_name(record)])
    return [bar for bar in found if bar is not None]


def _at_most(quantity: str, found: Share, limit: float, cause: str = "") -> Bar | None:
    met = found.high <= limit
    return _bar(quantity, f"<= {100 * limit:g} %", found, met, "" if met else cause) if found.n else None


def _at_least(quantity: str, found: Share, limit: float, cause: str = "") -> Bar | None:
    met = found.low >= limit
    return _bar(quantity, f">= {100 * limit:g} %", found, met, "" if met else cause) if found.n else None


def _bar(quantity: str, wanted: str, found: Share, met: bool, note: str = "") -> Bar:
    count = f"{found.count:g}" if float(found.count).is_integer() else f"{found.count:.1f}"
    shown = f"{count}/{found.n} = {100 * found.value:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"
    return {"quantity": quantity, "bar": wanted, **found.as_json(), "shown": shown, "met": bool(met), "note": note}


def _number(quantity: str, found: Mean, limit: float, percent: bool = False) -> Bar | None:
    if not found.n:
        return None
    factor, unit = (100.0, " %") if percent else (1.0, "")
    value, low, high = (f"{factor * number:.3g}" for number in (found.value, found.low, found.high))
    shown = f"{value}{unit} ({low} to {high}), n = {found.n}"
    return {"quantity": quantity, "bar": f"<= {factor * limit:g}{unit}", **found.as_json(), "shown": shown,
            "met": bool(found.high <= limit), "note": ""}  # fmt: skip


def class_average(records: Records, way: str) -> Share:
    """Coverage of the constants averaged over classes, as a share of as many boards as there are.

    Three constants of a board count as one answer, so that the bounds are too wide rather than too narrow.
    """
    classes = sorted({next(iter(truth(record))) for record in records})
    each = [np.mean([holds(r, way) for r in records if truth(r) == {effect}]) for effect in classes]
    return Share(float(np.mean(each)) * len(records), len(records)) if records else Share(0, 0)


def _of_constants(design: str, records: Records) -> Iterable[Bar]:
    """Coverage after tracing within 85 to 95 %, both bounds; and that it is worse without.

    After tracing means averaged over all hypotheses. What the hypothesis of the verdict alone would cover stands beside
    it: it takes "none needed" for "there is nothing".
    """
    if not records:
        return
    after, alone, without = (class_average(records, way) for way in ("averaged", "after", "without"))
    yield _bar(
        f"constants after tracing, {design}, 2x: 90 % intervals",
        "85 to 95 %",
        after,
        after.low >= 0.85 and after.high <= 0.95,
        f"averaged over classes and hypotheses; by the hypothesis of the verdict alone {100 * alone.value:.1f} %; "
        + narrowest(records, after),
    )
    gain = mean([holds(r, "averaged") - holds(r, "without") for r in records])
    yield _bar(
        f"constants without tracing, {design}, 2x: visibly worse",
        "lower than after tracing",
        without,
        gain.low > 0,
        f"tracing gains {100 * gain.value:.1f} points ({100 * gain.low:.1f} to {100 * gain.high:.1f})",
    )


def _of_sizes(named: Records) -> Iterable[Bar]:
    """Sizes of the rightly named, all cells of single effects together; the band is the binomial one of 200."""
    found = [one for record in named for one in record["amplitudes"].values()]
    if not found:
        return
    error = _number("size of what is named right: median relative error", median(errors(found)), 0.25, percent=True)
    if error:
        yield error
    covered = share(found, lambda one: one["q05"] <= one["truth"] <= one["q95"])
    yield _bar(
        "size of what is named right: 90 % intervals", "84 to 95 % (estimate)", covered, 0.84 <= covered.value <= 0.95
    )
