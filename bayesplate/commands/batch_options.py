"""Arguments of `batch` alone, each with its reader and the option of the command line that gives it."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated, get_args

import click

from bayesplate.board.values import Key
from bayesplate.board.words import quoted
from bayesplate.commands.arguments import or_none, read_path, read_switch, refused, whole
from bayesplate.commands.batch_grading import grading_request, read_grading
from bayesplate.commands.options import ANY_PATH, FilePath, Joined, Option, path_option
from bayesplate.grading.matching import GradingRequest
from bayesplate.grading.storage import TableKind


def default_batch_folder(source: str | os.PathLike[str]) -> Path:
    """Where the command line writes a batch unless it is told: results/NAME, of the folder or the table."""
    path = Path(source).resolve()
    return Path("results") / ((path.name if os.path.isdir(path) else path.stem) or "batch")


def _read_kind(value: object) -> object:
    if value not in get_args(TableKind):
        raise refused(" or ".join(map(quoted, get_args(TableKind))), value)
    return value


OutOfBatch = Annotated[
    FilePath,
    ANY_PATH,
    path_option("--out", otherwise=default_batch_folder, help="Output folder (default results/NAME)."),
]
Template = Annotated[
    FilePath | None,
    Key(or_none(read_path)),
    Option("--template", metavar="CARD", help="With a table: the card of what is common to its boards."),
]
NumberOfWorkers = Annotated[
    int | None,
    Key(or_none(whole(1))),
    Option("--workers", type=click.IntRange(1), help="Processes (default: one for each core)."),
]
Dask = Annotated[
    str | None,
    Key(or_none(read_path)),
    Option("--dask", metavar="ADDRESS", help="Scheduler of a Dask cluster that computes in their place."),
]
Folders = Annotated[
    bool,
    Key(read_switch),
    Option("--folders", is_flag=True, help="Write the files of fit for each board too, into boards/NAME."),
]
Table = Annotated[
    TableKind,
    Key(_read_kind),
    Option("--table", type=click.Choice(get_args(TableKind)), show_default=True),
]
GradingOptions = Annotated[
    GradingRequest | None,
    Key(read_grading),
    Joined(
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
