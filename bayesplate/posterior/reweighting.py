"""Draws under one frequency law weighted to be draws under the other, and the error that the linear law makes."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.statistics import effective_draws, smoothed
from bayesplate.posterior.target import linear_suffices

FEWEST_WEIGHTED_DRAWS = 200
"""With fewer effective draws left by the weights, one law cannot stand for the other."""
_N_LINEARISATION = 2000


def means_under(inference: Inference, draws: Draws, law: LawName, errors: Floats) -> tuple[dict[str, float], float]:
    """Posterior means of the constants under a law, by weighting the draws of the fit.

    The exact law is dear: draws of the linear one are weighted at those draws only at which `linearisation` compared
    the two, with these `errors`, and the shift of their mean is added to the mean of all. Where these leave
    few, all are weighted. Means of E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m), and the effective number of draws.
    """
    constants = {name: values.ravel() for name, values in {**draws.moduli, **draws.rigidities}.items()}
    if law == "exact" != inference.problem.posterior.law:
        every, posterior = _every(draws), inference.problem.posterior
        exact = np.concatenate(draws.flat_log_frequency, axis=1)[::every] - errors / cents(np.ones(1))
        log_likelihood = posterior.log_likelihood_of(posterior.by_setup(exact), draws.flat[::every])
        weights = _weights(log_likelihood, draws, every)
        if effective_draws(weights) >= FEWEST_WEIGHTED_DRAWS:
            means = {
                name: float(np.mean(values)) + weighted_mean(values[::every] - np.mean(values[::every]), weights)
                for name, values in constants.items()
            }
            return means, effective_draws(weights) * draws.log_posterior.size / weights.size
    weights = law_weights(inference, draws, law)
    return {name: weighted_mean(values, weights) for name, values in constants.items()}, effective_draws(weights)


def law_weights(inference: Inference, draws: Draws, law: LawName) -> Floats:
    """Weights that make the draws of one law draws of another: (n_chains * n_draws,) array that sums to 1."""
    if law == inference.problem.posterior.law:
        return np.full(draws.log_posterior.size, 1.0 / draws.log_posterior.size)
    return _weights(inference.problem.under(law).posterior.log_likelihood(draws.flat), draws)


def _weights(log_likelihood: Floats, draws: Draws, every: int = 1) -> Floats:
    """Smoothed weights (n_some,) of every so many draws from their (n_some, n_factors) likelihood under another law."""
    own = draws.log_likelihood.sum(axis=-1).ravel()[::every]
    return smoothed(log_likelihood.sum(axis=1) - own)[0]


def weighted_mean(values: Floats, weights: Floats) -> float:
    """Mean of draws with weights that sum to 1; a sum, because a long dot product depends on the number of threads."""
    return float(np.sum(weights * values))


def linearisation(inference: Inference, draws: Draws) -> Floats:
    """Linear less exact law over the posterior, of every mode: (n_some, n_every) array, cents.

    The draws know what their own law gives; the other one is evaluated.
    """
    every = _every(draws)
    other: LawName = "linear" if inference.problem.posterior.law == "exact" else "exact"
    there = inference.problem.under(other).posterior.every_log_frequency(draws.flat[::every])
    apart = np.concatenate(there, axis=1) - np.concatenate(draws.flat_log_frequency, axis=1)[::every]
    return cents(apart if other == "linear" else -apart)


def _every(draws: Draws) -> int:
    """Step between the draws at which the laws are compared."""
    return max(1, len(draws.flat) // _N_LINEARISATION)


def linear_is_enough(inference: Inference, draws: Draws, errors: Floats | None = None) -> bool:
    """Whether the linear law's `errors` over the posterior stay below their share of the posterior's own noise."""
    errors = linearisation(inference, draws) if errors is None else errors
    return linear_suffices(inference.problem.posterior.n_every, errors, draws.median_noise)
