"""Labels of peaks by the draws of a fit: they say nothing to the likelihood, and tell which mode a residual is of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY, with_labels
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.frequencies.model import SetupModel
from bayesplate.posterior.draws import Draws, named_draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.target import Posterior

MOST_DRAWS_OF_LABELS = 2000
"""From which the probabilities of labels are taken."""


def with_likely_labels(inference: Inference, seed: int) -> tuple[Inference, Draws]:
    """An inference whose peaks have the labels that its own draws make likely, and these draws by name.

    Parameters
    ----------
    seed : int
        Of the predictive draws.
    """
    draws = named_draws(inference, seed)
    flat = [every.reshape(-1, every.shape[-1]) for every in draws.every_log_frequency]
    step = max(1, len(draws.flat) // MOST_DRAWS_OF_LABELS)
    noise = draws.noise.reshape(len(draws.flat), -1)
    labelled = labelled_by(inference, [every[::step] for every in flat], noise[::step])
    if labelled is inference:
        return inference, draws
    columns = columns_of_each(inference.problem.posterior.models, labelled.problem.posterior.models)
    return labelled, named_draws(labelled, seed, [every[:, own] for every, own in zip(flat, columns, strict=True)])


def labelled_by(inference: Inference, every_log_frequency: Sequence[Floats], noise: Floats) -> Inference:
    """The same draws where the peaks have the labels that these make likely.

    Labels that are proposed say nothing to the likelihood; they tell which mode a residual is of.

    Parameters
    ----------
    every_log_frequency : sequence of (n_draws, n_every) array
        ln f (Hz) of all modes, setup after setup, at draws of the posterior.
    noise : (n_draws, n_setups) array

    Returns
    -------
    Inference
        This one where no label changes.
    """
    problem = inference.problem
    setups = []
    for i, (setup, peaks) in enumerate(zip(problem.board.setups, problem.posterior.peaks, strict=True)):
        if peaks is not None:
            probabilities = peaks.probabilities(every_log_frequency[i], noise[:, i])
            setup = with_labels(setup, peaks, probabilities, LIKELY)
        setups.append(setup)
    board = replace(problem.board, setups=tuple(setups))
    if board.setups == problem.board.setups or sum(len(setup.readings) for setup in setups) < board.symmetry.n:
        return inference
    estimate = weighted_least_squares(board, start=problem.estimate.rigidities)
    before = problem.posterior
    models = tuple(model.labelled_as(setup) for model, setup in zip(before.models, setups, strict=True))
    posterior = Posterior(board, before.prior, models, before.law, before.robust)
    surrogate = inference.surrogate
    if surrogate is not None:
        columns = columns_of_each(before.models, models)
        starts = np.cumsum([0, *(len(model.every_place) for model in before.models)])[:-1]
        every = np.concatenate([start + own for start, own in zip(starts, columns, strict=True)])
        surrogate = replace(surrogate, coefficients=surrogate.coefficients[:, every])
    found = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    again = replace(problem, board=board, estimate=estimate, identifiability=found, posterior=posterior)
    return replace(inference, problem=again, surrogate=surrogate)


def columns_of_each(before: Sequence[SetupModel], after: Sequence[SetupModel]) -> list[Indices]:
    """Where the columns of each setup's model stood before it was labelled anew."""
    return [
        np.array([old.every_place.index(place) for place in new.every_place], dtype=np.intp)
        for old, new in zip(before, after, strict=True)
    ]
