"""What holds for every test: one thread for each process, as users sample, and which tests stay in one process."""

import gc
import os
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # before numpy is imported
    os.environ.setdefault(name, "1")


def pytest_collection_finish():
    """What was loaded by now stays: looking for cycles among it again and again takes a twentieth of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000, 20, 50)


TOGETHER = ("tests/campaign",)
"""Folders whose files share what takes long to make."""


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Tests of one file, or of one folder where files share what takes long, go to one worker.

    `--dist loadgroup` with a mark for each test would do, but since pytest 9.2 it ignores the marks (pytest-xdist
    issue 1386).
    """
    if config.getvalue("dist") != "loadfile":
        return None
    from xdist.scheduler import LoadFileScheduling

    class ByFileOrFolder(LoadFileScheduling):
        def _split_scope(self, nodeid):
            file = super()._split_scope(nodeid)
            folder = Path(file).parent.as_posix()
            return folder if folder in TOGETHER else file

    return ByFileOrFolder(config, log)
