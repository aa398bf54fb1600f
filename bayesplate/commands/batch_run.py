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
from bayesplate.board.named import load_named_cards
from bayesplate.commands.batch_boards import BatchBoard
from bayesplate.commands.fit_board import FitRequest, fit_board, fit_board_into
from bayesplate.commands.prepare import prepare_card
from bayesplate.commands.workers import Call, WorkerDied, compute_calls
from bayesplate.errors import BayesplateError, InputError, NotConvergedError, NotIdentifiableError, UnwritableError
from bayesplate.grading.boards import FORMAT, TEXT_COLUMNS, BoardRow, board_row
from bayesplate.grading.storage import Journal
from bayesplate.posterior.sampling import Progress
from bayesplate.results.folder import BOARDS_FOLDER, PAGE_FILE, SUMMARY_FILE
from bayesplate.results.summary import versions

_REFUSED, _INTERNAL, _DIED = "refused", "internal error", "worker died"
_OUTCOMES: dict[type[BaseException], str] = {
    InputError: _REFUSED,
    NotIdentifiableError: "not identifiable",
    NotConvergedError: "not converged",
    WorkerDied: _DIED,
}
_RETRIED_OUTCOMES = (_INTERNAL, _DIED)
"""Outcomes that may differ the next time: these boards are fitted again when a run is continued."""
_MOST_PROGRESS_MESSAGES = 100
"""Largest number of progress messages of a batch."""


@dataclass(frozen=True, eq=False)
class BatchRun:
    """The boards of a batch, and how each is fitted."""

    boards: Sequence[BatchBoard]
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
        counts = Counter[bool]()

        def record(index: int, key: str, row: BoardRow) -> None:
            if self.journal.rows.get(key) != row:
                self.journal.append(key, row)
            keys[index] = key
            counts[row.is_fitted] += 1
            if progress is not None and (
                counts.total() % max(1, n // _MOST_PROGRESS_MESSAGES) == 0 or counts.total() == n
            ):
                failed = f", {counts[False]} not fitted" if counts[False] else ""
                stage = f"{counts.total()} of {n} boards{failed}"
                progress(Progress(0, 0, stage=stage, done=counts.total() / n))

        def calls() -> Iterator[tuple[tuple[int, str, BoardRow], Call]]:
            names = Counter(board.name.casefold() for board in self.boards)
            for index, board in sorted(enumerate(self.boards), key=lambda numbered: numbered[1].alike):
                name = board.name
                if names[name.casefold()] > 1:  # nobody could tell whose row or folder it is
                    got = f"{name} more than once (a and A are one name)"
                    refusal = BoardRow(name, _REFUSED, f"wanted a name of its own, got {got}")
                    record(index, _hash(_REFUSED, refusal.message), refusal)
                    continue
                try:
                    key, row, call = self._prepare_fit(board)
                except InputError as error:
                    refusal = BoardRow(name, _REFUSED, _one_line(error))
                    record(index, _hash(_REFUSED, name, refusal.message), refusal)
                    continue
                earlier_row = self.journal.rows.get(key)
                if earlier_row is not None and self._is_complete(earlier_row):
                    record(index, key, earlier_row)
                else:
                    yield (index, key, row), call

        for (index, key, row), future in compute_calls(free, calls()):
            record(index, key, _finished_row(row, future))
        return keys

    def _is_complete(self, row: BoardRow) -> bool:
        """Whether the row of an earlier run is complete, so that its board need not be fitted again."""
        files = (SUMMARY_FILE, PAGE_FILE) if self.report else (SUMMARY_FILE,)
        folder = self.folder / BOARDS_FOLDER / row.name
        return row.outcome not in _RETRIED_OUTCOMES and (
            not self.folders or not row.is_fitted or all((folder / name).is_file() for name in files)
        )

    def _prepare_fit(self, board: BatchBoard) -> tuple[str, BoardRow, Call]:
        """The key of a board's row, the row as it is before the fit, and the fit to compute; raises InputError."""
        card = board.card()
        named_cards = load_named_cards(card)
        if named_cards.faults or named_cards.prior is None:
            prepare_card(card, named_cards, self.request.effects)  # which raises with all other faults as well
        assert named_cards.prior is not None
        seed = int(_hash(self.request.seed, card.sha256)[:8], 16)
        request = replace(self.request, seed=seed, tables=dict(sorted(named_cards.tables.items())))
        key = _hash(
            FORMAT, TEXT_COLUMNS, self.versions, card.name, card.sha256, named_cards.prior.to_toml(), repr(request)
        )
        row = BoardRow(board.name, "", card_sha256=card.sha256, seed=seed, readings_sha256=readings_sha256(card))
        arguments = (card, named_cards.prior, request)
        if self.folders:
            folder = self.folder.resolve() / BOARDS_FOLDER / card.name
            return key, row, (fit_board_into, (folder, self.report, *arguments))
        return key, row, (fit_board, arguments)


def _finished_row(row: BoardRow, future: Future[Any]) -> BoardRow:
    """The row of a board after its fit: its constants, or its error."""
    error = future.exception()
    if error is None:
        return replace(board_row(future.result()), seed=row.seed, readings_sha256=row.readings_sha256)
    if isinstance(error, UnwritableError) or not isinstance(error, Exception):
        raise error  # a full disk is no board's fault
    outcome = next((word for kind, word in _OUTCOMES.items() if isinstance(error, kind)), _INTERNAL)
    if type(error).__name__ == "KilledWorker":  # Dask's word for it
        outcome = _DIED
    kind = "" if isinstance(error, BayesplateError | WorkerDied) else f"{type(error).__name__}: "
    return replace(row, outcome=outcome, message=kind + _one_line(error), readings_sha256="")


def _one_line(error: BaseException) -> str:
    return "; ".join(str(error).splitlines())


def _hash(*values: object) -> str:
    return hashlib.sha256(json.dumps(values, sort_keys=True).encode()).hexdigest()
