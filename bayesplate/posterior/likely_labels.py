"""Labels of peaks from the draws of a fit: they do not enter the likelihood, and name the mode of a residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY_LABEL, label_likely_peaks
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.target import Posterior

MOST_DRAWS_OF_LABELS = 2000
"""Largest number of draws for the probabilities of labels."""


def with_likely_labels(inference: Inference, seed: int) -> Draws:
    """The draws of an inference by name, its peaks with their likely labels by these draws.

    `seed` is for the predictive draws.
    """
    draws = named_draws(inference, seed)
    problem, previous = inference.problem, inference.problem.posterior
    mode_log_frequencies = draws.flat_log_frequency
    step = max(1, len(draws.flat) // MOST_DRAWS_OF_LABELS)
    noise = draws.noise.reshape(len(draws.flat), -1)[::step]
    setups = []
    for i, (setup, peaks) in enumerate(zip(problem.board.setups, previous.peaks, strict=True)):
        if peaks is not None:
            probabilities = peaks.probabilities(mode_log_frequencies[i][::step], noise[:, i])
            setup = label_likely_peaks(setup, peaks, probabilities, LIKELY_LABEL)
        setups.append(setup)
    board = replace(problem.board, setups=tuple(setups))
    if board.setups == problem.board.setups or sum(len(setup.readings) for setup in setups) < board.symmetry.n:
        return draws
    estimate = weighted_least_squares(board, start=problem.estimate.rigidities)
    models = tuple(model.labelled_as(setup) for model, setup in zip(previous.models, setups, strict=True))
    posterior = Posterior(board, previous.prior, models, previous.law, previous.robust)
    columns = [  # for each setup, the previous index of each mode
        np.array([previous_model.mode_places.index(place) for place in model.mode_places], dtype=np.intp)
        for previous_model, model in zip(previous.models, models, strict=True)
    ]
    surrogate = inference.surrogate
    if surrogate is not None:
        starts = np.cumsum([0, *previous.n_modes])[:-1]
        all_columns = np.concatenate([start + order for start, order in zip(starts, columns, strict=True)])
        surrogate = replace(surrogate, coefficients=surrogate.coefficients[:, all_columns])
    verdict = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    relabelled_problem = replace(problem, board=board, estimate=estimate, identifiability=verdict, posterior=posterior)
    relabelled = replace(inference, problem=relabelled_problem, surrogate=surrogate)
    log_frequencies = [
        log_frequency[:, order] for log_frequency, order in zip(mode_log_frequencies, columns, strict=True)
    ]
    return named_draws(relabelled, seed, log_frequencies)
