"""Runs of the command line that are killed just before the n-th thing that they do to their folder.

Between two such things nothing on the disk changes: whoever kills a run at each of them has seen every state in which a
kill can leave the folder, but for how much of a file is written: one that is opened anew is left empty, and the line of
the journal of a batch, which is written in place, is left half.

    python tests/killed_runs.py FOLDER MOMENT COMMAND ARGUMENTS   MOMENT 0: nothing is killed, the number is printed
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

CHANGES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.truncate"}
WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT
TRIED = ("transverse_shear", "clamp_rotation")
"""Effects that a diagnosis tries here: two, for the time that a test may take."""


SAMPLING = ("compare", "fitting", "campaign_fit")
"""Modules of the command that sample."""


def quickly() -> None:
    """A sampler whose first judgement passes and that saves every chunk, and a search among two candidates."""
    from runs import LOOSE_GATE

    from bayesplate.commands import diagnose
    from bayesplate.diagnosis.joint import full_search
    from bayesplate.posterior import checkpoint
    from bayesplate.posterior.sampling import SamplerSettings

    checkpoint.EVERY_SECONDS = checkpoint._LEAST_PAUSE = 0.0
    for name in SAMPLING:
        command = import_module(f"bayesplate.commands.{name}")
        command.SamplerSettings = partial(SamplerSettings, gate=LOOSE_GATE)  # type: ignore[attr-defined]
    diagnose.full_search = partial(full_search, effects=TRIED)  # type: ignore[assignment]


class Moments:
    """Counts what is done to a folder, and ends this process at one moment."""

    def __init__(self, folder: Path, last: int) -> None:
        self.inside = str(folder)
        self.last = last
        self.count = 0

    def reached(self) -> bool:
        """Count one; whether it is the last."""
        self.count += 1
        return self.count == self.last

    def heard(self, event: str, arguments: tuple[Any, ...]) -> None:
        """What the interpreter tells of each call to the system."""
        is_change = event in CHANGES or (event == "open" and isinstance(arguments[2], int) and arguments[2] & WRITES)
        is_nothing = event == "os.remove" and os.path.isabs(arguments[0]) and not os.path.lexists(arguments[0])
        is_file = is_change and not isinstance(arguments[0], int)  # which a pipe to a worker is
        if is_file and not is_nothing and self.is_inside(str(arguments[0])) and self.reached():
            if event == "open" and arguments[2] & os.O_TRUNC:
                os.close(os.open(arguments[0], arguments[2]))  # the file is there, and nothing in it yet
            end()

    def is_inside(self, path: str) -> bool:
        """Whether a path lies in the folder; where a whole folder is removed, the system is told names alone."""
        return path.startswith(self.inside) or not os.path.isabs(path)

    def watch_journal(self) -> None:
        """Count the lines of a batch's journal, and end in the middle of one."""
        from bayesplate.grading import storage

        whole = storage.Journal.append

        def append(journal: Any, key: str, row: Any) -> None:
            if self.reached():
                line = storage._journal_line(key, row)
                journal._stream.write(line[: len(line) * self.last // 7 % len(line)])
                end()
            whole(journal, key, row)

        storage.Journal.append = append  # type: ignore[method-assign]


def end() -> None:
    """As if the power went off."""
    os.kill(os.getpid(), signal.SIGKILL)


def main(folder: str, moment: str, *arguments: str) -> None:
    """Run the command line in this process."""
    from bayesplate.cli import main as command_line

    quickly()
    moments = Moments(Path(folder), int(moment))
    moments.watch_journal()
    sys.addaudithook(moments.heard)
    try:
        command_line([*arguments, "--out", folder])
    finally:
        print(moments.count)


def killed(folder: Path, moment: int, *arguments: str) -> int:
    """Start a run in a process of its own and let it die; the exit code, or for moment 0 how many moments there are."""
    program = [sys.executable, __file__, str(folder), str(moment), *arguments]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    done = subprocess.run(program, env=environment, capture_output=True, text=True, check=False)
    if moment == 0:
        assert done.returncode in (0, 7), done.stderr
        return int(done.stdout.splitlines()[-1])
    return done.returncode


if __name__ == "__main__":
    main(*sys.argv[1:])
