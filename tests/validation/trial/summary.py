"""What the records of a trial add up to: the limits, and the tables that explain them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any, get_args

import numpy as np
from validation.trial.cells import CELLS, Cell
from validation.trial.counts import (
    CONSTANTS,
    Record,
    holds,
    is_answered,
    is_best,
    is_claimed,
    is_covered,
    is_flagged,
    is_named,
    is_part_name,
    is_right_name,
    is_wrong_name,
    listed,
    mean,
    median,
    most_probable,
    share,
    truth,
)
from validation.trial.limits import limits
from validation.trial.sizes import errors

from bayesplate.diagnosis.claim import ConditionName

COLUMNS = ("named right", "named wrong", "group with it", "group without it", "none needed", "undetectable",
           "unexplained")  # fmt: skip
CONDITIONS: tuple[str, ...] = get_args(ConditionName)
"""Of a claim, by the names that the package gives them."""
MATRICES = ("one cantilever-6 5c 2x", "one cantilever-6-free-6 5c 2x", "one clamped-9-driven 5c 2x")
"""Cells whose classes are shown one by one in full."""


def summarise(records: Sequence[Record], base_seed: int, cells: Sequence[Cell] = CELLS) -> dict[str, Any]:
    """The whole summary, as JSON.

    Parameters
    ----------
    records : sequence of dict
        Those with an error count as boards without an answer only in their own list: the limits are of the others.
    base_seed : int
    cells : sequence of Cell
    """
    good = [record for record in records if "error" not in record]
    failed = [record for record in records if "error" in record]
    wanted = sum(cell.n for cell in cells)
    by_cell = {cell.name: [r for r in good if r["cell"] == cell.name] for cell in cells}
    return {
        "format": 2,
        "base_seed": base_seed,
        "boards": {"judged": len(good), "failed": len(failed), "wanted": wanted},
        "failures": [{key: r[key] for key in ("cell", "index", "error")} | r["truth"] for r in failed],
        "limits": limits(cells, by_cell),
        "cells": {cell.name: _cell(cell, by_cell[cell.name]) for cell in cells if by_cell[cell.name]},
        "confusion": {name: confusion(by_cell[name]) for name in MATRICES if by_cell.get(name)},
        "amplitudes": _amplitudes(by_cell),
        "claims": claims(cells, by_cell),
    }


def column(record: Record) -> str:
    """Where a board with one planted effect stands in the confusion matrix."""
    if record["word"] == "named":
        return "named right" if is_right_name(record) else "named wrong"
    if record["word"] == "indistinguishable group":
        return "group with it" if is_covered(record) else "group without it"
    return str(record["word"])


def confusion(records: Sequence[Record]) -> dict[str, Any]:
    """For each planted class how often each kind of verdict was given, what was best, and what was named wrongly."""
    result = {}
    for effect in sorted({name for record in records for name in record["truth"]["effects"]}):
        own = [record for record in records if record["truth"]["effects"] == [effect]]
        counted = Counter(column(record) for record in own)
        wrong = Counter(" + ".join(sorted(record["effects"])) for record in own if is_wrong_name(record))
        best = Counter(" + ".join(sorted(most_probable(record))) or "nothing" for record in own)
        result[effect] = {
            "n": len(own),
            **{name: counted[name] for name in COLUMNS},
            "best": dict(best.most_common()),
            "wrong_names": dict(wrong.most_common()),
            "top_1": share(own, is_best).as_json(),
        }
    return result


def _cell(cell: Cell, records: Sequence[Record]) -> dict[str, Any]:
    words = Counter(record["word"] for record in records)
    result: dict[str, Any] = {
        "n": len(records),
        "wanted": cell.n,
        "words": dict(sorted(words.items())),
        "named": share(records, is_named).as_json(),
        "flagged": share(records, is_flagged).as_json(),
        "claimed": share(records, is_claimed).as_json(),
        "gate_of_the_ideal_board": share(records, lambda r: r["gate"]["bare"] >= 0.05).as_json(),
    }
    if cell.kind != "null":  # their constants were not drawn
        result["constants"] = _coverage(records)
    if cell.kind == "outside":
        return result
    result["top_1"] = share(records, is_best).as_json()
    if cell.kind != "null":
        answered = [record for record in records if is_answered(record)]
        named = [record for record in records if is_named(record)]
        result |= {
            "right_name": share(records, is_right_name).as_json(),
            "wrong_name": share(records, is_wrong_name).as_json(),
            "part_name": share(records, is_part_name).as_json(),
            "wrong_of_named": share(named, is_wrong_name).as_json(),
            "covered": share(answered, is_covered).as_json(),
            "set_size": mean([len(listed(record)) for record in answered]).as_json(),
        }
    if cell.kind == "one":
        result["confusion"] = confusion(records)
        result["constants_by_class"] = by_class(records)
    return result


def claims(cells: Sequence[Cell], by_cell: Mapping[str, Sequence[Record]]) -> dict[str, Any]:
    """How often an effect is claimed and each condition of a claim met, by what is planted and what is said of it.

    Conditions are judged where the verdict has an effect to add; of all others there is no share.
    """
    nothing = [record for cell in cells if cell.kind == "null" for record in by_cell[cell.name]]
    something = [record for cell in cells if cell.kind != "null" for record in by_cell[cell.name]]
    outside = [record for cell in cells if cell.kind == "outside" for record in by_cell[cell.name]]
    groups = {
        "nothing planted": nothing,
        "named right": [record for record in something if is_right_name(record)],
        "named one of two": [record for record in something if is_part_name(record)],
        "named wrong": [record for record in something if is_wrong_name(record)],
        "of these outside the library": [record for record in outside if is_wrong_name(record)],
        "group with everything planted": [r for r in something if not is_named(r) and is_answered(r) and is_covered(r)],
        "group without": [r for r in something if not is_named(r) and is_answered(r) and not is_covered(r)],
    }
    return {
        name: {
            "claimed": share(records, is_claimed).as_json(),
            "conditions": {
                one: share([r for r in records if r["conditions"]], lambda r, one=one: r["conditions"][one]).as_json()
                for one in CONDITIONS
                if all(one in record["conditions"] for record in records if record["conditions"])
            },
        }
        for name, records in groups.items()
        if records
    }


def _coverage(records: Sequence[Record]) -> dict[str, Any]:
    """How often intervals of 90 % hold the truth, and how wide they are against its logarithm."""
    result: dict[str, Any] = {}
    for way in ("without", "after", "averaged"):
        result[way] = {"all": mean([holds(record, way) for record in records]).as_json()}
        for name in CONSTANTS:
            found = [record["constants"][name][way] for record in records]
            widths = [float(np.log(one["q95"] / one["q05"])) for one in found]
            result[way][name] = {
                **share(found, lambda one: one["holds"]).as_json(),
                "median_width_percent": 100.0 * float(np.median(widths)),
            }
    return result


def by_class(records: Sequence[Record]) -> dict[str, dict[str, float]]:
    """Coverage of the constants, the three averaged, for each planted class."""
    classes = sorted({next(iter(truth(record))) for record in records})
    return {
        effect: {
            way: float(np.mean([holds(r, way) for r in records if truth(r) == {effect}]))
            for way in ("without", "after", "averaged")
        }
        for effect in classes
    }


def _amplitudes(by_cell: dict[str, list[Record]]) -> dict[str, Any]:
    """Recovery of each effect's size where it was named rightly, all cells of single effects together."""
    named = [r for name, each in by_cell.items() if name.startswith("one ") for r in each if is_right_name(r)]
    result = {}
    for effect in sorted({name for record in named for name in record["amplitudes"]}):
        found = [record["amplitudes"][effect] for record in named if effect in record["amplitudes"]]
        result[effect] = {
            "median_error": median(errors(found)).as_json(),
            "covered": share(found, lambda one: one["q05"] <= one["truth"] <= one["q95"]).as_json(),
        }
    return result
