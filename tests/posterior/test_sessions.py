"""Sessions that hold a plate alike: solved once, with the frequencies that each has alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import ritz
from made_boards import CANTILEVER_LABELS, board_of, setup_of

from bayesplate.cards import load_prior
from bayesplate.effects import declare
from bayesplate.posterior import laplace
from bayesplate.posterior.inference import pose
from bayesplate.quantities import Quantity

HERTZ = ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS)
SESSIONS = (
    setup_of(ritz.CANTILEVER, HERTZ, name="monday"),
    setup_of(ritz.CANTILEVER, {label: HERTZ[label] for label in CANTILEVER_LABELS[::-1]}, name="tuesday"),
    setup_of(ritz.ALL_FREE, ritz.simulate(replace(ritz.FINNISH, edges=ritz.ALL_FREE), [(1, 1), (2, 0)]), name="free"),
)


@pytest.fixture
def solved(monkeypatch):
    names = []
    made = laplace.with_exact

    def with_exact(model, *arguments):
        names.append(model.setup.name)
        return made(model, *arguments)

    monkeypatch.setattr(laplace, "with_exact", with_exact)
    return names


def frequencies(problem, setup):
    model = problem.posterior.models[setup]
    values = problem.parameters.values(problem.centre[None, :])
    every = model.every_log_frequency(values, "exact")[0]
    return {reading.beams: log for reading, log in zip(model.setup.readings, every, strict=True)}


def test_they_are_solved_once_and_keep_their_own_order(solved):
    problem = pose(board_of(ritz.FINNISH, SESSIONS), load_prior("spruce"))

    assert set(solved) == {"monday", "free"}
    assert frequencies(problem, 0) == frequencies(problem, 1)
    for label, log in frequencies(problem, 1).items():
        assert np.exp(log) == pytest.approx(HERTZ[label], rel=2e-3)


def test_sessions_that_hold_it_otherwise_are_solved_each(solved):
    """A clamp that covers more has the same matrices, with other weights; one that gives way has a size of its own."""
    monday, tuesday, _ = SESSIONS
    covered = board_of(ritz.FINNISH, [monday, replace(tuesday, clamped={"x0": Quantity.exact(0.004)})])
    pose(covered, load_prior("spruce"))
    assert set(solved) == {"monday", "tuesday"}

    solved.clear()
    soft = replace(board_of(ritz.FINNISH, [monday, tuesday]), effects=("clamp_rotation",))
    pose(declare(soft), load_prior("spruce"))
    assert set(solved) == {"monday", "tuesday"}
