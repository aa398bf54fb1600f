"""From a problem to draws of its posterior, under its law or weighted to it from a surrogate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample
from bayesplate.posterior.statistics import effective_share, may_stand, resampled, smoothed, thin_walker_major
from bayesplate.posterior.surrogate import Solved, Surrogate, find_surrogate, with_surrogate
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior
from bayesplate.streams import stream

MOST_DRAWS_A_CHAIN, MOST_WEIGHTED_A_CHAIN = 4000, 1000
_WALKS = "surrogate", "surrogate-taught"
"""Walks on a surrogate, by their places in a checkpoint."""


@dataclass(frozen=True, eq=False)
class Inference:
    """Draws of a problem and the verdict of the convergence gate."""

    problem: PosedProblem
    chains: Chains  # the whole walk, under the law of the problem or under a surrogate of it
    convergence: Convergence
    theta: Floats  # (n_chains, n_draws, n_dim), thinned, chain = ensemble; of a surrogate drawn again by weight
    log_posterior: Floats  # (n_chains, n_draws)
    # of each setup (n_chains * n_draws, n_every), ln Hz, if known
    every_log_frequency: tuple[Floats, ...] | None = None
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

    Under the exact law the walkers walk on a surrogate of it, unless the law was asked for, and the draws are weighted
    to the law by Pareto-smoothed importance sampling. Where too few count, what the law gave at them teaches the
    surrogate, and the walk is made again; where too few count then, the law itself is sampled.

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

    def walked(density: Posterior, saved: Checkpoint | None, near: Floats | None = None) -> tuple[Chains, Convergence]:
        chains, convergence = sample(
            coordinates.density(density),
            coordinates.start,
            coordinates.start_covariance(problem.covariance),
            settings,
            names=problem.parameters.names,
            near=None if near is None else coordinates.y(near),
            checkpoint=saved,
            progress=progress,
        )
        log_density = chains.log_prob - coordinates.log_jacobian(chains.draws)
        return Chains(coordinates.theta(chains.draws), log_density, chains.burn_in), convergence

    surrogate, near = None, None
    if posterior.law == "exact" and not problem.is_forced:
        surrogate = find_surrogate(posterior, problem.centre, problem.covariance, coordinates)
    for part in _WALKS:
        if surrogate is None:
            break
        quick = with_surrogate(posterior, surrogate)
        found = walked(quick, None if checkpoint is None else checkpoint.part(part), near)
        weighted, solved = _weighted(problem, surrogate, *found, stream(settings.seed, "weights"))
        is_walked = found[1].passed
        if weighted is not None and (weighted.convergence.ess_min >= settings.gate.ess_min or not is_walked):
            return weighted
        if not is_walked:
            break
        near = found[0].pooled
        log_jacobian = coordinates.log_jacobian(coordinates.y(solved.theta))
        surrogate = surrogate.taught(solved._replace(log_density=solved.log_density + log_jacobian))
    chains, convergence = walked(posterior, checkpoint, near)
    theta, log_posterior = (
        thin_walker_major(part, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for part in (chains.draws, chains.log_prob)
    )
    return Inference(problem, chains, convergence, theta, log_posterior)


def _weighted(
    problem: PosedProblem, surrogate: Surrogate, chains: Chains, convergence: Convergence, rng: np.random.Generator
) -> tuple[Inference | None, Solved]:
    """Draws of a surrogate, drawn again by their weights under the law, None where too few count; and the law there."""
    posterior = problem.posterior
    thinned, log_walked = (
        thin_walker_major(part, chains.burn_in, convergence.tau_max, n_draws_max=MOST_WEIGHTED_A_CHAIN)
        for part in (chains.draws, chains.log_prob)
    )
    n_chains, n_draws, n_dim = thinned.shape
    theta = thinned.reshape(-1, n_dim)
    log_posterior, log_frequency = posterior.evaluate(theta)
    solved = Solved(theta, log_frequency, log_posterior)
    weights, pareto_k = smoothed(log_posterior - log_walked.ravel())
    if not may_stand(weights, pareto_k):
        return None, solved
    picked = np.concatenate(
        [i * n_draws + resampled(part, n_draws, rng) for i, part in enumerate(weights.reshape(n_chains, -1))]
    )
    share = effective_share(weights)
    ess = np.minimum(convergence.ess, thinned[..., 0].size) * share
    inference = Inference(
        problem,
        chains,
        replace(convergence, ess=ess, ess_min=float(ess.min())),
        theta[picked].reshape(thinned.shape),
        log_posterior[picked].reshape(n_chains, n_draws),
        tuple(posterior.by_setup(log_frequency[picked])),
        surrogate,
        pareto_k,
    )
    return inference, solved
