"""Assessment of a converged fit: prediction errors, leverages, both frequency laws, spectra and doubts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board, Values
from bayesplate.board.sessions import discrepancy_columns, readings_by_mode
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.leave_one_out import CarryingMode, PredictionErrors, carrying_modes, prediction_errors
from bayesplate.estimates.refit import deviance_misfit
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.model import full_log_frequencies
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.spectrum import doubtful_labels, sign_conflicts, spectra
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.posterior.laplace import predictor, worst_cents
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.reweighting import linear_is_enough, linearisation, means_under
from bayesplate.posterior.veerings import contradicted_labels

_N_STARTS = 500
_N_NAMED = 32
"""Number of draws at which modes are named."""


@dataclass(frozen=True, eq=False)
class Assessment:
    """Quantities computed once from the draws of a converged fit."""

    left_out: Floats  # (n_modes,), ln measured - ln predicted from the other modes; nan if these are too few
    leverages: Floats  # (n_modes,), share of each mode in its own prediction, at the posterior's median noise
    carrying: tuple[CarryingMode, ...]  # modes that alone carry a constant or a size
    linear_errors: Floats  # (n_some, n_modes), cents: linear less exact law over the posterior
    linear_is_enough: bool  # the linear errors stay below their share of the posterior's own noise
    exact_worst: float  # cents, largest error of the exact law against full solves
    surrogate_errors: Floats  # (n_draws, n_modes), cents, surrogate less exact law; no draws without a surrogate
    means: Mapping[LawName, tuple[Mapping[str, float], float]]  # posterior means of E_x ... D_s, and effective draws
    doubts: tuple[str, ...]  # labels that the fit contradicts or that hardly fit, and signs that contradict them


def assess(draws: Draws, linear_errors: Floats | None = None) -> Assessment:
    """Judge a converged fit; `linear_errors` are those of `linearisation`, if known."""
    problem = draws.problem
    models = problem.posterior.models
    values = posterior_mean_values(draws)
    spectrum_by_setup = spectra(models, values)
    errors = linearisation(draws) if linear_errors is None else linear_errors
    errors_of_modes = mode_errors(draws)
    conflicts = (
        sentence
        for model in models
        if model.setup.hammer is not None
        for sentence in sign_conflicts(model.setup, *spectrum_by_setup[model.setup.name], values, model.system.shaped)
    )
    return Assessment(
        left_out=errors_of_modes.left_out,
        leverages=errors_of_modes.leverages.values,
        carrying=carried_in_fit(problem.board, errors_of_modes),
        linear_errors=errors,
        linear_is_enough=linear_is_enough(draws, errors),
        exact_worst=worst_cents(models),
        surrogate_errors=_surrogate_errors(draws),
        means={law: means_under(draws, law, errors) for law in get_args(LawName)},
        doubts=(*labels_contradicted(draws), *doubtful_labels(models), *conflicts),
    )


def mode_errors(draws: Draws) -> PredictionErrors:
    """Prediction errors of the most likely constants under the exact law, in sample and left out.

    Both have the same estimator, with the likelihood of the fit at the posterior's median noise: rounded readings are
    intervals, a robust fit has Student's errors. Uncertain inputs are fitted within their priors.
    """
    problem, noise = draws.problem, draws.median_noise
    predict = predictor(problem.board, problem.posterior.models, "exact", problem.centre)
    misfit = deviance_misfit(problem.posterior.readings, noise)
    starts = problem.centre[None, :]
    if problem.posterior.robust:  # Student's likelihood has several peaks
        starts = np.concatenate([starts, draws.flat[:: max(1, len(draws.flat) // _N_STARTS)]])
    starts, bounds = starts[:, problem.parameters.fitted_columns], problem.parameters.fitted_bounds
    scales = reading_sd(problem.board.setups, noise)
    target, modes = log_measured(problem.board), readings_by_mode(problem.board)
    shared, held = (
        [problem.parameters.n_constants + i for i in columns] for columns in discrepancy_columns(problem.board)
    )
    return prediction_errors(predict, target, misfit, starts, bounds, modes, scales, shared, held)


def full_frequencies(problem: PosedProblem, values: Values) -> Floats:
    """Frequencies of the labelled modes by full solves, Hz: (n_modes,) array."""
    return np.exp(np.concatenate([full_log_frequencies(model, values) for model in problem.posterior.models]))


def carried_in_fit(board: Board, errors: PredictionErrors) -> tuple[CarryingMode, ...]:
    """Modes on which alone a constant or a size of the fit depends."""
    names = (*board.symmetry.moduli, *(parameter.effect or parameter.name for parameter in board.uncertain))
    return carrying_modes(board, errors.leverages, names)


def labels_contradicted(draws: Draws) -> tuple[str, ...]:
    """A sentence for each setup whose labels the draws contradict; under the linear law labels follow the shapes."""
    posterior = draws.problem.posterior
    if posterior.law == "linear":
        return ()
    plates = draws.flat[:: max(1, len(draws.flat) // _N_NAMED)]
    return contradicted_labels(posterior.models, posterior.parameters.values(plates))


def _surrogate_errors(draws: Draws) -> Floats:
    exact = np.concatenate(draws.flat_log_frequency, axis=1)
    surrogate = draws.inference.surrogate
    if surrogate is None:
        return exact[:0]
    return np.asarray(cents(surrogate.log_frequencies(draws.flat) - exact))
