"""Shares of boards with their exact bounds, and what a record says about each question of the trial."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Record = dict[str, Any]

LEVEL = 0.95
FLAGGED = ("named", "indistinguishable group", "unexplained")
ANSWERED = ("named", "indistinguishable group")
QUIET = ("none needed", "undetectable")
CONSTANTS = ("E_x", "E_y", "G_xy")


@dataclass(frozen=True)
class Share:
    """So many of so many, with Clopper-Pearson bounds.

    Attributes
    ----------
    count : float
        A whole number, or the sum of averages where several questions are asked of one board.
    n : int
    """

    count: float
    n: int

    @property
    def value(self) -> float:
        """The share; not a number of nothing."""
        return self.count / self.n if self.n else float("nan")

    @property
    def low(self) -> float:
        """Lower bound."""
        return self._bound(0.5 * (1.0 - LEVEL), self.count, self.n - self.count + 1) if self.count > 0 else 0.0

    @property
    def high(self) -> float:
        """Upper bound."""
        if self.count >= self.n:
            return 1.0
        return self._bound(0.5 * (1.0 + LEVEL), self.count + 1, self.n - self.count)

    @staticmethod
    def _bound(probability: float, a: float, b: float) -> float:
        from scipy.special import betaincinv

        return float(betaincinv(a, b, probability))

    def as_json(self) -> dict[str, float]:
        """For the file."""
        return {"count": self.count, "n": self.n, "share": self.value, "low": self.low, "high": self.high}


def share(records: Iterable[Record], question: Callable[[Record], float]) -> Share:
    """How many records answer yes."""
    answers = [float(question(record)) for record in records]
    return Share(sum(answers), len(answers))


@dataclass(frozen=True)
class Mean:
    """A mean or median with bounds of 95 %: of a mean by its standard error, of a median by order statistics."""

    value: float
    low: float
    high: float
    n: int

    def as_json(self) -> dict[str, float]:
        """For the file."""
        return {"value": self.value, "low": self.low, "high": self.high, "n": self.n}


def mean(values: Sequence[float]) -> Mean:
    """Mean of values."""
    found = np.asarray(values, dtype=float)
    if found.size < 2:
        return Mean(float(found.mean()) if found.size else float("nan"), float("-inf"), float("inf"), found.size)
    error = 1.96 * float(found.std(ddof=1)) / float(np.sqrt(found.size))
    middle = float(found.mean())
    return Mean(middle, middle - error, middle + error, found.size)


def median(values: Sequence[float]) -> Mean:
    """Median of values."""
    from scipy.special import bdtr

    found = np.sort(np.asarray(values, dtype=float))
    n = found.size
    if not n:
        return Mean(float("nan"), float("-inf"), float("inf"), 0)
    outside = [k for k in range(n // 2) if bdtr(k, n, 0.5) <= 0.5 * (1.0 - LEVEL)]
    rank = len(outside) - 1  # the interval from this order statistic to its mirror image covers at least 95 %
    bounds = (float(found[rank]), float(found[n - 1 - rank])) if outside else (float("-inf"), float("inf"))
    return Mean(float(np.median(found)), *bounds, n)


def truth(record: Record) -> frozenset[str]:
    """What is planted."""
    return frozenset(record["truth"]["effects"])


def listed(record: Record) -> frozenset[str]:
    """Effects that the verdict gives, of a name or a group, and those within a factor ten of it; empty otherwise."""
    if record["word"] not in ANSWERED:
        return frozenset()
    return frozenset(record["effects"]).union(*(members for members, _ in record["set"]))


def is_named(record: Record) -> bool:
    """Whether the verdict is a unique name."""
    return bool(record["word"] == "named")


def is_judged_in_part(record: Record) -> bool:
    """Whether the trial asked of a board what explains it in part: older records do not tell."""
    return "in_part" in record


def is_named_or_in_part(record: Record) -> bool:
    """Whether the verdict is a unique name, or unexplained with one that explains a part."""
    return is_named(record) or bool(record["in_part"])


def is_flagged(record: Record) -> bool:
    """Whether anything but peace is reported."""
    return record["word"] in FLAGGED


def is_answered(record: Record) -> bool:
    """Whether the verdict gives a set."""
    return record["word"] in ANSWERED


def is_wrong_name(record: Record) -> bool:
    """Uniquely named, and something of the name is not planted. One of two planted effects is a part, not wrong."""
    return is_named(record) and not frozenset(record["effects"]) <= truth(record)


def is_right_name(record: Record) -> bool:
    """Uniquely named, and what is planted."""
    return is_named(record) and frozenset(record["effects"]) == truth(record)


def is_part_name(record: Record) -> bool:
    """Uniquely named, and less than what is planted: one of two."""
    return is_named(record) and frozenset(record["effects"]) < truth(record)


def most_probable(record: Record) -> frozenset[str]:
    """The most probable answer, whatever the verdict; empty where nothing is more probable than the best effect."""
    return frozenset(record["best"]) if record["support"] > record["none"] else frozenset()


def is_best(record: Record) -> bool:
    """Whether the most probable answer, nothing included, is what is planted."""
    return most_probable(record) == truth(record)


def is_not_needed(record: Record) -> bool:
    """Whether the verdict is that nothing is lacking."""
    return bool(record["word"] == "none needed")


def is_claimed(record: Record) -> bool:
    """Whether it is claimed that an effect reduces the error."""
    return bool(record["claim"])


def is_covered(record: Record) -> bool:
    """Whether everything planted stands in the set."""
    return truth(record) <= listed(record)


def holds(record: Record, way: str) -> float:
    """Share of the three constants whose interval holds the truth."""
    return float(np.mean([record["constants"][name][way]["holds"] for name in CONSTANTS]))
