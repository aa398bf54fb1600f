"""What every test file leaves behind is let go."""

from __future__ import annotations

import sys

import pytest


@pytest.fixture(scope="module", autouse=True)
def fine_plates_let_go():
    """The generator keeps the matrices of its polynomials, tens of megabytes each: not beyond a file of tests."""
    yield
    plates = sys.modules.get("generator.plate")
    if plates is not None:
        plates._basis.cache_clear()
