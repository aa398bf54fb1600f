"""A mode left out: by refitting, and by the closed form that holds where residuals are small."""

from __future__ import annotations

import numpy as np
import pytest
from bars import meets
from scipy import optimize, stats

from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.leave_one_out import prediction_errors
from bayesplate.estimates.refit import design, deviance_misfit, most_likely, normal_misfit, refit
from bayesplate.plate.densities import DEGREES_OF_FREEDOM
from bayesplate.plate.readings import ReadingErrors
from bayesplate.posterior.inference import pose
from bayesplate.posterior.laplace import predictor
from bayesplate.workflow.prepare import prepare

N_MODES = 7
ORIGIN = np.zeros((1, 4))


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
    found = prediction_errors(lambda x: 5.0 + x @ slopes.T, target, normal_misfit(target, scales), ORIGIN)
    in_sample, leverages, left_out = closed_form(slopes, scales, target, 5.0)
    assert found.in_sample == pytest.approx(in_sample, abs=1e-9)
    meets("V12", "linear problem", np.abs(found.left_out - left_out).max(), at_most=1e-9)
    # controls: neither the fit that has seen the mode, nor the leverages of other modes, give this
    assert np.abs(found.left_out - in_sample).max() > 1e-4
    assert np.abs(found.left_out - in_sample / (1 - np.roll(leverages, 1))).max() > 1e-4


def test_readings_of_one_mode_are_left_out_together(problem):
    """The closed form with a block of the hat matrix in place of a leverage; with its twin kept, a reading is missed by
    less."""
    slopes, scales, target = problem
    modes = [(0, 4), (1,), (2, 6), (3,), (5,)]
    predict, misfit = lambda x: 5.0 + x @ slopes.T, normal_misfit(target, scales)
    found = prediction_errors(predict, target, misfit, ORIGIN, modes=modes)
    weighted = np.concatenate([slopes / scales[:, None], np.eye(4)[3:]])
    hat = weighted @ np.linalg.inv(weighted.T @ weighted) @ weighted.T
    in_sample, _, alone = closed_form(slopes, scales, target, 5.0)
    for mode in map(list, modes):
        block = np.eye(len(mode)) - hat[np.ix_(mode, mode)]
        expected = scales[mode] * np.linalg.solve(block, in_sample[mode] / scales[mode])
        assert found.left_out[mode] == pytest.approx(expected, abs=1e-9)
    assert np.abs(found.left_out - alone)[[0, 2, 4, 6]].min() > 1e-4  # control
    assert np.isnan(
        prediction_errors(predict, target, misfit, ORIGIN, modes=[(0, 4, 1), (2, 6, 3), (5,)]).left_out
    ).all()


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
        found = prediction_errors(curved, data, normal_misfit(data, scales), ORIGIN)
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
    found = prediction_errors(predict, small, normal_misfit(small, estimate.scales), problem.centre[None, columns])
    leverages = problem.identifiability.leverages
    expected = found.in_sample / (1 - leverages)
    assert found.left_out == pytest.approx(expected, abs=0.01 * np.abs(expected).max())
    assert np.abs(found.left_out - found.in_sample).max() > 0.5 * np.abs(expected).max()  # control


def test_three_modes_leave_nothing_out(problem):
    slopes, scales, target = problem
    misfit = normal_misfit(target[:3], scales[:3])
    found = prediction_errors(lambda x: 5.0 + x @ slopes[:3].T, target[:3], misfit, ORIGIN)
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


LAWS = {False: stats.norm, True: stats.t(DEGREES_OF_FREEDOM)}
NOISE = 0.008


def loss(x, slopes, hertz, step, robust, left_out):
    """Negative log likelihood of rounded or plain readings by scipy's distributions, and the input's prior."""
    predicted = 5.0 + slopes @ x
    if step:
        low, high = ((np.log(hertz + end) - predicted) / NOISE for end in (-step / 2, step / 2))
        upper = low + high > 0
        low, high = np.where(upper, -high, low), np.where(upper, -low, high)
        each = np.log(LAWS[robust].cdf(high) - LAWS[robust].cdf(low))
    else:
        each = LAWS[robust].logpdf((np.log(hertz) - predicted) / NOISE)
    return -np.delete(each, left_out).sum() + 0.5 * x[3] ** 2


