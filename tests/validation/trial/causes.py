"""Why a limit is missed, counted from the records: who is taken for whom, the weakest class, what is overlooked."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

from validation.trial.counts import ANSWERED, Record, Share, holds, is_best, listed, truth

_MOST = 4


def taken_for(records: Sequence[Record], question: Callable[[Record], bool]) -> str:
    """What was planted and which name it got, if only in part, most frequent first, among records that answer yes."""
    pairs = Counter((_joined(truth(r)), _joined(r["effects"] or r.get("in_part", ()))) for r in records if question(r))
    found = [f"{planted} taken for {named} {n}" for (planted, named), n in pairs.most_common(_MOST)]
    return ", ".join(found)


def flagged_as(records: Sequence[Record]) -> str:
    """By which of the two rules boards without any effect are flagged: the misfit of the plate, or the odds."""
    words = Counter(r["word"] for r in records)
    misfit, odds = words["unexplained"], sum(n for word, n in words.items() if word in ANSWERED)
    return f"misfit of the plate too large for chance {misfit}, an effect needed {odds}"


def weakest(records: Sequence[Record]) -> str:
    """Classes whose best answer is least often right."""
    shares = {}
    for name in sorted({_joined(truth(r)) for r in records}):
        own = [r for r in records if _joined(truth(r)) == name]
        shares[name] = 100.0 * sum(map(is_best, own)) / len(own)
    lowest = sorted(shares, key=lambda name: shares[name])[:_MOST]
    return "weakest: " + ", ".join(f"{name} {shares[name]:.0f} %" for name in lowest)


def overlooked(records: Sequence[Record]) -> str:
    """Planted effects that the set given lacks, out of the boards that carry them."""
    carried = Counter(name for r in records for name in truth(r))
    missing = Counter(name for r in records for name in truth(r) - listed(r))
    found = sorted(missing, key=lambda name: -missing[name] / carried[name])[:_MOST]
    return "overlooked most: " + ", ".join(f"{name} {missing[name]} of {carried[name]}" for name in found)


def narrowest(records: Sequence[Record], found: Share, low: float, high: float) -> str:
    """Classes whose intervals hold the truth least often; and whether only the bounds leave the band."""
    shares = {}
    for name in sorted({_joined(truth(r)) for r in records}):
        own = [r for r in records if _joined(truth(r)) == name]
        shares[name] = 100.0 * sum(holds(r, "averaged") for r in own) / len(own)
    lowest = sorted(shares, key=lambda name: shares[name])[:2]
    text = "least: " + ", ".join(f"{name} {shares[name]:.0f} %" for name in lowest)
    only_bounds = low <= found.value <= high and not (low <= found.low and found.high <= high)
    return f"the estimate lies inside, its bounds do not; {text}" if only_bounds else text


def _joined(names: object) -> str:
    assert isinstance(names, (list, tuple, set, frozenset))
    return " and ".join(sorted(names)) or "nothing"
