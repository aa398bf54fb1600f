"""Labels of peaks by the draws of a fit: they say nothing to the likelihood, and name the mode of a residual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY, with_labels
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.target import Posterior

MOST_DRAWS_OF_LABELS = 2000
"""From these the probabilities of labels are taken."""


def with_likely_labels(inference: Inference, seed: int) -> tuple[Inference, Draws]:
    """An inference whose peaks have the labels that its own draws make likely, and these draws by name.

    The same inference where no label changes; `seed` is of the predictive draws.
    """
    draws = named_draws(inference, seed)
    problem, before = inference.problem, inference.problem.posterior
    every_log_frequency = draws.flat_log_frequency
    step = max(1, len(draws.flat) // MOST_DRAWS_OF_LABELS)
    noise = draws.noise.reshape(len(draws.flat), -1)[::step]
    setups = []
    for i, (setup, peaks) in enumerate(zip(problem.board.setups, before.peaks, strict=True)):
        if peaks is not None:
            probabilities = peaks.probabilities(every_log_frequency[i][::step], noise[:, i])
            setup = with_labels(setup, peaks, probabilities, LIKELY)
        setups.append(setup)
    board = replace(problem.board, setups=tuple(setups))
    if board.setups == problem.board.setups or sum(len(setup.readings) for setup in setups) < board.symmetry.n:
        return inference, draws
    estimate = weighted_least_squares(board, start=problem.estimate.rigidities)
    models = tuple(model.labelled_as(setup) for model, setup in zip(before.models, setups, strict=True))
    posterior = Posterior(board, before.prior, models, before.law, before.robust)
    columns = [  # of each setup, where the modes stood before
        np.array([old.every_place.index(place) for place in new.every_place], dtype=np.intp)
        for old, new in zip(before.models, models, strict=True)
    ]
    surrogate = inference.surrogate
    if surrogate is not None:
        starts = np.cumsum([0, *before.n_every])[:-1]
        every = np.concatenate([start + own for start, own in zip(starts, columns, strict=True)])
        surrogate = replace(surrogate, coefficients=surrogate.coefficients[:, every])
    found = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    again = replace(problem, board=board, estimate=estimate, identifiability=found, posterior=posterior)
    labelled = replace(inference, problem=again, surrogate=surrogate)
    known = [each[:, own] for each, own in zip(every_log_frequency, columns, strict=True)]
    return labelled, named_draws(labelled, seed, known)
