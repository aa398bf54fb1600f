"""Draws by name: the thinned posterior as rigidities, moduli, noise, inputs, frequencies and likelihoods."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.laws import LawName, cents
from bayesplate.plate.board import density
from bayesplate.plate.material import MODULI, RIGIDITIES, Derived, derived_quantities, moduli
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.region import linearisation_errors
from bayesplate.posterior.target import linear_suffices
from bayesplate.results.archive import thin_walker_major

Floats = NDArray[np.float64]

QUANTILES = {"q05": 0.05, "q25": 0.25, "q50": 0.5, "q75": 0.75, "q95": 0.95}
MOST_DRAWS_A_CHAIN = 4000
_LINE_OF_PREDICTIVE_DRAWS = 1
_N_LINEARISATION = 2000
FEWEST_WEIGHTED_DRAWS = 200


@dataclass(frozen=True, eq=False)
class Draws:
    """Thinned draws of an inference; every array starts with (n_chains, n_draws), chain = ensemble.

    Attributes
    ----------
    theta : (n_chains, n_draws, n_dim) array
    log_posterior : (n_chains, n_draws) array
    rigidities, moduli, inputs : dict of (n_chains, n_draws) array, SI
    noise : (n_chains, n_draws, n_setups) array
        Relative.
    derived : dict of Derived
    log_frequency : (n_chains, n_draws, n_modes) array
        ln f (Hz) under the law of the fit.
    log_likelihood : (n_chains, n_draws, n_modes) array
    predictive : (n_chains, n_draws, n_modes) array, Hz
        Frequencies that the next measurement would read, noise included, rounded where the readings are.
    """

    theta: Floats
    log_posterior: Floats
    rigidities: Mapping[str, Floats]
    moduli: Mapping[str, Floats]
    inputs: Mapping[str, Floats]
    noise: Floats
    derived: Mapping[str, Derived]
    log_frequency: Floats
    log_likelihood: Floats
    predictive: Floats

    @property
    def flat(self) -> Floats:
        """theta of all chains together: (n, n_dim) array."""
        return self.theta.reshape(-1, self.theta.shape[-1])


def named_draws(inference: Inference, seed: int) -> Draws:
    """Thin the chains of an inference and name what they mean.

    Parameters
    ----------
    inference : Inference
    seed : int
        Of the predictive draws.

    Returns
    -------
    Draws
    """
    problem, chains = inference.problem, inference.chains
    tau = inference.convergence.tau_max
    theta = thin_walker_major(chains.draws, chains.burn_in, tau, n_draws_max=MOST_DRAWS_A_CHAIN)
    log_posterior = thin_walker_major(chains.log_prob, chains.burn_in, tau, n_draws_max=MOST_DRAWS_A_CHAIN)
    shape = theta.shape[:2]
    flat = theta.reshape(-1, theta.shape[-1])
    posterior = problem.posterior
    values = problem.parameters.values(flat)
    constants = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    log_noise = problem.parameters.log_noise(flat)
    by_setup = posterior.log_frequencies(flat)
    rng = np.random.default_rng(np.random.SeedSequence(seed).spawn(_LINE_OF_PREDICTIVE_DRAWS)[0])
    predictive, log_likelihood = [], []
    for i, (setup, readings, predicted) in enumerate(
        zip(problem.board.setups, posterior.readings, by_setup, strict=True)
    ):
        simulated = np.exp(readings.simulate(predicted, log_noise[:, i], rng))
        rounded = readings.log_high > readings.log_low
        if setup.resolution:
            simulated[:, rounded] = np.round(simulated[:, rounded] / setup.resolution) * setup.resolution
        predictive.append(simulated)
        log_likelihood.append(readings.log_likelihood(predicted, log_noise[:, i]))

    def shaped(array: Floats) -> Floats:
        return np.broadcast_to(array, flat.shape[:1] + array.shape[1:]).reshape(*shape, *array.shape[1:])

    derived = derived_quantities(constants, density(values))
    return Draws(
        theta=theta,
        log_posterior=log_posterior,
        rigidities={name: shaped(values[name]) for name in RIGIDITIES},
        moduli={name: shaped(array) for name, array in zip(MODULI, constants, strict=True)},
        inputs={name: shaped(values[name]) for name in problem.parameters.inputs},
        noise=shaped(np.exp(log_noise)),
        derived={name: Derived(shaped(item.values), item.unit) for name, item in derived.items()},
        log_frequency=shaped(np.concatenate(by_setup, axis=1)),
        log_likelihood=shaped(np.concatenate(log_likelihood, axis=1)),
        predictive=shaped(np.concatenate(predictive, axis=1)),
    )


def spread(values: Floats, unit: str) -> dict[str, float | str]:
    """Mean, standard deviation and quantiles of draws, as they stand in the summary.

    Parameters
    ----------
    values : array of any shape
    unit : str

    Returns
    -------
    dict
        mean, sd, q05, q25, q50, q75, q95, unit.
    """
    quantiles = np.quantile(values, list(QUANTILES.values()))
    return {
        "mean": float(np.mean(values)),
        "sd": float(np.std(values, ddof=1)),
        **{name: float(value) for name, value in zip(QUANTILES, quantiles, strict=True)},
        "unit": unit,
    }


def means_under(
    inference: Inference, draws: Draws, law: LawName, errors: Floats | None = None
) -> tuple[dict[str, float], float]:
    """Posterior means of the constants under a law, by weighting the draws of the fit.

    The exact law is dear: draws of the linear one are weighted at those draws only at which `linearisation` compared
    the two, and the shift of their mean is added to the mean of all. Where these leave few, all are weighted.

    Parameters
    ----------
    inference : Inference
    draws : Draws
    law : "linear" or "exact"
    errors : (n_some, n_modes) array, cents, optional
        Those of `linearisation`, where they are known already.

    Returns
    -------
    means : dict of float
        E_x, E_y, G_xy (Pa), D_x, D_y, D_s (N m).
    effective_draws : float
        How many draws of equal weight the weights are worth; all of them under the law of the fit.
    """
    constants = {name: values.ravel() for name, values in {**draws.moduli, **draws.rigidities}.items()}
    if law == "exact" != inference.problem.posterior.law:
        every = _every(draws)
        errors = linearisation(inference, draws) if errors is None else errors
        exact = draws.log_frequency.reshape(-1, draws.log_frequency.shape[-1])[::every] - errors / cents(np.ones(1))
        weights = _weights(_log_likelihood(inference, draws.flat[::every], exact), draws, every)
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
    """Weights of every so many draws from what another law says of them: (n_some, n_modes) to (n_some,) array."""
    own = draws.log_likelihood.sum(axis=-1).ravel()[::every]
    log_weights = log_likelihood.sum(axis=1) - own
    weights = np.exp(log_weights - log_weights.max())
    return np.asarray(weights / weights.sum())


def _log_likelihood(inference: Inference, theta: Floats, log_frequency: Floats) -> Floats:
    """Log probability of every reading where the frequencies are known: (n_some, n_modes) arrays."""
    posterior = inference.problem.posterior
    log_noise = inference.problem.parameters.log_noise(theta)
    ends = np.cumsum([len(setup.readings) for setup in inference.problem.board.setups])
    parts = np.split(log_frequency, ends[:-1], axis=1)
    return np.concatenate(
        [
            readings.log_likelihood(part, log_noise[:, i])
            for i, (readings, part) in enumerate(zip(posterior.readings, parts, strict=True))
        ],
        axis=1,
    )


def weighted_mean(values: Floats, weights: Floats) -> float:
    """Mean of draws with weights that sum to 1; a sum, because a long dot product depends on the number of threads."""
    return float(np.sum(weights * values))


def effective_draws(weights: Floats) -> float:
    """How many draws of equal weight are worth as much."""
    return float(1.0 / np.sum(weights**2))


def linearisation(inference: Inference, draws: Draws) -> Floats:
    """Linear less exact law over the posterior: (n_some, n_modes) array, cents."""
    return linearisation_errors(
        inference.problem.board, inference.problem.posterior.models, draws.flat[:: _every(draws)]
    )


def _every(draws: Draws) -> int:
    """Draws from one at which the laws are compared to the next."""
    return max(1, len(draws.flat) // _N_LINEARISATION)


def linear_is_enough(inference: Inference, draws: Draws, errors: Floats | None = None) -> bool:
    """Whether the linear law's error over the posterior stays below its share of the posterior's own noise.

    `errors` are those of `linearisation`, where they are known already.
    """
    noise = np.median(draws.noise.reshape(-1, draws.noise.shape[-1]), axis=0)
    return linear_suffices(
        inference.problem.board, linearisation(inference, draws) if errors is None else errors, list(noise)
    )


def finite(value: float) -> float | None:
    """The number, or None where JSON has none: infinity and not-a-number."""
    return float(value) if np.isfinite(value) else None
