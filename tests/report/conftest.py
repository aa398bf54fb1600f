"""One quick fit whose report the tests look at."""

from __future__ import annotations

from pathlib import Path

import pytest
from made_reports import Fit, fitted


@pytest.fixture(scope="session")
def clamped() -> Fit:
    """The paper's clamped board."""
    return fitted("fiemme-spruce-clamped")


@pytest.fixture(scope="session")
def clamped_folder(clamped: Fit, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What its report leaves."""
    return clamped.write(tmp_path_factory.mktemp("report") / "out").parent
