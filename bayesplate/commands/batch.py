"""`batch`: the boards of a folder or a table to one table of their constants, on all cores or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, get_args

import click

from bayesplate.board.values import Key
from bayesplate.board.words import quote_text
from bayesplate.commands.arguments import (
    check_arguments,
    integer_reader,
    optional_reader,
    read_bool,
    read_path,
    refusal_of,
)
from bayesplate.commands.batch_boards import list_boards
from bayesplate.commands.batch_grading import grading_request, read_grading
from bayesplate.commands.batch_run import BatchRun
from bayesplate.commands.fit_board import FitRequest
from bayesplate.commands.options import (
    ANY_PATH,
    Effects,
    FilePath,
    Force,
    Law,
    OnProgress,
    Option,
    OptionGroup,
    Report,
    Resume,
    Robust,
    Seed,
    path_option,
)
from bayesplate.commands.printout import Printout, show_batch
from bayesplate.commands.workers import dask_cluster, worker_processes
from bayesplate.errors import BatchError, CheckpointError, RunInterrupted
from bayesplate.files import write_text
from bayesplate.grading.boards import FORMAT, BatchSummary, BoardRow, DoubtfulBoard, FailedBoard, mark_copied_readings
from bayesplate.grading.matching import Grading, GradingRequest, grade
from bayesplate.grading.storage import Journal, TableKind, parquet_library, write_table
from bayesplate.results.contract import json_text
from bayesplate.results.folder import GRADING_PAGE, OutputFolder, hold_output_folders
from bayesplate.results.summary import versions

JOURNAL_FILE = "boards.jsonl"
BATCH_FILE = "batch.json"


def default_batch_folder(source: str | os.PathLike[str]) -> Path:
    """Default folder of a batch on the command line: results/NAME, of the folder or the table."""
    path = Path(source).resolve()
    return Path("results") / ((path.name if os.path.isdir(path) else path.stem) or "batch")


def _read_table_format(value: object) -> object:
    if value not in get_args(TableKind):
        raise refusal_of(" or ".join(map(quote_text, get_args(TableKind))), value)
    return value


BatchOut = Annotated[
    FilePath,
    ANY_PATH,
    path_option("--out", otherwise=default_batch_folder, help="Output folder (default results/NAME)."),
]
Template = Annotated[
    FilePath | None,
    Key(optional_reader(read_path)),
    Option("--template", metavar="CARD", help="With a table: the card of what is common to its boards."),
]
NumberOfWorkers = Annotated[
    int | None,
    Key(optional_reader(integer_reader(1))),
    Option("--workers", type=click.IntRange(1), help="Processes (default: one for each core)."),
]
Dask = Annotated[
    str | None,
    Key(optional_reader(read_path)),
    Option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster that computes in their place."),
]
Folders = Annotated[
    bool,
    Key(read_bool),
    Option("--folders", is_flag=True, help="Write the files of fit for each board too, into boards/NAME."),
]
TableFormat = Annotated[
    TableKind,
    Key(_read_table_format),
    Option("--table", type=click.Choice(get_args(TableKind)), show_default=True),
]
GradingOptions = Annotated[
    GradingRequest | None,
    Key(read_grading),
    OptionGroup(
        grading_request,
        match=Option("--match", metavar="PERCENT", help="Boards match within this: 10 (default), or E_x=10,E_y=15."),
        limit=Option(
            "--limit",
            multiple=True,
            metavar="NAME=LEAST:GREATEST",
            help="A specification, moduli in GPa, density in kg/m3: E_x=10:14, density=:420.",
        ),
        rigidity=Option(
            "--rigidity", type=float, metavar="N_M", help="D_x in N m for which each board's thickness is wanted."
        ),
    ),
]


@dataclass(frozen=True, eq=False, repr=False)
class BatchResult:
    """Result of `batch`.

    Attributes
    ----------
    folder : Path
    table : Path
        boards.csv or boards.parquet, a row for each board in the order of their names.
    summary : BatchSummary
        What batch.json holds: how many boards were fitted, and why the others were not.
    grading : Grading
        Matches, limits and thicknesses of the boards that were fitted.
    """

    folder: Path
    table: Path
    summary: BatchSummary
    grading: Grading

    def require_all(self) -> None:
        """Raise BatchError where a board was not fitted."""
        if self.summary.n_failed:
            raise BatchError(self.summary.failures_text(self.table.name))

    def printout(self) -> Printout:
        """Tables and sentences for a person."""
        return show_batch(self.summary, self.grading)

    def __repr__(self) -> str:
        return f"<BatchResult: {self.summary.n_fitted} of {self.summary.n_boards} boards fitted, {self.table}>"


@hold_output_folders()
@check_arguments()
def batch(
    source: Annotated[FilePath, ANY_PATH],
    out: BatchOut,
    *,
    template: Template = None,
    workers: NumberOfWorkers = None,
    dask: Dask = None,
    folders: Folders = False,
    table: TableFormat = "csv",
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
        Called as boards are done.

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
    if table == "parquet":
        parquet_library("--table parquet")
    boards, other_cards = list_boards(source, template)
    folder = OutputFolder(Path(out))
    if not resume:
        folder.require_usable(force=force, resume=False)
    elif not os.path.isfile(folder.path / JOURNAL_FILE):
        raise CheckpointError(
            f"{folder.path}: wanted the {JOURNAL_FILE} of an earlier run, got none (--force runs it anew)"
        )
    request = FitRequest(seed, None if effects is None else tuple(effects), law, robust)
    n_processes = min(workers or os.cpu_count() or 1, len(boards))
    with worker_processes(n_processes) if dask is None else dask_cluster(dask) as executors:
        folder.open(resume=resume)
        journal = Journal(folder.path / JOURNAL_FILE)
        try:
            keys = BatchRun(boards, request, folder.path, folders, report, journal).fitted(executors, progress)
        except KeyboardInterrupt:
            raise RunInterrupted("interrupted; --resume goes on with the boards that are left") from None
        finally:
            journal.close()
    rows = [journal.rows[key] for key in keys]
    rows = mark_copied_readings(
        [
            row if row.is_fitted or not board.place else replace(row, message=f"{board.place} -> {row.message}")
            for row, board in zip(rows, boards, strict=True)
        ]
    )
    table_path = write_table(folder.path, table, rows)
    board_grading = grade(rows, grading or GradingRequest())
    summary = _summary(rows, seed, other_cards)
    journal.keep(dict.fromkeys(keys))
    write_text(folder.path / BATCH_FILE, json_text(summary))
    _write_grading(folder.path, board_grading, summary, folders=folders and report, report=report)
    folder.close()
    return BatchResult(folder.path, table_path, summary, board_grading)


def _summary(rows: Sequence[BoardRow], seed: int, other_cards: tuple[str, ...]) -> BatchSummary:
    failures = tuple(FailedBoard(row.name, row.outcome, row.message) for row in rows if not row.is_fitted)
    doubts = tuple(DoubtfulBoard(row.name, row.doubt) for row in rows if row.doubt)
    n_fitted = len(rows) - len(failures)
    return BatchSummary(FORMAT, seed, versions(), len(rows), n_fitted, len(failures), failures, doubts, other_cards)


def _write_grading(folder: Path, grading: Grading, summary: BatchSummary, *, folders: bool, report: bool) -> None:
    from bayesplate.grading.tables import write_grading

    write_grading(folder, grading)
    (folder / GRADING_PAGE).unlink(missing_ok=True)  # that of another grading
    if report:
        from bayesplate.report.grading import write_grading_page

        write_grading_page(folder, grading, summary, has_pages=folders)
