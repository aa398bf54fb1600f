"""The predictor: some modes, some parameters, and a tangent with the slopes of the exact law."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bayesplate.commands.problem import Problem
from bayesplate.estimates.refit import sensitivities
from bayesplate.frequencies.laws import ExactLaw, cents
from bayesplate.posterior.laplace import all_modes_predictor, law_tolerance, predictor

EFFECTS = {"shear-flexible": ("transverse_shear",), "on a soft clamp": ("clamp_rotation",)}


@pytest.fixture(scope="module", params=EFFECTS)
def posed(request):
    return Problem.from_card("finnish-spruce-cantilever", effects=EFFECTS[request.param]).posed


def errors(problem):
    return np.sqrt(np.diagonal(problem.covariance))[problem.parameters.fitted_columns]


def moved(problem, by):
    return problem.centre[problem.parameters.fitted_columns] + by * errors(problem)


def of_whole_bases(predict):
    """The same law with all eigenvalues of its bases: on few vectors its values err a little, and their slopes more."""
    models = []
    for model in predict.models:
        classes = tuple(replace(own, n_kept=own.stiffness.shape[-1]) for own in model.exact.reduced.classes)
        models.append(replace(model, exact=ExactLaw(replace(model.exact.reduced, classes=classes))))
    return replace(predict, models=models)


@pytest.mark.parametrize("by", [0.3, 1.0])
def test_tangent_has_the_value_and_the_slopes_of_the_exact_law(posed, by):
    """Slopes against differences of the exact law; the linear law of another point has others.

    A clamp without any compliance is a bound, where the differences see one side only: not there.
    """
    predict = all_modes_predictor(posed.board, posed.posterior.models, "exact", posed.centre)
    at = moved(posed, by)
    whole, near, elsewhere = of_whole_bases(predict), predict.tangent(at), predict.tangent(moved(posed, by + 1.0))

    np.testing.assert_allclose(near(at[None, :]), predict(at[None, :]), rtol=0, atol=1e-4)
    by_differences = sensitivities(lambda x: whole(x), at)
    np.testing.assert_allclose(sensitivities(whole, at), by_differences, rtol=0, atol=1e-6)
    # On few vectors a standard error of a parameter moves a frequency by as much, to the tolerance of the law.
    off = cents(sensitivities(predict, at) - by_differences) * errors(posed)
    assert np.abs(off).max() < law_tolerance(posed.board)
    assert np.abs(sensitivities(lambda x: elsewhere(x), at) - by_differences).max() > 1e-4


def test_some_modes_and_some_parameters(posed):
    predict = predictor(posed.board, posed.posterior.models, "exact", posed.centre)
    at = moved(posed, 0.5)
    whole = predict(at[None, :])

    np.testing.assert_array_equal(predict.of(np.array([2, 0]))(at[None, :]), whole[:, [2, 0]])
    np.testing.assert_array_equal(predict.with_fixed(at[3:])(at[None, :3]), whole)
