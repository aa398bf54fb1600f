"""`batch`: the boards of a folder or a table to one table of their constants, on all cores or on a cluster."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Future
from contextlib import closing, contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from bayesplate.cards import load_named
from bayesplate.errors import (
    BatchError,
    BayesplateError,
    CheckpointError,
    InputError,
    NotConvergedError,
    NotIdentifiableError,
    RunInterrupted,
    UnwritableError,
)
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.sampling import Progress
from bayesplate.results.batch_summary import FORMAT, BatchSummary, Failure
from bayesplate.results.board_journal import Journal
from bayesplate.results.board_rows import BoardRow, row_of
from bayesplate.results.board_table import TableKind, require_table_kind, write_table
from bayesplate.results.folder import BOARDS, SUMMARY, OutputFolder, json_text, run_of_its_own, write_text
from bayesplate.results.grading import Grading, GradingRequest, grade
from bayesplate.results.versions import versions
from bayesplate.workflow.arguments import require_arguments
from bayesplate.workflow.batch_boards import Entry, Source, boards_of
from bayesplate.workflow.batch_pool import Call, WorkerDied, Workers, computed, dask_cluster, processes
from bayesplate.workflow.fit_board import FitRequest, fit_board, fit_board_into
from bayesplate.workflow.prepare import prepared_card

JOURNAL = "boards.jsonl"
BATCH = "batch.json"
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


@dataclass(frozen=True, eq=False, repr=False)
class BatchResult:
    """What a batch leaves.

    Attributes
    ----------
    folder : Path
    table : Path
        boards.csv or boards.parquet, a row for each board in the order of their names.
    summary : BatchSummary
        What batch.json holds: how many boards were fitted, and why the others were not.
    grading : Grading
        What the boards that were fitted are good for.
    """

    folder: Path
    table: Path
    summary: BatchSummary
    grading: Grading

    def require_all(self) -> None:
        """Raise BatchError where a board was not fitted."""
        if self.summary.n_failed:
            raise BatchError(self.summary.failures_text(self.table.name))

    def __repr__(self) -> str:
        return f"<BatchResult: {self.summary.n_fitted} of {self.summary.n_boards} boards fitted, {self.table}>"


def default_batch_folder(source: str | os.PathLike[str]) -> Path:
    """Where the command line writes a batch unless it is told: results/NAME, of the folder or the table."""
    return Path("results") / (Path(source).resolve().stem or "batch")


@run_of_its_own()
def batch(
    source: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    template: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    dask: str | None = None,
    folders: bool = False,
    table: TableKind = "csv",
    seed: int = 1,
    effects: Sequence[str] | None = None,
    law: LawName | None = None,
    robust: bool = False,
    grading: GradingRequest | None = None,
    report: bool = True,
    force: bool = False,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> BatchResult:
    """Fit many boards, each for itself.

    Parameters
    ----------
    source : path
        A folder of board cards, or a table (.csv or .parquet) with a row for each board.
    out : path
        Output folder: the table, batch.json, the grading page, and boards.jsonl, from which the next run goes on.
    template : str or path, optional
        With a table: the board card of what is common to all its boards.
    workers : int, optional
        Processes; by default one for each core. The numbers do not depend on it.
    dask : str, optional
        Address of the scheduler of a Dask cluster, which then computes in their place.
    folders : bool
        Whether to write the files of `fit` for each board too, into boards/NAME.
    table : "csv" or "parquet"
    seed : int
        Each board's own seed follows from this one and from its card, not from its place among the others.
    effects, law, robust
        As of `fit`, of every board.
    grading : GradingRequest, optional
        When two boards match, limits of a specification, and the stiffness that a thickness is wanted for.
    report : bool
        Whether to write grading.html and figures, and report.html in the boards' folders.
    force, resume : bool
        Replace the results in the folder, or go on: boards whose card did not change are not fitted again.
    progress : callable, optional
        Told as boards are done.

    Returns
    -------
    BatchResult
        Boards that could not be fitted are named in it, with the reason in the table.

    Raises
    ------
    InputError
        If there is no board, or the arguments, the folder or the cluster cannot be used; then nothing is written.
    CheckpointError
        If there is nothing to resume, or another run is at work in the folder.
    """
    require_arguments(
        source=source, out_folder=out, template=template, workers=workers, dask=dask, folders=folders, table=table,
        seed=seed, effects=effects, law=law, robust=robust, grading=grading, report=report,
        force=force, resume=resume, progress=progress,
    )  # fmt: skip
    require_table_kind(table)
    boards = boards_of(source, template)
    folder = OutputFolder(Path(out))
    _require_usable(folder, force=force, resume=resume)
    by = processes(workers or os.cpu_count() or 1) if dask is None else dask_cluster(dask)
    folder.open(resume=resume)
    request = FitRequest(seed, None if effects is None else tuple(effects), law, robust)
    run = _Run(boards, request, folder.path, folders, report)
    journal = Journal(folder.path / JOURNAL)
    try:
        with _interruptions_told():
            keys = run.fitted(by, journal, progress)
        written = write_table(folder.path, table, journal.rows(keys))
        graded = grade(journal.rows(keys), grading or GradingRequest())
        summary = _summary(run, seed, journal, keys)
        journal.keep(dict.fromkeys(keys))
    finally:
        journal.close()
    write_text(folder.path / BATCH, json_text(summary))
    _write_grading(folder.path, graded, summary, folders=folders and report, report=report)
    folder.close()
    return BatchResult(folder.path, written, summary, graded)


def _write_grading(folder: Path, graded: Grading, summary: BatchSummary, *, folders: bool, report: bool) -> None:
    from bayesplate.results.grading_table import write_grading

    write_grading(folder, graded)
    if report:
        from bayesplate.report.grading_page import write_grading_page

        write_grading_page(folder, graded, summary, has_pages=folders)


def _require_usable(folder: OutputFolder, *, force: bool, resume: bool) -> None:
    if not resume:
        folder.require_usable(force=force, resume=False)
    elif not (folder.path / JOURNAL).is_file():
        raise CheckpointError(f"{folder.path}: wanted the {JOURNAL} of an earlier run, got none (--force runs it anew)")


@contextmanager
def _interruptions_told() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise RunInterrupted("interrupted; --resume goes on with the boards that are left") from None


@dataclass(frozen=True, eq=False)
class _Run:
    """The boards of a batch and what is asked of each."""

    boards: Source
    request: FitRequest
    folder: Path
    folders: bool
    report: bool
    versions: Mapping[str, str] = field(default_factory=versions)

    def fitted(self, by: Workers, journal: Journal, progress: Callable[[Progress], None] | None) -> list[str]:
        """Fit the boards that the journal does not hold; the keys of all, in the order of their names."""
        keys: dict[int, str] = {}
        done = _Done(len(self.boards.entries), progress)

        def write(at: int, key: str, row: BoardRow) -> None:
            keys[at] = key
            if key not in journal or journal.row(key) != row:
                journal.append(key, row)
            done.tell(row.is_fitted)

        def calls() -> Iterator[tuple[tuple[int, str, Entry, str, int], Call]]:
            twice = _named_twice(self.boards.entries)
            order = sorted(range(len(self.boards.entries)), key=lambda i: (self.boards.entries[i].alike, i))
            for at in order:
                entry = self.boards.entries[at]
                posed = self._posed(entry, twice)
                if isinstance(posed, BoardRow):
                    write(at, _hash("refused", posed.to_json()), posed)
                elif self._is_done(posed.key, entry, journal):
                    write(at, posed.key, journal.row(posed.key))
                else:
                    yield (at, posed.key, entry, posed.card_sha256, posed.seed), posed.call

        with closing(computed(by, calls())) as answers:
            for (at, key, entry, card_sha256, seed), future in answers:
                row = _answer(entry, future)
                write(at, key, row if row.is_fitted else replace(row, card_sha256=card_sha256, seed=seed))
        return [keys[at] for at in range(len(self.boards.entries))]

    def _is_done(self, key: str, entry: Entry, journal: Journal) -> bool:
        if key not in journal:
            return False
        row = journal.row(key)
        is_there = not self.folders or not row.is_fitted or (self.folder / BOARDS / entry.name / SUMMARY).is_file()
        return row.outcome not in _AGAIN and is_there

    def _posed(self, entry: Entry, twice: frozenset[str]) -> _Posed | BoardRow:
        """What is to be computed of a board, or the row that says why nothing is."""
        if entry.name.casefold() in twice:
            return BoardRow(entry.name, _REFUSED, f"wanted a name of its own, got {entry.name} more than once")
        try:
            card = self.boards.card(entry)
            named = load_named(card)
            if named.faults or named.prior is None:
                prepared_card(card, named, self.request.effects)  # which raises with all other faults as well
        except InputError as error:
            return BoardRow(entry.name, _REFUSED, _one_line(error))
        assert named.prior is not None
        seed = int(_hash(self.request.seed, card.sha256)[:8], 16)
        request = replace(self.request, seed=seed, tables=dict(named.tables))
        tables = {name: repr(one) for name, one in sorted(named.tables.items())}
        asked = {**asdict(replace(request, tables={})), "tables": tables}
        key = _hash(FORMAT, self.versions, card.name, card.sha256, named.prior.to_card(), asked)
        arguments = (card, named.prior, request)
        call = Call(fit_board, arguments)
        if self.folders:
            call = Call(fit_board_into, (self.folder.resolve() / BOARDS / card.name, self.report, *arguments))
        return _Posed(key, call, card.sha256, seed)


@dataclass(frozen=True)
class _Posed:
    """A board to be computed: the key of its row, the call, and what its row says even if it fails."""

    key: str
    call: Call
    card_sha256: str
    seed: int


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
            self._tell(Progress(0, 0, None, stage=stage, done=self._n_done / self._n))


def _answer(entry: Entry, future: Future[Any]) -> BoardRow:
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
    return BoardRow(entry.name, outcome, told + _one_line(error))


def _one_line(error: BaseException) -> str:
    return "; ".join(str(error).splitlines())


def _named_twice(entries: Sequence[Entry]) -> frozenset[str]:
    """Names that several boards have: none of them is fitted, for nobody could tell whose row or folder it is."""
    seen: set[str] = set()
    twice: set[str] = set()
    for entry in entries:
        name = entry.name.casefold()
        (twice if name in seen else seen).add(name)
    return frozenset(twice)


def _hash(*parts: object) -> str:
    return hashlib.sha256(json.dumps(parts, sort_keys=True, default=_plain).encode()).hexdigest()


def _plain(part: object) -> object:
    return dict(part) if isinstance(part, Mapping) else repr(part)


def _summary(run: _Run, seed: int, journal: Journal, keys: Sequence[str]) -> BatchSummary:
    failures, n_fitted = [], 0
    for row in journal.rows(keys):
        n_fitted += row.is_fitted
        if not row.is_fitted:
            failures.append(Failure(row.name, row.outcome, row.message))
    n = len(keys)
    return BatchSummary(FORMAT, seed, run.versions, n, n_fitted, n - n_fitted, tuple(failures), tuple(run.boards.aside))
