"""Draws of a problem's posterior, sampled under its law or weighted to it from a surrogate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample
from bayesplate.posterior.statistics import (
    effective_share,
    resample,
    smooth_weights,
    thin_walker_major,
    weights_suffice,
)
from bayesplate.posterior.surrogate import LawPoints, Surrogate, find_surrogate, with_surrogate
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior
from bayesplate.streams import random_stream

MOST_DRAWS_A_CHAIN, MOST_WEIGHTED_A_CHAIN = 4000, 1000
_WALKS = "surrogate", "surrogate-taught"
"""Walks on a surrogate, by their folders in a checkpoint."""


@dataclass(frozen=True, eq=False)
class Inference:
    """Draws of a problem and the verdict of the convergence gate."""

    problem: PosedProblem
    chains: Chains  # the whole walk, under the law of the problem or under a surrogate of it
    convergence: Convergence
    theta: Floats  # (n_chains, n_draws, n_dim), thinned, chain = ensemble; resampled by weight if from a surrogate
    log_posterior: Floats  # (n_chains, n_draws)
    # for each setup (n_chains * n_draws, n_modes), ln Hz, if known
    mode_log_frequencies: tuple[Floats, ...] | None = None
    surrogate: Surrogate | None = None  # of the exact law, on which the walkers walked
    pareto_k: float | None = None  # k-hat of the weights from the surrogate to the exact law


def infer(
    problem: PosedProblem,
    settings: SamplerSettings,
    *,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Inference:
    """Sample the posterior of a problem in coordinates that shorten its tails.

    Under the exact law the walkers walk on a surrogate of it, unless the user chose the law, and the draws are weighted
    to the law by Pareto-smoothed importance sampling. Where the effective sample is too small, the surrogate is fitted
    again with the law's values at these draws, and the walk is repeated; if that fails, the law itself is sampled.

    The chains hold theta, the columns of `Parameters`, and the log density of theta under the surrogate or the law.

    References
    ----------
    A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance sampling, Journal of Machine
    Learning Research 25 (2024).
    """
    coordinates = TailCoordinates.around(
        problem.centre, problem.covariance, range(problem.parameters.n_constants), problem.parameters.effect_columns
    )
    posterior = problem.posterior

    def walk(
        density: Posterior, walk_checkpoint: Checkpoint | None, initial_draws: Floats | None = None
    ) -> tuple[Chains, Convergence]:
        chains, convergence = sample(
            coordinates.density(density),
            coordinates.start,
            coordinates.start_covariance(problem.covariance),
            settings,
            names=problem.parameters.names,
            initial_draws=None if initial_draws is None else coordinates.y(initial_draws),
            checkpoint=walk_checkpoint,
            progress=progress,
        )
        log_density = chains.log_prob - coordinates.log_jacobian(chains.draws)
        return Chains(coordinates.theta(chains.draws), log_density, chains.burn_in), convergence

    surrogate, initial_draws = None, None
    if posterior.law == "exact" and not problem.is_forced:
        surrogate = find_surrogate(posterior, problem.centre, problem.covariance, coordinates)
    for stage in _WALKS:
        if surrogate is None:
            break
        surrogate_posterior = with_surrogate(posterior, surrogate)
        run = walk(surrogate_posterior, None if checkpoint is None else checkpoint.part(stage), initial_draws)
        reweighted, law_points = _reweighted(problem, surrogate, *run, random_stream(settings.seed, "weights"))
        is_walked = run[1].passed
        if reweighted is not None and (reweighted.convergence.ess_min >= settings.gate.ess_min or not is_walked):
            return reweighted
        if not is_walked:
            break
        initial_draws = run[0].pooled
        log_jacobian = coordinates.log_jacobian(coordinates.y(law_points.theta))
        surrogate = surrogate.refitted_with(law_points._replace(log_density=law_points.log_density + log_jacobian))
    chains, convergence = walk(posterior, checkpoint, initial_draws)
    theta, log_posterior = (
        thin_walker_major(values, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for values in (chains.draws, chains.log_prob)
    )
    return Inference(problem, chains, convergence, theta, log_posterior)


def _reweighted(
    problem: PosedProblem, surrogate: Surrogate, chains: Chains, convergence: Convergence, rng: np.random.Generator
) -> tuple[Inference | None, LawPoints]:
    """Draws of a surrogate resampled by weight under the law, None if the weights do not suffice; and the law there."""
    posterior = problem.posterior
    thinned, log_surrogate = (
        thin_walker_major(values, chains.burn_in, convergence.tau_max, n_draws_max=MOST_WEIGHTED_A_CHAIN)
        for values in (chains.draws, chains.log_prob)
    )
    n_chains, n_draws, n_dim = thinned.shape
    theta = thinned.reshape(-1, n_dim)
    log_posterior, log_frequency = posterior.evaluate(theta)
    law_points = LawPoints(theta, log_frequency, log_posterior)
    weights, pareto_k = smooth_weights(log_posterior - log_surrogate.ravel())
    if not weights_suffice(weights, pareto_k):
        return None, law_points
    indices = np.concatenate(
        [
            i * n_draws + resample(chain_weights, n_draws, rng)
            for i, chain_weights in enumerate(weights.reshape(n_chains, -1))
        ]
    )
    share = effective_share(weights)
    ess = np.minimum(convergence.ess, thinned[..., 0].size) * share
    inference = Inference(
        problem,
        chains,
        replace(convergence, ess=ess, ess_min=float(ess.min())),
        theta[indices].reshape(thinned.shape),
        log_posterior[indices].reshape(n_chains, n_draws),
        tuple(posterior.by_setup(log_frequency[indices])),
        surrogate,
        pareto_k,
    )
    return inference, law_points
