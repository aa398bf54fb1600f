"""`batch`: the boards of a folder or a table to one table of their constants, on all cores or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from bayesplate.commands.arguments import checked
from bayesplate.commands.batch_boards import boards_of
from bayesplate.commands.batch_options import (
    Dask,
    Folders,
    GradingOptions,
    NumberOfWorkers,
    OutOfBatch,
    Table,
    Template,
)
from bayesplate.commands.batch_pool import dask_cluster, processes
from bayesplate.commands.batch_run import Run
from bayesplate.commands.fit_board import FitRequest
from bayesplate.commands.options import (
    ANY_PATH,
    Effects,
    FilePath,
    Force,
    Law,
    OnProgress,
    Report,
    Resume,
    Robust,
    Seed,
)
from bayesplate.errors import (
    BatchError,
    CheckpointError,
    RunInterrupted,
)
from bayesplate.files import write_text
from bayesplate.grading.boards import FORMAT, BatchSummary, BoardRow, Doubt, Failure, told_rows
from bayesplate.grading.matching import Grading, GradingRequest, grade
from bayesplate.grading.storage import Journal, require_table_kind, write_table
from bayesplate.results.contract import json_text
from bayesplate.results.folder import OutputFolder, run_of_its_own

JOURNAL = "boards.jsonl"
BATCH = "batch.json"


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


@run_of_its_own()
@checked()
def batch(
    source: Annotated[FilePath, ANY_PATH],
    out: OutOfBatch,
    *,
    template: Template = None,
    workers: NumberOfWorkers = None,
    dask: Dask = None,
    folders: Folders = False,
    table: Table = "csv",
    grading: GradingOptions = None,
    seed: Seed = 1,
    effects: Effects = None,
    law: Law = None,
    robust: Robust = False,
    report: Report = True,
    force: Force = False,
    resume: Resume = False,
    progress: OnProgress = None,
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
    require_table_kind(table)
    boards = boards_of(source, template)
    folder = OutputFolder(Path(out))
    _require_usable(folder, force=force, resume=resume)
    by = processes(workers or os.cpu_count() or 1) if dask is None else dask_cluster(dask)
    folder.open(resume=resume)
    request = FitRequest(seed, None if effects is None else tuple(effects), law, robust)
    run = Run(boards, request, folder.path, folders, report)
    journal = Journal(folder.path / JOURNAL)
    try:
        with _interruptions_told():
            places = run.fitted(by, journal, progress)
        aside, versions = tuple(boards.aside), run.versions
        rows = told_rows(journal.rows(places), boards.place)
        del boards, run  # where the cards of very many boards stand is not needed any more
        written = write_table(folder.path, table, rows)
        graded = grade(rows, grading or GradingRequest())
        summary = _summary(rows, seed, versions, aside)
        journal.keep(dict.fromkeys(places))
    finally:
        journal.close()
    write_text(folder.path / BATCH, json_text(summary))
    _write_grading(folder.path, graded, summary, folders=folders and report, report=report)
    folder.close()
    return BatchResult(folder.path, written, summary, graded)


def _write_grading(folder: Path, graded: Grading, summary: BatchSummary, *, folders: bool, report: bool) -> None:
    from bayesplate.grading.tables import write_grading

    write_grading(folder, graded)
    if report:
        from bayesplate.report.grading import write_grading_page

        write_grading_page(folder, graded, summary, has_pages=folders)


def _require_usable(folder: OutputFolder, *, force: bool, resume: bool) -> None:
    if not resume:
        folder.require_usable(force=force, resume=False)
    elif not os.path.isfile(folder.path / JOURNAL):
        raise CheckpointError(f"{folder.path}: wanted the {JOURNAL} of an earlier run, got none (--force runs it anew)")


@contextmanager
def _interruptions_told() -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt:
        raise RunInterrupted("interrupted; --resume goes on with the boards that are left") from None


def _summary(rows: Iterable[BoardRow], seed: int, versions: Mapping[str, str], aside: tuple[str, ...]) -> BatchSummary:
    failures, doubts, n, n_fitted = [], [], 0, 0
    for row in rows:
        n += 1
        n_fitted += row.is_fitted
        if not row.is_fitted:
            failures.append(Failure(row.name, row.outcome, row.message))
        if row.doubt:
            doubts.append(Doubt(row.name, row.doubt))
    return BatchSummary(FORMAT, seed, versions, n, n_fitted, n - n_fitted, tuple(failures), tuple(doubts), aside)