@pytest.mark.parametrize("robust", [False, True], ids=["normal", "student"])
@pytest.mark.parametrize("step", [0.0, 1.0, 4.0])
def test_the_fit_with_deviances_is_the_most_likely_point(problem, step, robust):
    """All modes and without one, against a simplex on probabilities by scipy; 4 Hz at 150 Hz is 3.3 noises."""
    slopes, _, target = problem
    hertz = np.round(np.exp(target) / step) * step if step else np.exp(target)
    errors = ReadingErrors(hertz, np.zeros(N_MODES), np.full(N_MODES, step), robust)
    misfit = deviance_misfit([errors], [NOISE])
    found = prediction_errors(lambda x: 5.0 + x @ slopes.T, np.log(hertz), misfit, ORIGIN)
    whole = most_likely(lambda x: 5.0 + x @ slopes.T, misfit, ORIGIN[0])
    for left_out in ([], [2], [5]):
        starts = [ORIGIN[0], whole] if left_out else [ORIGIN[0]]
        start = min(starts, key=lambda x: np.delete(misfit(5.0 + slopes @ x)[0] ** 2, left_out).sum() + x[3] ** 2)
        fitted = most_likely(lambda x: 5.0 + x @ slopes.T, misfit, start, None, left_out)
        arguments = (slopes, hertz, step, robust, left_out)
        best = optimize.minimize(loss, fitted + 0.01, arguments, "Nelder-Mead",
                                 options={"xatol": 1e-10, "fatol": 1e-13, "maxfev": 8000})  # fmt: skip
        # a part in 1e8 of the log likelihood is 1e-4 standard errors; the simplex stops there too
        assert loss(fitted, *arguments) <= best.fun + 1e-8
        assert loss(fitted + 0.01 * np.eye(4)[0], *arguments) > best.fun + 1e-3  # control
        kept = np.setdiff1d(np.arange(N_MODES), left_out)

        def uphill(x, kept=kept):
            return slopes[kept].T @ np.multiply(*misfit(5.0 + slopes @ x))[kept] + np.array([0.0, 0.0, 0.0, x[3]])

        missed = np.log(hertz) - 5.0 - slopes @ optimize.root(uphill, fitted, tol=1e-14).x
        assert (found.left_out[left_out] if left_out else found.in_sample) == pytest.approx(
            missed[left_out] if left_out else missed, abs=1e-9
        )


def test_without_rounding_normal_deviances_give_the_weighted_least_squares(problem):
    slopes, scales, target = problem
    errors = ReadingErrors(np.exp(target), np.sqrt(scales**2 - 0.001**2), np.zeros(N_MODES))
    assert errors.own_sd.min() > 0.001
    wanted, found = (
        prediction_errors(lambda x: 5.0 + x @ slopes.T, target, misfit, ORIGIN)
        for misfit in (normal_misfit(target, scales), deviance_misfit([errors], [0.001]))
    )
    assert found.left_out == pytest.approx(wanted.left_out, abs=1e-11)
    assert found.in_sample == pytest.approx(wanted.in_sample, abs=1e-11)


def test_readings_far_wider_than_the_noise_leave_a_fit_where_it_starts(problem):
    """All intervals hold the prediction already: nothing pulls, and nothing breaks where all slopes vanish."""
    slopes, _, _ = problem
    start = np.array([0.003, -0.002, 0.001, 0.0])
    hertz = np.round(np.exp(5.0 + slopes @ start) / 10.0) * 10.0 + 2.0
    errors = ReadingErrors(hertz, np.zeros(N_MODES), np.full(N_MODES, 30.0))
    fitted = most_likely(lambda x: 5.0 + x @ slopes.T, deviance_misfit([errors], [1e-5]), start)
    assert fitted == pytest.approx(start, abs=1e-9)


def test_a_fit_of_several_peaks_begins_at_the_best_start():
    """Two readings against two under Student's errors: without one of a pair the other pair is more likely."""
    slopes = np.column_stack([np.ones(5), np.zeros(5), np.zeros(5)])
    slopes[4] = [0.0, 1.0, 0.0]
    log_f = 5.0 + np.array([0.0, 0.001, 0.2, 0.201, 0.0])
    errors = ReadingErrors(np.exp(log_f), np.zeros(5), np.zeros(5), robust=True)
    misfit = deviance_misfit([errors], [0.002])
    starts = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]])
    found = prediction_errors(lambda x: 5.0 + x @ slopes.T, log_f, misfit, starts)
    # with one of the upper pair left out the fit is at the lower pair, and the other way round
    assert found.left_out[:4] == pytest.approx([-0.2, -0.2, 0.2, 0.2], abs=0.005)
    alone = prediction_errors(lambda x: 5.0 + x @ slopes.T, log_f, misfit, starts[:1])
    assert np.abs(alone.left_out[:2]).max() < 0.01  # control: from the lower start alone it stays there
