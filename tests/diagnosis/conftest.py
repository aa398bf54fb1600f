"""Search grounds of measured boards that the tests share: each is prepared once a session."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import pytest

from bayesplate.commands.diagnose import DiagnoseResult, diagnose
from bayesplate.commands.problem import Problem
from bayesplate.diagnosis.baseline import baseline_of
from bayesplate.diagnosis.search import SearchGround, prepare_search
from bayesplate.posterior.posing import PosedProblem

N_NULL = 100
"""Data sets of the null control: enough for its files and rules, fewer than a diagnosis that is to be published."""


@dataclass(frozen=True, eq=False)
class Grounded:
    """A board's problem and the ground of its search."""

    problem: PosedProblem
    ground: SearchGround


def grounded(name: str, tried: Sequence[str] | None = None) -> Grounded:
    problem = Problem.from_card(name).posed
    return Grounded(problem, prepare_search(baseline_of(problem), effects=tried))


@pytest.fixture(scope="session")
def finnish() -> Grounded:
    """The paper's cantilever board: rounded readings, exact inputs, one candidate pair."""
    return grounded("finnish-spruce-cantilever")


@pytest.fixture(scope="session")
def finnish_few() -> Grounded:
    """The same board with a few candidates: another theory, springs, projected terms, fields."""
    return grounded(
        "finnish-spruce-cantilever", ("transverse_shear", "clamp_translation", "fluid_loading", "thickness_profile")
    )


@pytest.fixture(scope="session")
def diagnosed() -> Callable[[str], DiagnoseResult]:
    """The whole of `diagnose` on a shipped board, once each, without files."""

    @cache
    def run(name: str) -> DiagnoseResult:
        return diagnose(name, n_null=N_NULL)

    return run
