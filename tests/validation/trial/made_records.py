"""Records made by hand, as `judge_one` would write them, for tests of what they add up to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from validation.trial.cells import Cell
from validation.trial.counts import CONSTANTS, Record
from validation.trial.summary import CONDITIONS

ALL = (True, True, True)
GROUP = "indistinguishable group"


def made(
    cell: Cell,
    index: int,
    planted: Sequence[str],
    word: str,
    effects: Sequence[str] = (),
    near: Sequence[str] = (),
    *,
    best: Sequence[str] | None = None,
    none: float = 0.01,
    holds: Sequence[bool] = ALL,
    averaged: Sequence[bool] | None = None,
    claim: bool = False,
    amplitudes: dict[str, dict[str, float]] | None = None,
) -> Record:
    """A record; intervals without tracing never hold.

    Parameters
    ----------
    cell : Cell
    index : int
    planted : sequence of str
    word : str
        Of the verdict.
    effects : sequence of str
        Of the verdict.
    near : sequence of str
        Single effects of the set.
    best : sequence of str, optional
        The most probable effects, supported with 0.5; by default the first of the verdict.
    none : float
        Probability that nothing is lacking.
    holds : sequence of bool
        Whether the interval of each constant holds the truth by the hypothesis of the verdict.
    averaged : sequence of bool, optional
        The same averaged over hypotheses; by default alike.
    claim : bool
    amplitudes : dict, optional
    """
    by_way = {"without": (False, False, False), "after": holds, "averaged": averaged or holds}
    constants: dict[str, Any] = {
        name: {way: {"q05": 1.0, "q95": 2.0, "holds": held[i]} for way, held in by_way.items()}
        for i, name in enumerate(CONSTANTS)
    }
    return {
        "cell": cell.name,
        "index": index,
        "truth": {"effects": sorted(planted)},
        "word": word,
        "effects": list(effects),
        "in_part": [],
        "claim": claim,
        "conditions": dict.fromkeys(CONDITIONS, claim) if effects else {},
        "best": list(best if best is not None else effects[:1]),
        "support": 0.5,
        "set": [[[name], 0.5] for name in near],
        "none": none,
        "gate": {"bare": 0.01, "best": 0.5},
        "amplitudes": amplitudes or {},
        "constants": constants,
        "seconds": 1.0,
    }


def found_right(cell: Cell, index: int, planted: Sequence[str], **kept: Any) -> Record:
    """A record of the right answer: nothing where nothing is planted, a name in the library, unexplained outside it."""
    if cell.kind == "null":
        return made(cell, index, (), "none needed", none=0.9, **kept)
    if cell.kind == "outside":
        return made(cell, index, planted, "unexplained", **kept)
    return made(cell, index, planted, "named", planted, planted, best=planted, **kept)
