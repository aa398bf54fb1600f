"""What holds for every test: one thread for each process, as users sample, and which tests stay in one process."""

import os
from pathlib import Path

import pytest

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):  # before numpy is imported
    os.environ.setdefault(name, "1")

ROOT = Path(__file__).parent
TOGETHER = ("campaigns",)
"""Folders whose files share what takes long to make."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of one file, or of one folder where files share what takes long, go to one worker."""
    for item in items:
        path = item.path.relative_to(ROOT)
        group = path.parts[0] if path.parts[0] in TOGETHER else str(path)
        item.add_marker(pytest.mark.xdist_group(group))
