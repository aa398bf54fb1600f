"""Leaving a mode out never raises, whatever was read: what cannot be fitted is not a number, and the rest is."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from generator.boards import plant
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy import optimize

from bayesplate.commands.prepare import prepare
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.leave_one_out import prediction_errors
from bayesplate.estimates.refit import (
    Bounds,
    deviance_misfit,
    has_come_to_rest,
    most_likely,
    normal_misfit,
    refit,
)
from bayesplate.frequencies.reading_errors import ReadingErrors
from bayesplate.plate.terms import Weights
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.posing import pose

NOISE = 0.003
POSITIVE = st.floats(1e-300, 1e300) | st.floats(1.0, 1e4)
"""Hertz: any number that a float holds, and such as a plate may have."""


@cache
def free_board():
    """The exact law of a free board of twelve modes with a crack, which the library lacks; its readings; a start."""
    board = plant(np.random.default_rng(1), "free-12", ["crack"], noise_cents=5.0, fixed={})
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"{board.name}.toml"
        path.write_text(board.card_text(), encoding="utf-8")
        prepared = prepare(path)
    problem = pose(prepared.board, prepared.prior)
    predict = predictor(prepared.board, problem.posterior.models, "exact", problem.centre)
    return predict.of_labelled(), log_measured(prepared.board), problem.centre[problem.parameters.fitted_columns]


def misfit_of(hertz, kind):
    if kind == "normal":
        return normal_misfit(np.log(hertz), np.full(hertz.size, NOISE))
    steps = np.full(hertz.size, 1.0 if kind == "rounded" else 0.0)
    errors = ReadingErrors(hertz, np.zeros(hertz.size), steps, kind == "student")
    return deviance_misfit([errors], [NOISE])


def is_told(errors, n_modes):
    """Whether every error is there, a number or not a number, and none infinite."""
    both = np.concatenate([errors.in_sample, errors.left_out])
    return both.size == 2 * n_modes and not np.isinf(both).any()


@pytest.mark.slow
@given(hertz=st.lists(POSITIVE, min_size=12, max_size=12), kind=st.sampled_from(["normal", "rounded", "student"]))
@settings(max_examples=4, deadline=None, derandomize=True, phases=[Phase.generate])
def test_leaving_a_mode_of_a_free_board_out_never_raises(hertz, kind):
    predict, target, start = free_board()
    hertz = np.array(hertz)
    errors = prediction_errors(predict, np.log(hertz), misfit_of(hertz, kind), start[None])
    assert is_told(errors, target.size)
    assert np.isfinite(refit(predict, np.log(hertz), np.full(hertz.size, NOISE), start)).all()


@given(off=st.lists(st.floats(-1.5, 1.5), min_size=7, max_size=7), seed=st.integers(0, 99))
@settings(max_examples=20, deadline=None, derandomize=True, phases=[Phase.generate])
def test_leaving_a_mode_of_any_law_out_never_raises(off, seed):
    """A pencil of three stiffnesses: ln of their weighted sums, whose constants may run to zero or to infinity."""
    shares = np.random.default_rng(seed).dirichlet(np.full(3, 0.3), 7)
    target = np.array(off)
    errors = prediction_errors(pencil(shares), target, normal_misfit(target, np.full(7, 0.01)), np.zeros((1, 3)))
    assert is_told(errors, 7)
    assert np.isfinite(errors.in_sample).all()


def pencil(shares):
    """ln f of modes whose squares are sums of three constants' shares."""

    def predict(x):
        with np.errstate(over="ignore"):
            return 0.5 * np.log(np.exp(x) @ shares.T)

    return predict


def test_a_mode_without_which_a_constant_falls_for_ever_has_no_prediction_and_the_others_have():
    """The last mode alone has much of the third constant; the others ring as if that were below zero.

    Where it is left out, the squares ask for none of that constant (nonnegative least squares by scipy), ln of which is
    beyond any reach.
    """
    rng = np.random.default_rng(3)
    shares = np.column_stack([rng.uniform(0.2, 0.8, (7, 2)), np.full(7, 0.05)])
    shares[6, 2] = 1.0
    squares = shares @ [1.0, 1.0, -0.5]
    squares[6] = shares[6].sum()
    target = 0.5 * np.log(squares)
    kept = np.arange(6)
    assert optimize.nnls(shares[kept], squares[kept])[0][2] == 0.0
    assert optimize.nnls(shares, squares)[0].min() > 0.3
    found = prediction_errors(pencil(shares), target, normal_misfit(target, np.full(7, 0.01)), np.zeros((1, 3)))
    assert np.isnan(found.left_out[6])
    assert np.isfinite(found.left_out[:6]).all()
    assert np.isfinite(found.in_sample).all()


@pytest.mark.parametrize("bounds", [None, Bounds(np.full(3, -9.0), np.full(3, 9.0))], ids=["open", "bounded"])
def test_a_law_without_frequencies_gives_no_numbers_where_it_starts_and_is_kept_off_elsewhere(bounds):
    """Above a wall in the first constant there are no frequencies, and the readings ask for more of it."""
    shares = np.random.default_rng(5).dirichlet(np.ones(3), 7)

    def walled(x):
        return np.where(x[:, :1] < 0.5, pencil(shares)(x), np.nan)

    target = pencil(shares)(np.array([[0.8, 0.0, 0.0]]))[0]
    misfit = normal_misfit(target, np.full(7, 0.01))
    found = most_likely(walled, misfit, np.zeros(3), bounds)
    assert np.isfinite(found).all()
    assert 0.3 < found[0] <= 0.5
    beside = np.array([0.499999, 0.0, 0.0])  # slopes by differences reach over the wall
    assert np.isfinite(most_likely(walled, misfit, beside, bounds)).all()
    assert np.isnan(most_likely(walled, misfit, np.ones(3), bounds)).all()
    assert not has_come_to_rest(np.full(3, np.nan), np.zeros(3), 3)
    errors = prediction_errors(walled, target, misfit, np.ones((1, 3)), bounds)
    assert np.isnan(errors.in_sample).all()


def test_weights_that_are_not_finite_never_reach_a_solver():
    """The draw has no frequencies, and those beside it have theirs."""
    predict, _, start = free_board()
    (model,) = predict.models
    far = start + np.array([[0.0, 0.0, 0.0], [800.0, 0.0, 0.0], [0.0, np.nan, 0.0]])
    with np.errstate(over="ignore", invalid="ignore"):
        found = predict(far)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1:]).all()
    assert found[0] == pytest.approx(predict(start[None])[0], rel=1e-12)
    assert np.isnan(model.exact.squared(Weights(np.full((2, 4), 1e307), np.ones((2, 1))))).all()
