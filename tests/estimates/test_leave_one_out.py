"""A mode left out: by refitting, and by the closed form that holds where residuals are small."""

from __future__ import annotations

import numpy as np
import pytest
from limits import meets
from scipy import optimize, stats

from bayesplate.commands.prepare import prepare
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.leave_one_out import (
    CarryingMode,
    Leverages,
    PredictionErrors,
    carrying_modes,
    carrying_sentence,
    indices_of,
    leverages_of,
    prediction_errors,
    unite_carrying_modes,
)
from bayesplate.estimates.refit import design_matrix, deviance_misfit, most_likely, normal_misfit, refit
from bayesplate.frequencies.reading_errors import DEGREES_OF_FREEDOM, ReadingErrors
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import pose

N_MODES = 7
ORIGIN = np.zeros((1, 4))


@pytest.fixture
def problem():
    """Slopes, scales and data of a linear problem: three constants and one input with a prior."""
    rng = np.random.default_rng(3)
    slopes = rng.uniform(-0.5, 0.5, (N_MODES, 4))
    return slopes, rng.uniform(0.002, 0.01, N_MODES), 5.0 + 0.01 * rng.normal(size=N_MODES)


def linear(slopes):
    return lambda x: 5.0 + x @ slopes.T


def errors_of(slopes, scales, target, modes=None):
    """Errors of a linear problem of normal readings."""
    return prediction_errors(linear(slopes), target, normal_misfit(target, scales), ORIGIN, modes=modes)


def hat_matrix(weighted):
    return weighted @ np.linalg.inv(weighted.T @ weighted) @ weighted.T


def closed_form(slopes, scales, target):
    """In-sample residuals r, and the hat matrix, of whose diagonal h each mode left out is missed by r / (1 - h).

    The input's prior is one more observation.
    """
    hat = hat_matrix(np.concatenate([slopes / scales[:, None], np.eye(4)[3:]]))
    data = np.concatenate([(target - 5.0) / scales, [0.0]])
    return (data - hat @ data)[: target.size] * scales, hat[: target.size, : target.size]


def test_a_linear_problem_has_the_closed_form(problem):
    slopes, scales, target = problem
    found = errors_of(*problem)
    in_sample, hat = closed_form(*problem)
    leverages = np.diagonal(hat)
    assert found.in_sample == pytest.approx(in_sample, abs=1e-9)
    meets("V12", "linear problem", np.abs(found.left_out - in_sample / (1 - leverages)).max(), at_most=1e-9)
    # controls: neither the fit that has seen the mode, nor the leverages of other modes, give this
    assert np.abs(found.left_out - in_sample).max() > 1e-4
    assert np.abs(found.left_out - in_sample / (1 - np.roll(leverages, 1))).max() > 1e-4
    assert found.leverages.values == pytest.approx(leverages, abs=1e-6)
    assert ((found.leverages.carries >= 0) == (leverages > 0.9)).all()
    precise = prediction_errors(linear(slopes), target, normal_misfit(target, scales), ORIGIN, scales=1e-3 * scales)
    _, hat = closed_form(slopes, 1e-3 * scales, target)
    assert precise.leverages.values == pytest.approx(np.diagonal(hat), abs=1e-6)


def test_readings_of_one_mode_are_left_out_together(problem):
    """The closed form with a block of the hat matrix in place of a leverage; with its twin kept, a reading is missed by
    less."""
    _, scales, _ = problem
    modes = [(0, 4), (1,), (2, 6), (3,), (5,)]
    found = errors_of(*problem, modes=modes)
    in_sample, hat = closed_form(*problem)
    for mode in map(list, modes):
        block = np.eye(len(mode)) - hat[np.ix_(mode, mode)]
        expected = scales[mode] * np.linalg.solve(block, in_sample[mode] / scales[mode])
        assert found.left_out[mode] == pytest.approx(expected, abs=1e-9)
    alone = in_sample / (1 - np.diagonal(hat))
    assert np.abs(found.left_out - alone)[[0, 2, 4, 6]].min() > 1e-4  # control
    assert np.isnan(errors_of(*problem, modes=[(0, 4, 1), (2, 6, 3), (5,)]).left_out).all()


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
        leverages = np.diagonal(hat_matrix(design_matrix(curved, scales, fitted)))[:N_MODES]
        found = prediction_errors(curved, data, normal_misfit(data, scales), ORIGIN)
        expected = found.in_sample / (1 - leverages)
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
    found = errors_of(*(one[:3] for one in problem))
    assert np.isnan(found.left_out).all()
    assert np.isfinite(found.in_sample).all()
    assert (found.leverages.carries < 0).all()  # nothing is left out, so that there is nothing to count or not


