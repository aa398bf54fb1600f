"""Relative weighted least squares against a general minimiser, and against constants that are known."""

from __future__ import annotations

from copy import copy
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import ritz
from limits import meets
from made_boards import CANTILEVER_LABELS, FREE_LABELS, board_of, models_at, setup_of, with_noise
from scipy.optimize import least_squares

from bayesplate.board.material import RIGIDITIES, moduli
from bayesplate.board.quantity import Quantity
from bayesplate.commands.prepare import prepare
from bayesplate.estimates import least_squares as estimates
from bayesplate.estimates.least_squares import has_settled, log_measured, reading_scales, weighted_least_squares
from bayesplate.plate.naming import ModePlace
from bayesplate.plate.terms import Parity


def misfits(board, log_rigidities):
    """Weighted residuals with every setup solved anew at these constants."""
    values = board.nominal() | dict(zip(("D_x", "D_y", "D_s"), np.exp(log_rigidities), strict=True))
    models = models_at(board, np.exp(log_rigidities))
    predicted = np.concatenate([model.log_frequencies(values, "linear")[0] for model in models])
    return (predicted - log_measured(board)) / reading_scales(board)


def test_the_estimate_is_where_a_general_minimiser_ends():
    board = prepare("fiemme-spruce-clamped").board
    estimate = weighted_least_squares(board)
    assert estimate.converged
    x = np.log(estimate.rigidities)
    start = x + np.array([0.05, -0.05, 0.05])
    found = least_squares(lambda x: misfits(board, x), start, diff_step=1e-5, method="lm", xtol=1e-9, ftol=1e-12)
    # in standard errors; slopes by differences 1e-5 wide leave the minimiser's gradient uncertain by about as much
    assert np.linalg.norm(found.jac @ (x - found.x)) < 1e-3
    assert np.linalg.norm(found.jac @ (x + np.array([1e-3, 0.0, 0.0]) - found.x)) > 1e-2  # control: 0.1 % would be seen
    # the sensitivities that come with the solve are the slopes of full solves
    slopes = weighted_slopes(estimate)
    assert slopes == pytest.approx(found.jac, abs=1e-3 * np.abs(found.jac).max())


def test_the_constants_of_another_solver_s_board_are_found():
    """Two setups of one board from the independent solver, readings exact: 0.1 cent is 1e-4 of a modulus."""
    free = replace(ritz.FINNISH, edges=ritz.ALL_FREE, L_x=ritz.FINNISH.L_x + 0.03)
    setups = [
        setup_of(ritz.CANTILEVER, ritz.simulate(ritz.FINNISH, CANTILEVER_LABELS), name="held",
                 clamped={"x0": Quantity.exact(0.03)}),
        setup_of(ritz.ALL_FREE, ritz.simulate(free, FREE_LABELS), name="free"),
    ]  # fmt: skip
    estimate = weighted_least_squares(board_of(ritz.FINNISH, setups))
    found = moduli(*estimate.rigidities, ritz.FINNISH.h, ritz.FINNISH.nu_xy)
    assert np.stack(found) == pytest.approx([13.0e9, 0.702e9, 0.668e9], rel=5e-4)
    assert np.abs(estimate.residuals).max() * 1200 / np.log(2) < 0.5


def test_readings_given_twice_leave_the_estimate_and_halve_its_variances():
    board = prepare("fiemme-spruce-clamped").board
    (setup,) = board.setups
    once = weighted_least_squares(board, accepted=1e-12)
    twice = weighted_least_squares(replace(board, setups=(setup, replace(setup, name="again"))), accepted=1e-12)

    sd, less = (np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes))) for slopes in map(weighted_slopes, (once, twice)))
    meets("V13", "readings given twice, standard errors", np.abs(less * np.sqrt(2.0) / sd - 1.0).max(), at_most=1e-10)
    off = np.abs(twice.rigidities / once.rigidities - 1.0).max()
    meets("V13", "readings given twice, constants", off, at_most=1e-10)


def weighted_slopes(estimate):
    return estimate.sensitivities / estimate.scales[:, None]


def test_a_reading_s_own_uncertainty_weighs_it():
    """A reading that is said to be poor is hardly followed."""
    hertz = with_noise(ritz.simulate(ritz.FREE_SPRUCE, FREE_LABELS), 1e-4, np.random.default_rng(1))
    hertz[1, 1] *= 1.05
    poor = hertz | {(1, 1): Quantity.from_mean(hertz[1, 1], 0.05 * hertz[1, 1])}
    truth = np.array([12.0e9, 0.9e9, 0.75e9])
    errors = []
    for readings in (hertz, poor):
        estimate = weighted_least_squares(board_of(ritz.FREE_SPRUCE, [setup_of(ritz.ALL_FREE, readings)]))
        found = np.stack(moduli(*estimate.rigidities, ritz.FREE_SPRUCE.h, ritz.FREE_SPRUCE.nu_xy))
        errors.append(np.abs(found / truth - 1).max())
    assert errors[1] < 0.005 < errors[0]
    # a weight of (0.003 / 0.05)^2 leaves that share of the bias
    assert errors[1] < 0.05 * errors[0] + 1e-3


