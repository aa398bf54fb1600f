"""Many fits side by side, against one at a time by scipy's least squares with tolerances next to rounding."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import optimize

from bayesplate.estimates import side_by_side
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.refit import Bounds, deviance_misfit, most_likely, normal_misfit
from bayesplate.estimates.side_by_side import curvatures, most_likely_of_each
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import pose
from bayesplate.workflow.prepare import prepare

N_MODES, N_FREE, SD = 9, 5, 0.1
LEFT_OUT = [(), (0,), (3,), (2, 7), (8,)]
OPEN = Bounds(np.full(N_FREE, -np.inf), np.full(N_FREE, np.inf))


@pytest.fixture
def curved():
    """A law of three constants and two inputs whose slopes change by their own size in a unit, and readings off it."""
    rng = np.random.default_rng(5)
    slopes = rng.uniform(-0.5, 0.5, (N_MODES, N_FREE))
    bent = rng.uniform(-0.5, 0.5, (N_MODES, N_FREE, N_FREE))
    bent = bent + np.swapaxes(bent, 1, 2)

    def predict(x):
        return 5.0 + x @ slopes.T + 0.5 * np.einsum("ni,kij,nj->nk", x, bent, x) + 0.1 * np.sin(x @ slopes.T)

    return predict, slopes, bent, 5.0 + SD * rng.normal(size=N_MODES)


def one_at_a_time(predict, misfit, start, left_out):
    """The same by scipy, slopes by its own differences."""

    def residuals(x):
        return np.concatenate([np.delete(misfit(predict(x[None])[0])[0], left_out), x[3:]])

    return optimize.least_squares(residuals, start, "3-point", method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15).x


@pytest.mark.parametrize("error", ["normal", "rounded", "student"])
def test_each_is_where_it_is_alone_after_a_few_steps(curved, error, monkeypatch):
    """No fit is left to scipy, and the law is asked a few times for all of them."""
    predict, _, _, target = curved
    step, robust = (2.0 if error == "rounded" else 0.0), error == "student"
    misfit = normal_misfit(target, np.full(N_MODES, SD))
    if error != "normal":
        errors = ReadingErrors(np.exp(target), np.zeros(N_MODES), np.full(N_MODES, step), robust)
        misfit = deviance_misfit([errors], [SD])
    calls = []

    def counted(x):
        calls.append(len(x))
        return predict(x)

    monkeypatch.setattr(side_by_side, "most_likely", None)  # whoever calls it fails
    starts = np.full((len(LEFT_OUT), N_FREE), 0.02)
    found = most_likely_of_each(counted, misfit, starts, LEFT_OUT)
    assert len(calls) <= (26 if robust else 16)
    for one, start, left_out in zip(found, starts, LEFT_OUT, strict=True):
        assert one == pytest.approx(one_at_a_time(predict, misfit, start, left_out), abs=1e-6)
    assert np.abs(found[1:] - found[0]).max(axis=1).min() > 1e-3  # control: what is left out matters


def test_curvatures_are_second_derivatives(curved):
    predict, slopes, bent, _ = curved
    x = np.array([[0.1, -0.2, 0.0, 0.3, 0.2], [0.0, 0.0, 0.0, 0.0, 0.0]])
    sine = -0.1 * np.einsum("nk,ki,kj->nkij", np.sin(x @ slopes.T), slopes, slopes)
    assert curvatures(predict, x) == pytest.approx(bent + sine, abs=5e-4)
    assert np.abs(sine[0]).max() > 0.005  # control
    holed = curvatures(lambda y: np.where(y[:, :1] > 0.0, predict(y), np.nan), x)
    assert not holed[1].any()
    assert holed[0] == pytest.approx((bent + sine)[0], abs=1e-3)


def test_a_fit_that_does_not_settle_is_left_to_scipy(curved, monkeypatch):
    """Where the law has a kink that the fit lies on there is no curvature; the fit beside it goes its own way."""
    _, slopes, _, target = curved

    def kinked(x):
        return 5.0 + x @ slopes.T + np.abs(x[:, :1])

    asked = []

    def noted(*problem):
        asked.append(problem[-1])
        return most_likely(*problem)

    monkeypatch.setattr(side_by_side, "most_likely", noted)
    misfit = normal_misfit(target, np.full(N_MODES, SD))
    starts = np.full((2, N_FREE), 0.3)
    found = most_likely_of_each(kinked, misfit, starts, [(2,), (5,)])
    assert asked == [(2,)]
    assert np.array_equal(found[0], most_likely(kinked, misfit, starts[0], None, [2]))
    assert abs(found[0, 0]) < 1e-3
    assert found[1] == pytest.approx(one_at_a_time(kinked, misfit, starts[1], [5]), abs=1e-6)


def test_bounds_hold(curved):
    predict, _, _, target = curved
    misfit = normal_misfit(target, np.full(N_MODES, SD))
    start = np.zeros((1, N_FREE))
    (free,) = most_likely_of_each(predict, misfit, start, [()], OPEN)
    column = int(np.argmax(np.abs(free)))
    reach = 0.5 * abs(free[column])
    upper = OPEN.upper.copy()
    upper[column], lower = reach, -upper
    lower[column] = -reach
    (found,) = most_likely_of_each(predict, misfit, start, [()], Bounds(lower, upper))
    assert abs(found[column]) == pytest.approx(reach, rel=1e-3)


def test_the_paper_s_board_under_the_exact_law():
    prepared = prepare("fiemme-spruce-clamped")
    problem = pose(prepared.board, prepared.prior)
    predict = predictor(prepared.board, problem.posterior.models, "exact", problem.centre)
    target = log_measured(prepared.board)
    misfit = normal_misfit(target, weighted_least_squares(prepared.board).scales)
    left_out = [(i,) for i in range(target.size)]
    starts = np.repeat(problem.centre[None, problem.parameters.fitted_columns], target.size, axis=0)
    found = most_likely_of_each(predict, misfit, starts, left_out)
    alone = [one_at_a_time(predict, misfit, start, one) for start, one in zip(starts, left_out, strict=True)]
    assert predict(found) == pytest.approx(predict(np.stack(alone)), abs=1e-8)
