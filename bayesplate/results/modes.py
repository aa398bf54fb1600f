"""The modes of a summary: measured beside predicted, errors in sample and left out, and the peaks without a label."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.leave_one_out import Errors, prediction_errors
from bayesplate.estimates.refit import deviance_misfit
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.spectrum import NamedMode, spectrum
from bayesplate.modes.solve import Modes
from bayesplate.plate.readings import reading_sd
from bayesplate.posterior.inference import Inference, Problem
from bayesplate.posterior.region import predictor
from bayesplate.results.draws import Draws, finite

Spectrum = tuple[Modes, tuple[NamedMode, ...]]

_FEWEST_MODES, _MOST_MODES = 12, 96
_N_STARTS = 500
_SPARE = 1.5
"""Modes solved for each measured peak: some peaks are missed on the bench."""


def mode_errors(inference: Inference, draws: Draws) -> Errors:
    """Errors of the most likely constants under the exact law, in sample and left out.

    One estimator for both, with the likelihood of the fit at the posterior's median noise: rounded readings are
    intervals, a robust fit has Student's errors. Uncertain inputs move within their priors.
    """
    problem = inference.problem
    predict = predictor(problem.board, problem.posterior.models, "exact", problem.centre)
    misfit = deviance_misfit(problem.posterior.readings, median_noise(draws))
    starts, bounds = _starts(problem, draws), problem.parameters.fitted_bounds
    return prediction_errors(predict, log_measured(problem.board), misfit, starts, bounds)


def _starts(problem: Problem, draws: Draws) -> NDArray[np.float64]:
    """Where fits may begin: the centre and, as Student's likelihood has several peaks, draws: (n_starts, n_free)."""
    theta = problem.centre[None, :]
    if problem.posterior.robust:
        theta = np.concatenate([theta, draws.flat[:: max(1, len(draws.flat) // _N_STARTS)]])
    return np.asarray(theta[:, problem.parameters.fitted_columns])


def median_noise(draws: Draws) -> NDArray[np.float64]:
    """The posterior's median noise of each setup: (n_setups,) array, relative."""
    return np.asarray(np.median(draws.noise.reshape(-1, draws.noise.shape[-1]), axis=0))


def mode_entries(inference: Inference, draws: Draws, errors: Errors) -> list[dict[str, Any]]:
    """One entry a labelled mode, as in summary.json."""
    problem = inference.problem
    predicted = np.exp(draws.log_frequency).reshape(-1, draws.log_frequency.shape[-1])
    low, high = np.quantile(predicted, [0.05, 0.95], axis=0)
    scales = reading_sd(problem.board.setups, median_noise(draws))
    leverages = identifiability(problem.estimate.sensitivities, scales).leverages
    rows = [
        (setup.name, reading, place)
        for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True)
        for reading, place in zip(setup.readings, model.places, strict=True)
    ]
    return [
        {
            "setup": setup,
            "label": str(reading.label),
            "measured_hz": reading.frequency.mean,
            "predicted_hz": {"mean": float(predicted[:, i].mean()), "q05": float(low[i]), "q95": float(high[i])},
            "residual_cents": float(cents(errors.in_sample[i])),
            "left_out_cents": finite(float(cents(errors.left_out[i]))),
            "leverage": float(leverages[i]),
            "label_correlation": place.correlation,
        }
        for i, (setup, reading, place) in enumerate(rows)
    ]


def spectra(problem: Problem, draws: Draws) -> dict[str, Spectrum]:
    """Spectrum at the posterior mean of every setup with a peak or a sign to compare it with; each solved once.

    Parameters
    ----------
    problem : Problem
    draws : Draws

    Returns
    -------
    dict of (Modes, tuple of NamedMode)
        By setup; up to above its highest peak, and at least two modes a reading.
    """
    values = posterior_mean_values(problem, draws)
    found = {}
    for setup, model in zip(problem.board.setups, problem.posterior.models, strict=True):
        if not setup.unlabelled and setup.hammer is None:
            continue
        n_modes = max(_FEWEST_MODES, 2 * len(setup.readings), round(_SPARE * len(setup.readings + setup.unlabelled)))
        found[setup.name] = spectrum(model.system, values, n_modes, model.plate)
        while found[setup.name][1][-1].frequency < max(setup.unlabelled, default=0.0) and n_modes < _MOST_MODES:
            n_modes *= 2
            found[setup.name] = spectrum(model.system, values, n_modes, model.plate)
    return found


def unlabelled_entries(problem: Problem, found: Mapping[str, Spectrum]) -> list[dict[str, Any]]:
    """Each unlabelled peak beside the predicted mode nearest to it; they are shown, not fitted."""
    entries = []
    for setup in problem.board.setups:
        for peak in setup.unlabelled:
            _, named = found[setup.name]
            nearest = min(named, key=lambda mode, peak=peak: abs(np.log(mode.frequency / peak)))  # type: ignore[misc]
            entries.append(
                {
                    "setup": setup.name,
                    "measured_hz": peak,
                    "nearest": nearest.name,
                    "predicted_hz": nearest.frequency,
                    "cents": float(cents(np.log(peak / nearest.frequency))),
                }
            )
    return entries


def posterior_mean_values(problem: Problem, draws: Draws) -> dict[str, NDArray[np.float64]]:
    """Constants and inputs at their posterior means."""
    means = {name: np.asarray(v.mean()) for name, v in {**draws.rigidities, **draws.inputs}.items()}
    return {**problem.board.nominal(), **means}
