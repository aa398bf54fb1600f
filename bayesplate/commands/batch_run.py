"""The boards of a batch, fitted by many workers: those whose rows the journal of an earlier run does not hold."""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from bayesplate.board.checks import readings_sha256
from bayesplate.board.named import load_named
from bayesplate.commands.batch_boards import Entry
from bayesplate.commands.fit_board import FitRequest, fit_board, fit_board_into
from bayesplate.commands.prepare import prepared_card
from bayesplate.commands.workers import Call, WorkerDied, computed
from bayesplate.errors import BayesplateError, InputError, NotConvergedError, NotIdentifiableError, UnwritableError
from bayesplate.grading.boards import FORMAT, WORDS, BoardRow, row_of
from bayesplate.grading.storage import Journal
from bayesplate.posterior.sampling import Progress
from bayesplate.results.folder import BOARDS, SUMMARY
from bayesplate.results.summary import versions

_REFUSED, _INTERNAL, _DIED = "refused", "internal error", "worker died"
_OUTCOMES: dict[type[BaseException], str] = {
    InputError: _REFUSED,
    NotIdentifiableError: "not identifiable",
    NotConvergedError: "not converged",
    WorkerDied: _DIED,
}
_AGAIN = (_INTERNAL, _DIED)
"""What may end otherwise the next time: these boards are tried again when a run is continued."""
_TOLD_EVERY = 100
"""Times that progress is told, at most."""


@dataclass(frozen=True, eq=False)
class BatchRun:
    """The boards of a batch, and what is asked of each."""

    boards: Sequence[Entry]
    request: FitRequest
    folder: Path
    folders: bool
    report: bool
    journal: Journal
    versions: Mapping[str, str] = field(default_factory=versions)

    def fitted(self, free: list[Executor], progress: Callable[[Progress], None] | None) -> list[str]:
        """Fit the boards that the journal lacks; the keys of all rows, in the order of the names."""
        n = len(self.boards)
        keys = [""] * n
        told = Counter[bool]()

        def done(at: int, key: str, row: BoardRow) -> None:
            if self.journal.rows.get(key) != row:
                self.journal.append(key, row)
            keys[at] = key
            told[row.is_fitted] += 1
            if progress is not None and (told.total() % max(1, n // _TOLD_EVERY) == 0 or told.total() == n):
                failed = f", {told[False]} not fitted" if told[False] else ""
                stage = f"{told.total()} of {n} boards{failed}"
                progress(Progress(0, 0, stage=stage, done=told.total() / n))

        def calls() -> Iterator[tuple[tuple[int, str, BoardRow], Call]]:
            names = Counter(board.name.casefold() for board in self.boards)
            for at, board in sorted(enumerate(self.boards), key=lambda each: each[1].alike):
                name = board.name
                if names[name.casefold()] > 1:  # nobody could tell whose row or folder it is
                    refusal = BoardRow(name, _REFUSED, f"wanted a name of its own, got {name} more than once")
                    done(at, _hash(_REFUSED, refusal.message), refusal)
                    continue
                try:
                    key, row, call = self._posed(board)
                except InputError as error:
                    refusal = BoardRow(name, _REFUSED, _one_line(error))
                    done(at, _hash(_REFUSED, name, refusal.message), refusal)
                    continue
                known = self.journal.rows.get(key)
                if known is not None and self._is_whole(known):
                    done(at, key, known)
                else:
                    yield (at, key, row), call

        for (at, key, row), future in computed(free, calls()):
            done(at, key, _answered(row, future))
        return keys

    def _is_whole(self, row: BoardRow) -> bool:
        """Whether a board that an earlier run left need not be computed again."""
        own = self.folder / BOARDS / row.name / SUMMARY
        return row.outcome not in _AGAIN and (not self.folders or not row.is_fitted or own.is_file())

    def _posed(self, board: Entry) -> tuple[str, BoardRow, Call]:
        """The key of a board's row, the row as it is before the fit, and the fit to compute; raises InputError."""
        card = board.card()
        named = load_named(card)
        if named.faults or named.prior is None:
            prepared_card(card, named, self.request.effects)  # which raises with all other faults as well
        assert named.prior is not None
        seed = int(_hash(self.request.seed, card.sha256)[:8], 16)
        request = replace(self.request, seed=seed, tables=dict(sorted(named.tables.items())))
        key = _hash(FORMAT, WORDS, self.versions, card.name, card.sha256, named.prior.to_toml(), repr(request))
        row = BoardRow(board.name, "", card_sha256=card.sha256, seed=seed, readings_sha256=readings_sha256(card))
        arguments = (card, named.prior, request)
        if self.folders:
            folder = self.folder.resolve() / BOARDS / card.name
            return key, row, (fit_board_into, (folder, self.report, *arguments))
        return key, row, (fit_board, arguments)


def _answered(row: BoardRow, future: Future[Any]) -> BoardRow:
    """The row of a board that was computed: its constants, or its error."""
    error = future.exception()
    if error is None:
        return replace(row_of(future.result()), seed=row.seed, readings_sha256=row.readings_sha256)
    if isinstance(error, UnwritableError) or not isinstance(error, Exception):
        raise error  # a full disk is no board's fault
    outcome = next((word for kind, word in _OUTCOMES.items() if isinstance(error, kind)), _INTERNAL)
    if type(error).__name__ == "KilledWorker":  # Dask's word for it
        outcome = _DIED
    kind = "" if isinstance(error, BayesplateError | WorkerDied) else f"{type(error).__name__}: "
    return replace(row, outcome=outcome, message=kind + _one_line(error), readings_sha256="")


def _one_line(error: BaseException) -> str:
    return "; ".join(str(error).splitlines())


def _hash(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
