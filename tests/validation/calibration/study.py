"""A study: what is simulated over and over, what its file of records agrees in, what the records say, and its page."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from validation import measured
from validation.calibration.records import Record, add_to, read_done


@dataclass(frozen=True)
class Study:
    """One study.

    Attributes
    ----------
    simulate : callable
        Of the items of a job; a function that another process can import.
    identity : dict
    jobs : list of (key, job)
        A record holds the items of its key.
    judge : callable
        Records to lines and whether all is well.
    """

    simulate: Callable[..., Record]
    identity: Record
    jobs: Sequence[tuple[Record, tuple[Any, ...]]]
    judge: Callable[[Sequence[Record]], tuple[list[str], bool]]

    def run(self, out: Path, workers: int, *, quiet: bool = False) -> list[Record]:
        """Do what is not done yet, and return the records of all jobs in their order."""
        done = read_done(out, self.identity)
        left = [job for key, job in self.jobs if not any(key.items() <= record.items() for record in done)]
        return self._asked_for(done + add_to(out, self.simulate, left, workers, quiet=quiet))

    def done(self, out: Path) -> list[Record]:
        """The records of those jobs that were done before."""
        return self._asked_for(read_done(out, self.identity)) if out.exists() else []

    def _asked_for(self, done: Sequence[Record]) -> list[Record]:
        found = (next((one for one in done if key.items() <= one.items()), None) for key, _ in self.jobs)
        return [one for one in found if one is not None]


def numbered(*before: Any, n: int) -> list[tuple[Record, tuple[Any, ...]]]:
    """Jobs that differ in the number of the simulation alone, which stands behind what all of them have."""
    return [({"simulation": i}, (*before, i)) for i in range(n)]


@dataclass(frozen=True)
class Page:
    """A page of the documentation.

    Attributes
    ----------
    name, title : str
    about : str
        What its lines have to be read with.
    target : str
        Of the Makefile; by default the name of the page.
    """

    name: str
    title: str
    about: str = ""
    target: str = ""

    def write(self, folder: Path, lines: Sequence[str]) -> None:
        """Write lines as they were printed, in a folder that is made if it is not there."""
        folder.mkdir(parents=True, exist_ok=True)
        command = f"make {self.target or self.name}"
        head = [f"# {self.title}", "", f"Written by `{command}`; do not edit.", ""]
        text = [*head, *([self.about, ""] if self.about else []), "```text", *lines, "```", ""]
        (folder / f"{self.name}.md").write_text("\n".join(text), encoding="utf-8")
        measured.note(folder, self.name)


def arguments(description: str | None, n: int, of_what: str, words: str = "") -> argparse.ArgumentParser:
    """The options that every study has: how many, in how many processes, and where records and page go."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(f"--{of_what}", type=int, default=n, dest="n", help=words or f"number of {of_what}")
    parser.add_argument("--workers", type=int, default=2, help="processes; 0: judge what was simulated before")
    parser.add_argument("--out", type=Path, required=True, help="JSON lines; gone on with if it exists")
    parser.add_argument("--publish", type=Path, help="folder of the page")
    return parser


def carry_out(
    study: Study,
    page: Page,
    options: argparse.Namespace,
    beside: Callable[[Sequence[Record], Path], None] = lambda records, folder: None,
) -> int:
    """Run a study as the command line asks, print what came out, and write its page.

    Parameters
    ----------
    study : Study
    page : Page
    options : argparse.Namespace
        Of `arguments`.
    beside : callable
        Draws what stands beside the page, from the records and the folder.

    Returns
    -------
    int
        The exit code: 0 if all is well and every job was done, 1 otherwise.
    """
    records = study.run(options.out, options.workers) if options.workers else study.done(options.out)
    lines, well = study.judge(records) if records else ([], False)
    if len(records) < len(study.jobs):
        lines, well = [*lines, f"not whole: {len(records)} of {len(study.jobs)} were run"], False
    print("\n".join(lines))
    if options.publish is not None:
        page.write(options.publish, lines)
        beside(records, options.publish)
    return 0 if well else 1