def test_an_input_stays_within_its_prior(problem):
    """Poor data leave it at the prior's middle, precise ones take it where they alone would lead."""
    slopes, scales, target = problem
    moved = [abs(refit(linear(slopes), target, scales * s, np.zeros(4))[3]) for s in (1e4, 1e2, 1.0)]
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


@pytest.mark.parametrize(("step", "robust"), [(0.0, False), (0.0, True), (4.0, False), (1.0, True)])
def test_the_fit_with_deviances_is_the_most_likely_point(problem, step, robust):
    """All modes and without one, against a simplex on probabilities by scipy; 4 Hz at 150 Hz is 3.3 noises.

    To a ten-thousandth of the noise, where the least squares of scipy stop.
    """
    slopes, _, target = problem
    hertz = np.round(np.exp(target) / step) * step if step else np.exp(target)
    errors = ReadingErrors(hertz, np.zeros(N_MODES), np.full(N_MODES, step), robust)
    misfit = deviance_misfit([errors], [NOISE])
    found = prediction_errors(linear(slopes), np.log(hertz), misfit, ORIGIN)
    whole = most_likely(linear(slopes), misfit, ORIGIN[0])
    for left_out in ([], [2], [5]):
        starts = [ORIGIN[0], whole] if left_out else [ORIGIN[0]]
        start = min(starts, key=lambda x: np.delete(misfit(5.0 + slopes @ x)[0] ** 2, left_out).sum() + x[3] ** 2)
        fitted = most_likely(linear(slopes), misfit, start, None, left_out)
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
            missed[left_out] if left_out else missed, abs=1e-4 * NOISE
        )


def test_without_rounding_normal_deviances_give_the_weighted_least_squares(problem):
    slopes, scales, target = problem
    errors = ReadingErrors(np.exp(target), np.sqrt(scales**2 - 0.001**2), np.zeros(N_MODES))
    assert errors.own_sd.min() > 0.001
    wanted = errors_of(slopes, scales, target)
    found = prediction_errors(linear(slopes), target, deviance_misfit([errors], [0.001]), ORIGIN)
    assert found.left_out == pytest.approx(wanted.left_out, abs=1e-11)
    assert found.in_sample == pytest.approx(wanted.in_sample, abs=1e-11)


def test_readings_far_wider_than_the_noise_leave_a_fit_where_it_starts(problem):
    """All intervals hold the prediction already: nothing pulls, and nothing breaks where all slopes vanish."""
    slopes, _, _ = problem
    start = np.array([0.003, -0.002, 0.001, 0.0])
    hertz = np.round(np.exp(5.0 + slopes @ start) / 10.0) * 10.0 + 2.0
    errors = ReadingErrors(hertz, np.zeros(N_MODES), np.full(N_MODES, 30.0))
    fitted = most_likely(linear(slopes), deviance_misfit([errors], [1e-5]), start)
    assert fitted == pytest.approx(start, abs=1e-9)


def test_a_fit_of_several_peaks_begins_at_the_best_start():
    """Two readings against two under Student's errors: without one of a pair the other pair is more likely."""
    slopes = np.column_stack([np.ones(5), np.zeros(5), np.zeros(5)])
    slopes[4] = [0.0, 1.0, 0.0]
    log_f = 5.0 + np.array([0.0, 0.001, 0.2, 0.201, 0.0])
    errors = ReadingErrors(np.exp(log_f), np.zeros(5), np.zeros(5), robust=True)
    misfit = deviance_misfit([errors], [0.002])
    starts = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.0]])
    found = prediction_errors(linear(slopes), log_f, misfit, starts)
    # with one of the upper pair left out the fit is at the lower pair, and the other way round
    assert found.left_out[:4] == pytest.approx([-0.2, -0.2, 0.2, 0.2], abs=0.005)
    alone = prediction_errors(linear(slopes), log_f, misfit, starts[:1])
    assert np.abs(alone.left_out[:2]).max() < 0.01  # control: from the lower start alone it stays there


def carried(share: float, n_free: int = 3):
    """Six readings of which the last alone sees the second constant but for a seventh with that share of its weight.

    Without priors the leverage of the last is then 1 - share.
    """
    slopes = np.zeros((7, n_free))
    slopes[:4, 0], slopes[:4, 2] = (0.5, 0.3, 0.1, 0.4), (0.0, 0.2, 0.4, 0.1)
    slopes[5, 1] = 0.5
    slopes[6, 1] = 0.5
    scales = np.full(7, 0.005)
    scales[6] *= np.sqrt((1.0 - share) / share)
    return slopes, scales


