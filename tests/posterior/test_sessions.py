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
    """A clamp that covers more has the same matrices with other weights; one that may be softer leaves the region."""
    monday, tuesday, _ = SESSIONS
    covered = board_of(ritz.FINNISH, [monday, replace(tuesday, clamped={"x0": Quantity.exact(0.004)})])
    pose(covered, load_prior("spruce"))
    assert set(solved) == {"monday", "tuesday"}

    solved.clear()
    soft = declare(replace(board_of(ritz.FINNISH, [monday, tuesday]), effects=("clamp_rotation",)))
    own = next(one for one in soft.parameters if one.owner.name == "tuesday" and one.is_of_effect)
    pose(soft.with_parameters([replace(own, prior=replace(own.prior, sd=3.0 * own.prior.sd))]), load_prior("spruce"))
    assert set(solved) == {"monday", "tuesday"}


def test_sessions_with_a_size_of_their_own_each_are_solved_once(solved):
    """The law of one with the sizes of the other: each answers to its own alone."""
    monday, tuesday, _ = SESSIONS
    soft = declare(replace(board_of(ritz.FINNISH, [monday, tuesday]), effects=("clamp_rotation",)))
    problem = pose(soft, load_prior("spruce"))

    assert set(solved) == {"monday"}
    sizes = [one.name for one in problem.parameters.uncertain if one.is_of_effect]
    values = problem.parameters.values(problem.centre[None, :])
    first, second = problem.posterior.models
    for own, model in zip(sizes, (first, second), strict=True):
        changed = {**values, own: values[own] + 1e-3}
        log = model.every_log_frequency(values, "exact")[0]
        assert np.all(model.every_log_frequency(changed, "exact")[0] < log)
        other = second if model is first else first
        np.testing.assert_array_equal(
            other.every_log_frequency(changed, "exact"), other.every_log_frequency(values, "exact")
        )
    both = {**values, sizes[0]: values[sizes[0]] + 1e-3, sizes[1]: values[sizes[0]] + 1e-3}
    order = [first.every_beams.index(beams) for beams in second.every_beams]
    np.testing.assert_allclose(
        second.every_log_frequency(both, "exact")[0], first.every_log_frequency(both, "exact")[0][order], rtol=1e-12
    )
