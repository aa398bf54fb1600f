"""The limits of the trial: each a question, the estimate with its exact bounds, and whether the bounds satisfy it.

A limit is met if the bound that could break it does not: the upper one for "at most", the lower one for "at least",
both for an interval. How often boards that lack nothing are flagged is a rate by design, and is not to be above it: the
lower bound could break it. The limits were set before any board was planted. Every limit counts all classes of effects;
what the classes that were planned first would give stands in its note. A limit that is missed stays here as missed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from validation.trial.causes import flagged_as, narrowest, overlooked, taken_for, weakest
from validation.trial.cells import NOISES, Cell
from validation.trial.counts import (
    Mean,
    Record,
    Share,
    holds,
    is_answered,
    is_best,
    is_claimed,
    is_covered,
    is_flagged,
    is_judged_in_part,
    is_named,
    is_named_or_in_part,
    is_not_needed,
    is_part_name,
    is_right_name,
    is_wrong_name,
    listed,
    mean,
    median,
    share,
    truth,
)
from validation.trial.sizes import errors

from bayesplate.diagnosis.null_control import FALSE_ALARMS
from bayesplate.diagnosis.search import LEAST_P_VALUE

Limit = dict[str, Any]
PLANNED = frozenset(
    (
        "clamp_rotation",
        "attached_mass",
        "fluid_loading",
        "transverse_shear",
        "grain_angle",
        "thickness_profile",
        "poisson_ratio",
    )
)
"""The classes that were planned first; the trial plants others too, harder to tell apart, and its limits count all."""
NOT_NEEDED = (200, 1200)
"""Boards of six modes with one effect of twice the nominal size of which nothing may be said to lack on so many."""
FLAGGED = LEAST_P_VALUE + FALSE_ALARMS
"""Share of the boards that lack nothing which the gate of the misfit and the need of an effect flag by design."""
COVERED = (0.85, 0.95)
"""Shares of truths that intervals of 90 % may hold."""
Records = Sequence[Record]


def limits(cells: Sequence[Cell], by_cell: Mapping[str, Records]) -> list[Limit]:
    """Every limit for which there are records."""

    def of(kind: str, **wanted: Any) -> list[Record]:
        """Records of the cells of a kind that agree in what is asked for."""
        chosen = [c for c in cells if c.kind == kind and all(getattr(c, k) == v for k, v in wanted.items())]
        return [record for cell in chosen for record in by_cell[cell.name]]

    designs = list(dict.fromkeys(cell.design for cell in cells))
    six, nine, both = "cantilever-6", "cantilever-9", "cantilever-6-free-6"
    large = {"noise_cents": 5.0, "size": 2.0, "noise": "median"}
    found: list[Limit | None] = []
    for design in designs:
        for noise, words in NOISES.items():
            nothing = of("null", design=design, noise=noise)
            cause = taken_for(nothing, is_named)
            found.append(_at_most(f"null, {design}, {words}: uniquely named", share(nothing, is_named), 0.02, cause))
            found.append(_by_design(f"null, {design}, {words}: flagged at all", nothing))
    for cell in (cell for cell in cells if cell.kind in ("one", "two")):
        records = by_cell[cell.name]
        cause = taken_for(records, is_wrong_name)
        found.append(_at_most(f"{cell.name}: unique and wrong", share(records, is_wrong_name), 0.05, cause))
    for design in designs:
        answered = [record for record in of("one", design=design) if is_answered(record)]
        found.append(_at_least(f"one effect, {design}: in the set given", share(answered, is_covered), 0.90))
        size = mean([len(listed(record)) for record in answered])
        found.append(_number(f"one effect, {design}: mean size of the set", size, 2.5))
    for design, least in ((six, 0.65), (nine, 0.85), (both, 0.90)):
        records = of("one", design=design, **large)
        note = join(weakest(records), _planned_first(records, is_best))
        found.append(_at_least(f"top-1, {design}, 5 cents, 2x", share(records, is_best), least, beside=note))
    unseen = share(of("one", design=six, **large), is_not_needed)
    limit, of_all = NOT_NEEDED
    found.append(
        _at_most(f"{six}, 5 cents, 2x: none needed", unseen, limit / of_all, beside=f"limit: {limit} of {of_all}")
    )
    for design in designs:
        records = of("outside", design=design)
        cause = taken_for(records, is_named)
        found.append(_at_most(f"outside the library, {design}: falsely unique", share(records, is_named), 0.10, cause))
        asked = [record for record in records if is_judged_in_part(record)]
        told = share(asked, is_named_or_in_part)
        cause = taken_for(asked, is_named_or_in_part)
        found.append(_at_most(f"outside the library, {design}: named, or named in part", told, 0.10, cause))
    pairs = of("two")
    note = join(overlooked(pairs), _planned_first(pairs, is_covered))
    found.append(_at_least("two effects: both in the set", share(pairs, is_covered), 0.65, beside=note))
    loud = of("one", noise_cents=17.0)
    found.append(_at_least("17 cents: not named", share(loud, lambda r: not is_named(r)), 0.80))
    cause = taken_for(loud, is_wrong_name)
    found.append(_at_most("17 cents: unique and wrong", share(loud, is_wrong_name), 0.02, cause))
    for design in designs:
        found += _of_constants(design, of("one", design=design, **large))
    found += _of_sizes([record for record in of("one") if is_right_name(record)])
    found += _of_claims(of("null"), [*of("one"), *of("two"), *of("outside")])
    return [limit for limit in found if limit is not None]


def join(*notes: str) -> str:
    """Notes that are not empty, one after another."""
    return "; ".join(note for note in notes if note)


def _planned_first(records: Records, question: Callable[[Record], bool]) -> str:
    """What a limit's share would be among the classes that were planned first."""
    planned = share([record for record in records if truth(record) <= PLANNED], question)
    return f"of the classes planned first {_shown(planned)}" if planned.n else ""


