"""Fits that several tests look at; each takes seconds, so each is made once."""

from __future__ import annotations

import pytest

from bayesplate.commands.fit import fit


@pytest.fixture(scope="session")
def finnish():
    """The paper's cantilever board under the default prior."""
    return fit("finnish-spruce-cantilever", seed=1)


@pytest.fixture(scope="session")
def fiemme():
    """The paper's clamped board under the default prior."""
    return fit("fiemme-spruce-clamped", seed=1)
