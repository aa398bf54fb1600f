"""Rows of a batch as they are told: where a board that was not fitted stands, and which boards have the same readings.

Neither is of the board alone, so neither is kept for the next run.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bayesplate.results.board_rows import BoardRow

_MOST_NAMED = 3


def told_rows(rows: Sequence[BoardRow], place: Callable[[int], str]) -> Sequence[BoardRow]:
    """Rows with their places in messages, and with a doubt where readings are alike.

    Parameters
    ----------
    rows : sequence of BoardRow
    place : callable
        Where the board of a row stands, "tops.csv row 3"; empty where its own file says so.

    Returns
    -------
    sequence of BoardRow
        Each is made when it is asked for.
    """
    places: dict[int, str] = {}
    alike: dict[str, list[int]] = {}
    for at, row in enumerate(rows):
        if not row.is_fitted:
            places[at] = place(at)
        elif row.readings_sha256:
            alike.setdefault(row.readings_sha256, []).append(at)
    doubts = dict(_copies(rows, [group for group in alike.values() if len(group) > 1]))
    return _Told(rows, places, doubts)


def _copies(rows: Sequence[BoardRow], groups: Sequence[Sequence[int]]) -> Iterator[tuple[int, str]]:
    for group in groups:
        names = [rows[at].name for at in group]
        for i, at in enumerate(group):
            others = [*names[:i], *names[i + 1 :]]
            more = f" and {len(others) - _MOST_NAMED} more" if len(others) > _MOST_NAMED else ""
            which = f"{', '.join(others[:_MOST_NAMED])}{more}"
            yield at, f"every reading is that of {which} to the last digit: one board twice, or a copy?"


@dataclass(frozen=True)
class _Told(Sequence[BoardRow]):
    rows: Sequence[BoardRow]
    places: Mapping[int, str]
    doubts: Mapping[int, str]

    def __len__(self) -> int:
        return len(self.rows)

    def __getitem__(self, at: Any) -> Any:
        row, place = self.rows[at], self.places.get(at, "")
        if place:
            row = replace(row, message=f"{place} -> {row.message}")
        if at in self.doubts:
            row = replace(row, doubt="; ".join(one for one in (self.doubts[at], row.doubt) if one))
        return row