def _of_claims(nothing: Records, something: Records) -> Iterable[Limit | None]:
    """Claims where nothing is planted, and on wrong names; how often a right name is claimed, beside it."""
    yield _at_most("claim made on a null", share(nothing, is_claimed), 0.01, taken_for(nothing, is_claimed))
    wrong, part, right = (
        share([record for record in something if rule(record)], is_claimed)
        for rule in (is_wrong_name, is_part_name, is_right_name)
    )
    beside = join(
        f"on a right name {_shown(right)}" if right.n else "", f"on one of two {_shown(part)}" if part.n else ""
    )
    cause = taken_for(something, lambda one: is_wrong_name(one) and is_claimed(one))
    yield _at_most("claim made on a wrong name, outside the library too", wrong, 0.10, cause, beside=beside)


def _within(quantity: str, found: Share, note: str = "") -> Limit:
    """Both bounds of the coverage of 90 % intervals inside the band."""
    low, high = COVERED
    met = found.low >= low and found.high <= high
    return _limit(quantity, f"{100 * low:g} to {100 * high:g} %", found, met, note)


def _at_most(quantity: str, found: Share, limit: float, cause: str = "", *, beside: str = "") -> Limit | None:
    """Upper bound at most a limit; a cause is told where it is missed, what stands beside it always."""
    met = found.high <= limit
    note = join("" if met else cause, beside)
    return _limit(quantity, f"<= {100 * limit:.3g} %", found, met, note) if found.n else None


def _by_design(quantity: str, nothing: Records) -> Limit | None:
    """Boards that lack nothing are flagged no more often than by design: the lower bound is not above it."""
    found = share(nothing, is_flagged)
    met = found.low <= FLAGGED
    wanted = f"{100 * FLAGGED:.3g} % by design"
    return _limit(quantity, wanted, found, met, "" if met else flagged_as(nothing)) if found.n else None


def _at_least(quantity: str, found: Share, limit: float, cause: str = "", *, beside: str = "") -> Limit | None:
    """Lower bound at least a limit; notes as in `_at_most`."""
    met = found.low >= limit
    note = join("" if met else cause, beside)
    return _limit(quantity, f">= {100 * limit:.3g} %", found, met, note) if found.n else None


def _limit(quantity: str, wanted: str, found: Share, met: bool, note: str = "") -> Limit:
    return {"quantity": quantity, "limit": wanted, **found.as_json(), "shown": _shown(found), "met": bool(met),
            "note": note}  # fmt: skip


def _shown(found: Share) -> str:
    count = f"{found.count:g}" if float(found.count).is_integer() else f"{found.count:.1f}"
    return f"{count}/{found.n} = {100 * found.value:.1f} % ({100 * found.low:.1f} to {100 * found.high:.1f})"


def _number(quantity: str, found: Mean, limit: float, percent: bool = False) -> Limit | None:
    if not found.n:
        return None
    factor, unit = (100.0, " %") if percent else (1.0, "")
    value, low, high = (f"{factor * number:.3g}" for number in (found.value, found.low, found.high))
    shown = f"{value}{unit} ({low} to {high}), n = {found.n}"
    return {"quantity": quantity, "limit": f"<= {factor * limit:g}{unit}", **found.as_json(), "shown": shown,
            "met": bool(found.high <= limit), "note": ""}  # fmt: skip


def class_average(records: Records, way: str) -> Share:
    """Coverage of the constants averaged over classes, as a share of as many boards as there are.

    Three constants of a board count as one answer, so that the bounds are too wide rather than too narrow.
    """
    classes = sorted({next(iter(truth(record))) for record in records})
    each = [np.mean([holds(r, way) for r in records if truth(r) == {effect}]) for effect in classes]
    return Share(float(np.mean(each)) * len(records), len(records)) if records else Share(0, 0)


def _of_constants(design: str, records: Records) -> Iterable[Limit]:
    """Coverage after tracing within 85 to 95 %, both bounds; and that it is worse without.

    After tracing means averaged over all hypotheses, which is what the program shows first. What the hypothesis of the
    verdict alone would cover stands beside it: it takes "none needed" for "there is nothing".
    """
    if not records:
        return
    after, alone, without = (class_average(records, way) for way in ("averaged", "after", "without"))
    yield _within(
        f"constants after tracing, {design}, 2x: 90 % intervals",
        after,
        f"averaged over classes and hypotheses; by the hypothesis of the verdict alone {100 * alone.value:.1f} %; "
        + narrowest(records, after, *COVERED),
    )
    gain = mean([holds(r, "averaged") - holds(r, "without") for r in records])
    yield _limit(
        f"constants without tracing, {design}, 2x: visibly worse",
        "lower than after tracing",
        without,
        gain.low > 0,
        f"tracing gains {100 * gain.value:.1f} points ({100 * gain.low:.1f} to {100 * gain.high:.1f})",
    )


def _of_sizes(named: Records) -> Iterable[Limit]:
    """Sizes of the rightly named, all cells of single effects together."""
    found = [one for record in named for one in record["amplitudes"].values()]
    if not found:
        return
    error = _number("size of what is named right: median relative error", median(errors(found)), 0.25, percent=True)
    if error:
        yield error
    covered = share(found, lambda one: one["q05"] <= one["truth"] <= one["q95"])
    yield _within("size of what is named right: 90 % intervals", covered)
