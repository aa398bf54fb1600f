"""The run of a batch: each board to its row, in whatever order they are done; what is there is not done again."""

from __future__ import annotations

import hashlib
import json
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from bayesplate.board.checks import readings_sha256
from bayesplate.board.named import load_named
from bayesplate.commands.batch_boards import Source
from bayesplate.commands.batch_pool import Call, WorkerDied, Workers, computed
from bayesplate.commands.fit_board import FitRequest, fit_board, fit_board_into
from bayesplate.commands.prepare import prepared_card
from bayesplate.errors import (
    BayesplateError,
    InputError,
    NotConvergedError,
    NotIdentifiableError,
    UnwritableError,
)
from bayesplate.grading.boards import FORMAT, WORDS, BoardRow, row_of
from bayesplate.grading.storage import Journal
from bayesplate.posterior.sampling import Progress
from bayesplate.results.folder import BOARDS, SUMMARY
from bayesplate.results.summary import versions

_REFUSED, _INTERNAL, _DIED = "refused", "internal error", "worker died"
_OUTCOMES: tuple[tuple[type[BaseException], str], ...] = (
    (InputError, _REFUSED),
    (NotIdentifiableError, "not identifiable"),
    (NotConvergedError, "not converged"),
    (WorkerDied, _DIED),
)
_AGAIN = (_INTERNAL, _DIED)
"""What may end otherwise the next time: these boards are tried again when a run is continued."""
_TOLD_EVERY = 100
"""Times that progress is told, at most."""


@dataclass(frozen=True, eq=False)
class Run:
    """The boards of a batch and what is asked of each."""

    boards: Source
    request: FitRequest
    folder: Path
    folders: bool
    report: bool
    versions: Mapping[str, str] = field(default_factory=versions)

    def fitted(self, by: Workers, journal: Journal, progress: Callable[[Progress], None] | None) -> array[int]:
        """Fit the boards that the journal does not hold; where all their rows stand, in the order of their names."""
        places = array("q", bytes(8 * len(self.boards.names)))
        refused: dict[str, int] = {}  # rows of boards of one name are alike
        done = _Done(len(self.boards.names), progress)

        def write(at: int, key: str, row: BoardRow) -> None:
            place = refused.get(key, journal.place(key))
            if place is None or journal.row(place) != row:
                place = journal.append(key, row)
            if not row.is_fitted:
                refused[key] = place
            places[at] = place
            done.tell(row.is_fitted)

        def calls() -> Iterator[tuple[tuple[int, _Posed], Call]]:
            twice = _named_twice(self.boards.names)
            for at in sorted(range(len(self.boards.names)), key=self.boards.alike.__getitem__):
                posed = self._posed(at, twice)
                if isinstance(posed, BoardRow):
                    write(at, _hash("refused", posed.to_json()), posed)
                elif (row := self._done(posed.key, at, journal)) is not None:
                    write(at, posed.key, row)
                else:
                    yield (at, posed), posed.call

        with closing(computed(by, calls())) as answers:
            for (at, posed), future in answers:
                row = replace(_answer(self.boards.names[at], future), card_sha256=posed.card_sha256, seed=posed.seed)
                write(at, posed.key, replace(row, readings_sha256=posed.readings_sha256 if row.is_fitted else ""))
        return places

    def _done(self, key: str, at: int, journal: Journal) -> BoardRow | None:
        """The row of an earlier run, where there is one and the board need not be computed again."""
        place = journal.place(key)
        if place is None:
            return None
        row = journal.row(place)
        own = self.folder / BOARDS / self.boards.names[at] / SUMMARY
        is_there = not self.folders or not row.is_fitted or own.is_file()
        return row if row.outcome not in _AGAIN and is_there else None

    def _posed(self, at: int, twice: frozenset[str]) -> _Posed | BoardRow:
        """What is to be computed of a board, or the row that says why nothing is."""
        name = self.boards.names[at]
        if name.casefold() in twice:
            return BoardRow(name, _REFUSED, f"wanted a name of its own, got {name} more than once")
        try:
            card = self.boards.card(at)
            named = load_named(card)
            if named.faults or named.prior is None:
                prepared_card(card, named, self.request.effects)  # which raises with all other faults as well
        except InputError as error:
            return BoardRow(name, _REFUSED, _one_line(error))
        assert named.prior is not None
        seed = int(_hash(self.request.seed, card.sha256)[:8], 16)
        request = replace(self.request, seed=seed, tables=dict(named.tables))
        tables = {table: repr(one) for table, one in sorted(named.tables.items())}
        asked = {**asdict(replace(request, tables={})), "tables": tables}
        key = _hash(FORMAT, WORDS, self.versions, card.name, card.sha256, named.prior.to_toml(), asked)
        arguments = (card, named.prior, request)
        call = Call(fit_board, arguments)
        if self.folders:
            call = Call(fit_board_into, (self.folder.resolve() / BOARDS / card.name, self.report, *arguments))
        return _Posed(key, call, card.sha256, seed, readings_sha256(card))


@dataclass(frozen=True)
class _Posed:
    """A board to be computed: the key of its row, the call, and what its row says even if it fails."""

    key: str
    call: Call
    card_sha256: str
    seed: int
    readings_sha256: str


class _Done:
    """How many boards are done, told now and then."""

    def __init__(self, n: int, tell: Callable[[Progress], None] | None) -> None:
        self._n, self._tell, self._n_done, self._n_failed = n, tell, 0, 0

    def tell(self, is_fitted: bool) -> None:
        """One more is done."""
        self._n_done += 1
        self._n_failed += not is_fitted
        every = max(1, self._n // _TOLD_EVERY)
        if self._tell is not None and (self._n_done % every == 0 or self._n_done == self._n):
            failed = f", {self._n_failed} not fitted" if self._n_failed else ""
            stage = f"{self._n_done} of {self._n} boards{failed}"
            self._tell(Progress(0, 0, stage=stage, done=self._n_done / self._n))


def _answer(name: str, future: Future[Any]) -> BoardRow:
    """The row of a board that was computed."""
    error = future.exception()
    if error is None:
        return row_of(future.result())
    if isinstance(error, UnwritableError) or not isinstance(error, Exception):
        raise error  # a full disk is no board's fault
    outcome = next((word for kind, word in _OUTCOMES if isinstance(error, kind)), _INTERNAL)
    if type(error).__name__ == "KilledWorker":  # Dask's word for it
        outcome = _DIED
    told = "" if isinstance(error, BayesplateError | WorkerDied) else f"{type(error).__name__}: "
    return BoardRow(name, outcome, told + _one_line(error))


def _one_line(error: BaseException) -> str:
    return "; ".join(str(error).splitlines())


def _named_twice(names: Sequence[str]) -> frozenset[str]:
    """Names that several boards have: none of them is fitted, for nobody could tell whose row or folder it is."""
    return frozenset(one for one, other in pairwise(sorted(map(str.casefold, names))) if one == other)


def _hash(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(part: object) -> object:
    return dict(part) if isinstance(part, Mapping) else repr(part)
