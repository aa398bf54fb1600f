"""What a fit is judged by besides its draws: errors, leverages, both frequency laws, spectra and doubts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import get_args

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.frequencies.spectrum import doubtful_labels, sign_conflicts, spectra
from bayesplate.posterior.draws import Draws, posterior_mean_values
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.laplace import worst_cents
from bayesplate.posterior.mode_errors import carried_in_fit, mode_errors
from bayesplate.posterior.reweighting import linear_is_enough, linearisation, means_under
from bayesplate.posterior.target import Posterior
from bayesplate.posterior.veerings import contradicted_labels

Floats = NDArray[np.float64]

_N_NAMED = 32
"""Draws on which modes are named."""


@dataclass(frozen=True, eq=False)
class Assessment:
    """What is computed once from the draws of a converged fit.

    Attributes
    ----------
    left_out : (n_modes,) array
        ln measured - ln predicted of every reading by the most likely constants of the others; not a number where
        too few modes are left.
    leverages : (n_modes,) array
        Share of each mode in its own prediction, at the posterior's median noise.
    carrying : tuple of CarryingMode
        Modes that alone carry a constant or a size.
    linear_errors : (n_some, n_every) array, cents
        Linear less exact law over the posterior, of every mode that the likelihood looks at.
    linear_is_enough : bool
        Whether these stay below their share of the posterior's own noise.
    exact_worst : float, cents
        Largest error of the exact law against full solves.
    surrogate_errors : (n_draws, n_every) array, cents
        Surrogate of the exact law less that law over the posterior; without draws where the walkers walked on none.
    means : dict of (dict of float, float)
        By law: posterior means of E_x ... D_s, and how many draws of equal weight they rest on.
    doubts : tuple of str
        Labels that the fit contradicts or that hardly fit, and signs that contradict them.
    """

    left_out: Floats
    leverages: Floats
    carrying: tuple[CarryingMode, ...]
    linear_errors: Floats
    linear_is_enough: bool
    exact_worst: float
    surrogate_errors: Floats
    means: Mapping[LawName, tuple[Mapping[str, float], float]]
    doubts: tuple[str, ...]


def assess(inference: Inference, draws: Draws, linear_errors: Floats | None = None) -> Assessment:
    """Judge a converged fit.

    Parameters
    ----------
    linear_errors : (n_some, n_every) array, cents, optional
        Those of `bayesplate.posterior.reweighting.linearisation`, where they are known already.
    """
    problem = inference.problem
    models = problem.posterior.models
    values = posterior_mean_values(problem, draws)
    found = spectra(models, values)
    errors = linearisation(inference, draws) if linear_errors is None else linear_errors
    errors_of_modes = mode_errors(inference, draws)
    conflicts = (
        sentence
        for model in models
        if model.setup.hammer is not None
        for sentence in sign_conflicts(model.setup, *found[model.setup.name], values, model.system.shaped)
    )
    return Assessment(
        left_out=errors_of_modes.left_out,
        leverages=errors_of_modes.leverages.values,
        carrying=carried_in_fit(inference, errors_of_modes),
        linear_errors=errors,
        linear_is_enough=linear_is_enough(inference, draws, errors),
        exact_worst=worst_cents(models),
        surrogate_errors=_surrogate_errors(inference, draws),
        means={law: means_under(inference, draws, law, errors) for law in get_args(LawName)},
        doubts=(*labels_contradicted(problem.posterior, draws), *doubtful_labels(models), *conflicts),
    )


def labels_contradicted(posterior: Posterior, draws: Draws) -> tuple[str, ...]:
    """A sentence per setup whose labels the draws contradict; under the linear law labels follow the shapes."""
    if posterior.law == "linear":
        return ()
    some = draws.flat[:: max(1, len(draws.flat) // _N_NAMED)]
    return contradicted_labels(posterior.models, posterior.parameters.values(some))


def _surrogate_errors(inference: Inference, draws: Draws) -> Floats:
    exact = np.concatenate([each.reshape(-1, each.shape[-1]) for each in draws.every_log_frequency], axis=1)
    if inference.surrogate is None:
        return exact[:0]
    return np.asarray(cents(inference.surrogate.log_frequencies(draws.flat) - exact))
