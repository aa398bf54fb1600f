"""Draws by name: the thinned posterior as rigidities, moduli, noise, inputs, frequencies and likelihoods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import board_density
from bayesplate.board.material import MODULI, RIGIDITIES, DerivedQuantity, derived_quantities, moduli_of
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.posing import PosedProblem
from bayesplate.streams import random_stream


@dataclass(frozen=True, eq=False)
class Draws:
    """Thinned draws of an inference by name; all arrays start with (n_chains, n_draws), chain = ensemble; SI."""

    inference: Inference
    rigidities: Mapping[str, Floats]
    moduli: Mapping[str, Floats]
    inputs: Mapping[str, Floats]
    noise: Floats  # (..., n_setups), relative
    derived: Mapping[str, DerivedQuantity]
    log_frequency: Floats  # (..., n_modes), ln Hz, under the law of the fit
    mode_log_frequencies: tuple[Floats, ...]  # per setup (..., n_modes): labelled modes, then those that peaks may be
    log_likelihood: Floats  # (..., n_factors), in the order of `Posterior.factors`
    predictive: Floats  # (..., n_modes), Hz, readings of the next measurement: with noise, rounded as the readings

    @property
    def problem(self) -> PosedProblem:
        """The problem that was sampled."""
        return self.inference.problem

    @property
    def theta(self) -> Floats:
        """The sampled parameters: (..., n_dim) array."""
        return self.inference.theta

    @property
    def log_posterior(self) -> Floats:
        """Log density of `theta` under the law or its surrogate."""
        return self.inference.log_posterior

    @property
    def flat(self) -> Floats:
        """theta of all chains together: (n, n_dim) array."""
        return self.theta.reshape(-1, self.theta.shape[-1])

    @property
    def flat_log_frequency(self) -> list[Floats]:
        """ln f (Hz) of all modes at `flat`: one (n, n_modes) array per setup."""
        return [log_frequency.reshape(-1, log_frequency.shape[-1]) for log_frequency in self.mode_log_frequencies]

    @property
    def median_noise(self) -> Floats:
        """Posterior median of the relative noise of each setup: (n_setups,) array."""
        return np.asarray(np.median(self.noise.reshape(-1, self.noise.shape[-1]), axis=0))


def named_draws(inference: Inference, seed: int, mode_log_frequencies: Sequence[Floats] | None = None) -> Draws:
    """Draws of an inference by name; `seed` is for the predictive draws.

    `mode_log_frequencies` is ln f (Hz) of all modes at the thinned draws, (n_draws, n_modes) per setup, if known.
    """
    problem = inference.problem
    shape = inference.theta.shape[:2]
    flat = inference.theta.reshape(-1, inference.theta.shape[-1])
    posterior = problem.posterior
    values = problem.parameters.values(flat)
    constants = moduli_of(values)
    noise = np.exp(problem.parameters.log_noise(flat))
    if mode_log_frequencies is None:
        mode_log_frequencies = inference.mode_log_frequencies
    if mode_log_frequencies is None:
        distinct, distinct_index = np.unique(flat, axis=0, return_inverse=True)  # a rejected step repeats its draw
        mode_log_frequencies = [
            log_frequency[distinct_index.ravel()] for log_frequency in posterior.mode_log_frequencies(distinct)
        ]
    by_setup = list(mode_log_frequencies)
    rng = random_stream(seed, "predictive")
    labelled = posterior.labelled(by_setup)
    predictive = [
        readings.simulate(predicted, noise[:, i], rng)
        for i, (readings, predicted) in enumerate(zip(posterior.readings, labelled, strict=True))
    ]

    def shaped(array: Floats) -> Floats:
        return np.broadcast_to(array, flat.shape[:1] + array.shape[1:]).reshape(*shape, *array.shape[1:])

    derived = derived_quantities(constants, board_density(values))
    return Draws(
        inference=inference,
        rigidities={name: shaped(values[name]) for name in RIGIDITIES},
        moduli={name: shaped(array) for name, array in zip(MODULI, constants, strict=True)},
        inputs={name: shaped(values[name]) for name in problem.parameters.inputs},
        noise=shaped(noise),
        derived={name: DerivedQuantity(shaped(item.values), item.unit) for name, item in derived.items()},
        log_frequency=shaped(np.concatenate(labelled, axis=1)),
        mode_log_frequencies=tuple(shaped(log_frequency) for log_frequency in by_setup),
        log_likelihood=shaped(posterior.log_likelihood_of(by_setup, flat)),
        predictive=shaped(np.concatenate(predictive, axis=1)),
    )


def posterior_mean_values(draws: Draws) -> dict[str, Floats]:
    """Constants and inputs at their posterior means."""
    means = {name: np.asarray(values.mean()) for name, values in {**draws.rigidities, **draws.inputs}.items()}
    return {**draws.problem.board.nominal(), **means}
