"""One error tree; every message says where, what was wanted, what came, and what to do.

BayesplateError            anything a user can meet; carries the exit code
├── InputError             3   a card, a file or an option value that cannot be used (also a ValueError)
│   └── UnwritableError    3   a file that cannot be written: a full disk, a folder of somebody else's
├── NotIdentifiableError   4   the data cannot tell a constant, or contradict a prior
├── NotConvergedError      5   the sampler did not pass its gate
├── CheckpointError        6   a checkpoint that cannot be resumed
└── BatchError             7   some boards of a batch failed

RunInterrupted           130   a KeyboardInterrupt that says whether the run can be continued
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


def printable(text: str) -> str:
    """A text whose unprintable characters are written as escapes, so that it cannot steer a terminal."""
    return "".join(
        character if character.isprintable() else character.encode("unicode_escape").decode() for character in text
    )


@dataclass(frozen=True)
class Fault:
    """A fault of an input; unprintable characters in it are written as escapes.

    Attributes
    ----------
    place : str
        Where: file, section and key ("my-board.toml [plate] thickness_mm").
    wanted : str
        What would have been accepted.
    got : str
        What was found.
    remedy : str
        What to do; empty where `wanted` says it already.
    """

    place: str
    wanted: str
    got: str
    remedy: str = ""

    def __post_init__(self) -> None:
        """Escape unprintable characters, which names of files and messages of libraries may hold."""
        for name in ("place", "wanted", "got", "remedy"):
            object.__setattr__(self, name, printable(getattr(self, name)))

    def __str__(self) -> str:
        text = f"{self.place}: wanted {self.wanted}, got {self.got}"
        return f"{text} ({self.remedy})" if self.remedy else text


class BayesplateError(Exception):
    """Anything that a user can meet and mend; `exit_code` is what the command line returns."""

    exit_code = 70

    def __init__(self, faults: str | Fault | Iterable[Fault]) -> None:
        if isinstance(faults, str):
            self.faults: tuple[Fault, ...] = ()
            message = faults
        else:
            self.faults = (faults,) if isinstance(faults, Fault) else tuple(faults)
            message = "\n".join(str(fault) for fault in self.faults)
        super().__init__(message)


class InputError(BayesplateError, ValueError):
    """A card, a file or an option value that cannot be used; lists every fault at once."""

    exit_code = 3


class UnwritableError(InputError):
    """A file that cannot be written; names it and the reason."""


class NotIdentifiableError(BayesplateError):
    """The data cannot tell a constant, or contradict a prior; names which and what would help."""

    exit_code = 4


class NotConvergedError(BayesplateError):
    """The sampler did not pass its convergence gate."""

    exit_code = 5


class CheckpointError(BayesplateError):
    """A checkpoint is missing, damaged, or belongs to another run."""

    exit_code = 6


class BatchError(BayesplateError):
    """Some boards of a batch failed; the others are written."""

    exit_code = 7


class RunInterrupted(KeyboardInterrupt):
    """A run that was stopped after its first checkpoint and can be continued."""
