"""Draws under one frequency law weighted to the other law, and the error of the linear law."""

from __future__ import annotations

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.frequencies.laws import LawName, cents
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.statistics import effective_draws, smooth_weights
from bayesplate.posterior.target import linear_suffices

FEWEST_WEIGHTED_DRAWS = 200
"""With fewer effective draws, draws under one law cannot be used for the other."""
_N_LINEARISATION = 2000


def means_under(draws: Draws, law: LawName, errors: Floats) -> tuple[dict[str, float], float]:
    """Posterior means of the constants under a law, by weighting the draws of the fit.

    The exact law is slow: draws of the linear law are weighted only where `linearisation` compared the two laws, with
    its `errors`, and the shift of their mean is added to the mean of all draws. Where too few of these are effective,
    all draws are weighted. Means of E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m), and the effective number of draws.
    """
    constants = {name: values.ravel() for name, values in {**draws.moduli, **draws.rigidities}.items()}
    posterior = draws.problem.posterior
    if law == "exact" != posterior.law:
        step = _comparison_step(draws)
        exact = np.concatenate(draws.flat_log_frequency, axis=1)[::step] - errors / cents(np.ones(1))
        log_likelihood = posterior.log_likelihood_of(posterior.by_setup(exact), draws.flat[::step])
        weights = _law_weights(log_likelihood, draws, step)
        if effective_draws(weights) >= FEWEST_WEIGHTED_DRAWS:
            means = {
                name: float(np.mean(values)) + weighted_mean(values[::step] - np.mean(values[::step]), weights)
                for name, values in constants.items()
            }
            return means, effective_draws(weights) * draws.log_posterior.size / weights.size
    weights = law_weights(draws, law)
    return {name: weighted_mean(values, weights) for name, values in constants.items()}, effective_draws(weights)


def law_weights(draws: Draws, law: LawName) -> Floats:
    """Weights of the draws for another law than that of the fit: (n_chains * n_draws,) array that sums to 1."""
    if law == draws.problem.posterior.law:
        return np.full(draws.log_posterior.size, 1.0 / draws.log_posterior.size)
    return _law_weights(draws.problem.under(law).posterior.log_likelihood(draws.flat), draws)


def _law_weights(log_likelihood: Floats, draws: Draws, step: int = 1) -> Floats:
    """Smoothed weights (n_some,) of each `step`-th draw from its likelihood (n_some, n_factors) under another law."""
    log_own = draws.log_likelihood.sum(axis=-1).ravel()[::step]
    return smooth_weights(log_likelihood.sum(axis=1) - log_own)[0]


def weighted_mean(values: Floats, weights: Floats) -> float:
    """Mean of draws with weights that sum to 1; not a dot product, which depends on the number of threads."""
    return float(np.sum(weights * values))


def linearisation(draws: Draws) -> Floats:
    """Linear less exact law over the posterior, of all modes: (n_some, n_modes) array, cents.

    The draws hold the frequencies of their own law; the other law is evaluated.
    """
    step = _comparison_step(draws)
    other_law: LawName = "linear" if draws.problem.posterior.law == "exact" else "exact"
    other_frequencies = draws.problem.under(other_law).posterior.mode_log_frequencies(draws.flat[::step])
    difference = np.concatenate(other_frequencies, axis=1) - np.concatenate(draws.flat_log_frequency, axis=1)[::step]
    return cents(difference if other_law == "linear" else -difference)


def _comparison_step(draws: Draws) -> int:
    """Step between the draws at which the laws are compared."""
    return max(1, len(draws.flat) // _N_LINEARISATION)


def linear_is_enough(draws: Draws, errors: Floats | None = None) -> bool:
    """Whether the linear law's `errors` over the posterior stay below their share of the posterior's own noise."""
    errors = linearisation(draws) if errors is None else errors
    return linear_suffices(draws.problem.posterior.n_modes, errors, draws.median_noise)