@pytest.mark.parametrize(("share", "is_alone"), [(0.101, False), (0.099, True)])
def test_a_mode_of_leverage_above_nine_tenths_alone_carries_its_constant(share, is_alone):
    slopes, scales = carried(share)
    found = leverages_of(slopes, scales)
    assert found.values[5] == pytest.approx(1.0 - share, abs=1e-9)
    assert found.carries.tolist() == [-1, -1, -1, -1, -1, 1 if is_alone else -1, -1]


def test_what_a_mode_carries_may_be_a_size_with_a_prior():
    """A reading ten times as precise as the prior of a size that no other sees: leverage 100 / 101, column 3."""
    slopes, scales = carried(0.5, 4)
    slopes[4, 3] = 0.05
    found = leverages_of(slopes, scales)
    assert found.values[4] == pytest.approx(100.0 / 101.0)
    assert found.carries[4] == 3
    weak = leverages_of(np.where(np.arange(4) == 3, 0.5, 1.0) * slopes, scales)  # 25 / 26: the prior counts
    assert weak.values[4] == pytest.approx(25.0 / 26.0)


def test_readings_of_one_mode_carry_together_what_neither_carries_alone():
    slopes, scales = carried(0.5)
    assert (leverages_of(slopes, scales).carries < 0).all()
    found = leverages_of(slopes, scales, [(0,), (1,), (2,), (3,), (4,), (5, 6)])
    assert found.carries.tolist() == [-1, -1, -1, -1, -1, 1, 1]
    assert found.values[5:] == pytest.approx(1.0)


def test_what_the_readings_of_a_mode_share_is_noise_that_no_mode_carries():
    """Two sessions of six modes that repeat far better than the plate fits: leverages of generalised least squares."""
    rng = np.random.default_rng(4)
    slopes, shared = np.repeat(rng.uniform(0.1, 1.0, (6, 3)), 2, axis=0), 5.0 * np.repeat(np.eye(6), 2, axis=0)
    modes = [(2 * i, 2 * i + 1) for i in range(6)]
    found = leverages_of(np.hstack([slopes, shared]), np.ones(12), modes, noise_columns=range(3, 9))

    mean, variance = slopes[::2], 25.0 + 0.5
    expected = np.einsum("ij,jk,ik->i", mean, np.linalg.inv(mean.T @ mean / variance), mean) / variance
    np.testing.assert_allclose(found.values, np.repeat(expected, 2))
    assert (found.carries < 0).all()
    assert (leverages_of(np.hstack([slopes, shared]), np.ones(12), modes).carries >= 0).all()  # control


def test_errors_of_some_readings_keep_their_places_among_all():
    errors = PredictionErrors(np.ones(2), np.array([1.0, 300.0]), Leverages(np.array([0.5, 0.95]), np.array([-1, 1])))
    spread = errors.at(np.array([0, 2]), 4)
    assert spread.left_out == pytest.approx([1.0, np.nan, 300.0, np.nan], nan_ok=True)
    assert spread.in_sample == pytest.approx([1.0, np.nan, 1.0, np.nan], nan_ok=True)
    assert spread.leverages.carries.tolist() == [-1, -1, 1, -1]
    assert spread.leverages.values.tolist() == [0.5, 0.0, 0.95, 0.0]


def test_modes_that_carry_something_are_named():
    board = prepare("finnish-spruce-cantilever").board
    (setup,) = board.setups
    found = Leverages(np.linspace(0.5, 0.95, 6), np.array([-1, -1, -1, 3, -1, 1]))
    told = carrying_modes(board, found, ("E_x", "E_y", "G_xy", "clamp_rotation"))
    labels = [str(label) for label in setup.labels]
    assert [(one.label, one.carries) for one in told] == [(labels[3], "clamp_rotation"), (labels[5], "E_y")]
    assert indices_of(told, board) == (3, 5)
    assert (
        carrying_sentence(told[1:])
        == f"mode {labels[5]} alone carries E_y: it does not count in the leave-one-out error"
    )
    assert "the size of clamp rotation" in carrying_sentence(told)
    assert carrying_sentence(()) == ""
    days = tuple(CarryingMode(f"day {i}", "(1,0)", 0.95, "E_x") for i in (1, 2))
    other = CarryingMode("day 1", "(0,2)", 0.95, "E_y")
    assert carrying_sentence(days).startswith("mode (1,0) alone carries E_x: it does not")
    assert carrying_sentence((*days, other)).startswith(
        "mode (1,0) alone carries E_x and mode (0,2) of day 1 alone carries E_y: they do not"
    )
    again = (CarryingMode(setup.name, labels[5], 0.99, "E_x"), CarryingMode(setup.name, labels[0], 0.91, "E_x"))
    assert [(one.label, one.carries) for one in unite_carrying_modes(told[1:], again)] == [
        (labels[5], "E_y"),
        (labels[0], "E_x"),
    ]