def test_steps_end_where_they_do_not_count_or_are_rounding():
    settled = [(1e-10, 1e-4), (1e-6, 4e-7), (1e-6, 1e-3)]  # of the last a thousandth remains
    not_yet = [(1e-6, 1.5e-6), (2e-6, 1e-5), (1e-3, 1e-3), (1e-6, np.inf)]  # shrinking slowly; a fifth remains; a swap
    assert [has_settled(*one) for one in (*settled, *not_yet)] == [True] * 3 + [False] * 4


@pytest.mark.parametrize("steps", [1, 40])
def test_an_estimate_is_where_its_models_were_solved_settled_or_not(steps):
    board = prepare("finnish-spruce-cantilever").board
    estimate = weighted_least_squares(board, steps)
    assert estimate.converged == (steps == 40)
    assert [float(estimate.values[name]) for name in ("D_x", "D_y", "D_s")] == estimate.rigidities.tolist()
    (model,) = models_at(board, estimate.rigidities)
    assert estimate.sensitivities == pytest.approx(model.sensitivities(estimate.values), abs=1e-12)
    predicted = model.log_frequencies(estimate.values, "linear")[0]
    # solved again at the same point; one step further would be off by a thousandth and more
    assert estimate.residuals == pytest.approx(log_measured(board) - predicted, abs=1e-12)


class Jumping:
    """A law of one step each but for a jump where D_x passes the start, and for one reading that is worse above it."""

    def __init__(self, board, start):
        self.target, self.start, self.solved = log_measured(board), start, []

    def solve(self, system, values):
        self.solved.append(np.log([float(values[name]) for name in RIGIDITIES]) - self.start)
        model = copy(self)
        model.places = (ModePlace(Parity(0, 0), int(self.solved[-1][0] > 0.0), 1.0),)
        return model

    def log_frequencies(self, values, law):
        x = self.solved[-1]
        off = np.zeros(self.target.size)
        off[:3] = x + np.array([0.03 if x[0] > 0.0 else -0.02, 0.0, 0.0])
        off[3] = 0.1 if x[0] > 0.0 else 0.02
        return self.target + off[None]

    def sensitivities(self, values):
        return np.eye(self.target.size, 3)


def test_steps_that_go_round_end_at_the_best_of_the_round(monkeypatch):
    board = prepare("finnish-spruce-cantilever").board
    law = Jumping(board, np.log([200.0, 10.0, 20.0]))
    monkeypatch.setattr(estimates, "setup_model", law.solve)
    estimate = weighted_least_squares(board, start=np.exp(law.start))

    assert len(law.solved) < 6
    assert not estimate.converged
    assert np.log(estimate.rigidities) - law.start == pytest.approx([-0.03, 0.0, 0.0], abs=1e-12)
    assert estimate.residuals[3] == pytest.approx(-0.02)


class Turning(Jumping):
    """A law whose slopes are half of what a step finds, as next to a veering."""

    def log_frequencies(self, values, law):
        return self.target + np.pad(self.solved[-1], (0, self.target.size - 3))[None]

    def sensitivities(self, values):
        return 0.51 * np.eye(self.target.size, 3)


@pytest.mark.parametrize("names_stay", [True, False])
def test_steps_to_and_fro_are_shortened_while_no_names_are_exchanged(monkeypatch, names_stay):
    """Each step is 1.96 times too long; the secant through two of them knows it. Exchanged names are another matter."""
    board = prepare("finnish-spruce-cantilever").board
    law = Turning(board, np.log([200.0, 10.0, 20.0]))

    def solve(system, values):
        model = law.solve(system, values)
        model.places = () if names_stay else model.places
        return model

    monkeypatch.setattr(estimates, "setup_model", solve)
    estimate = weighted_least_squares(board, start=np.exp(law.start + 0.05))
    assert estimate.converged == names_stay
    assert len(law.solved) < 7
    if names_stay:
        assert np.log(estimate.rigidities) == pytest.approx(law.start, abs=1e-6)


@pytest.mark.parametrize(("factor", "goes_round"), [(-0.8, False), (-1.0, True)])
def test_steps_that_shrink_do_not_go_round(factor, goes_round):
    places = np.cumsum(0.1 * factor ** np.arange(8.0))
    tried = [SimpleNamespace(rigidities=np.exp([place, 0.0, 0.0])) for place in places]
    found = [bool(estimates._find_cycle(tried[:n])) for n in range(1, 9)]
    assert found == [goes_round and n > 2 for n in range(1, 9)]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spruce-free-1R", "spruce-free-3L"])
def test_boards_with_profiles_and_shear_settle_where_no_direction_lowers_the_misfit(name):
    """Their eigen-solves carry half the digits; a step of 1e-5 is a hundredth of a cent."""
    board = prepare(name, ["transverse_shear", "thickness_profile", "outline_profile"]).board
    estimate = weighted_least_squares(board)
    assert estimate.converged
    weighted, misfit = estimate.sensitivities / estimate.scales[:, None], estimate.residuals / estimate.scales
    assert np.abs(np.linalg.lstsq(weighted, misfit, rcond=1e-8)[0]).max() < 1e-4
    moved = misfit + weighted @ [1e-3, 0.0, 0.0]  # control: a thousandth of D_x would be seen
    assert np.abs(np.linalg.lstsq(weighted, moved, rcond=1e-8)[0]).max() > 5e-4
