"""batch.json as types: how many boards of a batch were fitted, which are in doubt, and why others were not fitted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

FORMAT = 1
_MOST_TOLD = 10


@dataclass(frozen=True)
class Failure:
    """A board that was not fitted: its name, what became of it, and the message of the error."""

    name: str
    outcome: str
    message: str


@dataclass(frozen=True)
class Doubt:
    """A board that was fitted and whose constants are not to be trusted, and why."""

    name: str
    doubt: str


@dataclass(frozen=True)
class BatchSummary:
    """What became of the boards of a batch.

    Attributes
    ----------
    format : int
    seed : int
        From which each board's own follows.
    versions : dict of str
    n_boards, n_fitted, n_failed : int
    failed : tuple of Failure
        In the order of their names.
    doubts : tuple of Doubt
        Of the boards that were fitted, in the order of their names.
    aside : tuple of str
        Files beside the cards that are cards of another kind.
    """

    format: int
    seed: int
    versions: Mapping[str, str]
    n_boards: int
    n_fitted: int
    n_failed: int
    failed: tuple[Failure, ...]
    doubts: tuple[Doubt, ...]
    aside: tuple[str, ...]

    def failures_text(self, table: str) -> str:
        """The boards that were not fitted, the first ten with their reasons, and where the others stand."""
        lines = [f"{self.n_failed} of {self.n_boards} boards were not fitted, the others are written:"]
        lines += [f"{one.name}: {one.outcome}: {one.message}" for one in self.failed[:_MOST_TOLD]]
        if self.n_failed > _MOST_TOLD:
            lines.append(f"and {self.n_failed - _MOST_TOLD} more, in {table}")
        return "\n".join([*lines, "correct their cards or rows: --resume then fits these alone"])
