"""A mode left out: by refitting, and by the closed form that holds where residuals are small."""

from __future__ import annotations

import numpy as np
import pytest

from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.leave_one_out import prediction_errors
from bayesplate.estimates.refit import design, refit
from bayesplate.posterior.inference import pose
from bayesplate.posterior.region import predictor
from bayesplate.workflow.prepare import prepare

N_MODES = 7


@pytest.fixture
def problem():
    """Slopes, scales and data of a linear problem: three constants and one input with a prior."""
    rng = np.random.default_rng(3)
    slopes = rng.uniform(-0.5, 0.5, (N_MODES, 4))
    return slopes, rng.uniform(0.002, 0.01, N_MODES), 5.0 + 0.01 * rng.normal(size=N_MODES)


def closed_form(slopes, scales, target, constant):
    """In-sample residuals r, leverages h, and r / (1 - h); the input's prior is one more observation."""
    weighted = np.concatenate([slopes / scales[:, None], np.eye(4)[3:]])
    data = np.concatenate([(target - constant) / scales, [0.0]])
    hat = weighted @ np.linalg.inv(weighted.T @ weighted) @ weighted.T
    residuals = (data - hat @ data)[: target.size] * scales
    leverages = np.diagonal(hat)[: target.size]
    return residuals, leverages, residuals / (1 - leverages)


def test_a_linear_problem_has_the_closed_form(problem):
    slopes, scales, target = problem
    found = prediction_errors(lambda x: 5.0 + x @ slopes.T, target, scales, np.zeros(4))
    in_sample, leverages, left_out = closed_form(slopes, scales, target, 5.0)
    assert found.in_sample == pytest.approx(in_sample, abs=1e-9)
    assert found.left_out == pytest.approx(left_out, abs=1e-9)
    # controls: neither the fit that has seen the mode, nor the leverages of other modes, give this
    assert np.abs(found.left_out - in_sample).max() > 1e-4
    assert np.abs(found.left_out - in_sample / (1 - np.roll(leverages, 1))).max() > 1e-4


def test_a_curved_problem_approaches_the_closed_form_as_the_residuals_shrink(problem):
    """The difference is of second order: a tenth of the residuals, a hundredth of the difference."""
    slopes, scales, target = problem

    def curved(x):
        linear = x @ slopes.T
        return 5.0 + linear + 2.0 * linear**2

    apart = []
    for size in (1.0, 0.1):
        data = 5.0 + size * (target - 5.0)
        fitted = refit(curved, data, scales, np.zeros(4))
        weighted = design(curved, scales, fitted)
        hat = weighted @ np.linalg.inv(weighted.T @ weighted) @ weighted.T
        found = prediction_errors(curved, data, scales, np.zeros(4))
        expected = found.in_sample / (1 - np.diagonal(hat)[:N_MODES])
        apart.append(np.abs(found.left_out - expected).max())
    assert apart[1] == pytest.approx(apart[0] / 100, rel=0.5)


def test_the_paper_s_board_under_the_exact_law():
    """Readings moved towards the fit until the residuals are a thousandth: then the closed form holds there too."""
    prepared = prepare("fiemme-spruce-clamped")
    problem = pose(prepared.board, prepared.prior)
    predict = predictor(prepared.board, problem.posterior.models, "exact", problem.centre)
    columns = problem.parameters.fitted_columns
    estimate = weighted_least_squares(prepared.board)
    small = log_measured(prepared.board) - 0.999 * estimate.residuals
    found = prediction_errors(predict, small, estimate.scales, problem.centre[columns])
    leverages = problem.identifiability.leverages
    expected = found.in_sample / (1 - leverages)
    assert found.left_out == pytest.approx(expected, abs=0.01 * np.abs(expected).max())
    assert np.abs(found.left_out - found.in_sample).max() > 0.5 * np.abs(expected).max()  # control


def test_three_modes_leave_nothing_out(problem):
    slopes, scales, target = problem
    found = prediction_errors(lambda x: 5.0 + x @ slopes[:3].T, target[:3], scales[:3], np.zeros(4))
    assert np.isnan(found.left_out).all()
    assert np.isfinite(found.in_sample).all()


def test_an_input_stays_within_its_prior(problem):
    """Poor data leave it at the prior's middle, precise ones take it where they alone would lead."""
    slopes, scales, target = problem
    moved = [abs(refit(lambda x: 5.0 + x @ slopes.T, target, scales * s, np.zeros(4))[3]) for s in (1e4, 1e2, 1.0)]
    free = abs(np.linalg.lstsq(slopes / scales[:, None], (target - 5.0) / scales, rcond=None)[0][3])
    assert moved[0] < moved[1] < moved[2]
    assert moved[0] < 0.1 * free
    assert moved[2] == pytest.approx(free, rel=0.01)
