"""Several ensembles in lock-step: one emcee sampler for the walkers of all, each ensemble as if it were alone.

Arrays here are (n_ensembles, n_walkers, ...); emcee sees the walkers of all ensembles in one row. Its own check that
walkers span the space is left out: the starts were made positive definite on purpose, and the check depends on the
units of the parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import cycle, islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.posterior.checkpoint import Chunk
from bayesplate.posterior.moves import ORDERS, CorrectedSteps, Generators, Steps, order_for, walk_order
from bayesplate.posterior.proposals import Proposal
from bayesplate.posterior.starting import Evaluate, LogPosterior

FloatArray = NDArray[np.float64]

_N_ARCHIVED = 128


@dataclass(frozen=True, eq=False)
class Learnt:
    """What the next steps propose from.

    Attributes
    ----------
    proposal : Proposal
        Common to all ensembles.
    archives : (n_ensembles, n_archived, n_dim) array
        Each ensemble's own.
    order : str
        Of independent and differential steps.
    """

    proposal: Proposal
    archives: FloatArray
    order: str = ORDERS[0][1]

    @classmethod
    def of(
        cls, lesson: Sequence[Chunk], centre: FloatArray, covariance: FloatArray, rngs: Generators, is_over: bool
    ) -> Learnt:
        """From some chunks of the warm-up.

        Before the first chunk there is the estimate alone; on the way each chunk teaches the next; those at the end of
        the warm-up, once it is over, teach all that is kept.
        """
        if not lesson:
            proposal = Proposal.with_covariance(centre, covariance)
            return cls(proposal, np.stack([proposal.points(_N_ARCHIVED, rng) for rng in rngs]))
        draws = np.concatenate([chunk.draws for chunk in lesson], axis=1)
        log_prob = np.concatenate([chunk.log_prob for chunk in lesson], axis=1)
        proposal = Proposal.fitted(draws) if is_over else Proposal.one_fitted(draws)
        flat = draws.reshape(len(draws), -1, draws.shape[-1])
        archives = flat[:, :: max(1, flat.shape[1] // _N_ARCHIVED)]
        return cls(proposal, archives, order_for((log_prob - proposal.log_density(draws)).ravel()))


def stepping(density: LogPosterior, learnt: Learnt, n_steps: int, n_walkers: int, rngs: Generators) -> Steps:
    """The steps of a chunk under one density."""
    order = "".join(islice(cycle(learnt.order), n_steps))
    return Steps(density, learnt.proposal, learnt.archives, order, n_walkers, rngs)


def correcting(
    surrogate: LogPosterior, evaluate: Evaluate, learnt: Learnt, n_steps: int, n_walkers: int, rngs: Generators
) -> CorrectedSteps:
    """The steps of a chunk under a density whose surrogate the walkers walk on."""
    walk = walk_order(learnt.order, learnt.archives.shape[-1])
    walks = Steps(surrogate, learnt.proposal, learnt.archives, walk * n_steps, n_walkers, rngs, len(walk))
    return CorrectedSteps(walks, evaluate, n_steps, rngs)


def crossed(evaluate: Evaluate, coords: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Walkers that come from a surrogate, under the density itself; who has none there joins one that has."""
    flat = coords.reshape(-1, coords.shape[-1])
    log_prob, blobs = evaluate(flat)
    lost = np.flatnonzero(log_prob == -np.inf)
    found = np.flatnonzero(log_prob > -np.inf)
    if found.size:
        taken = found[np.arange(lost.size) % found.size]
        flat, log_prob, blobs = flat.copy(), log_prob.copy(), blobs.copy()
        flat[lost], log_prob[lost], blobs[lost] = flat[taken], log_prob[taken], blobs[taken]
    apart = coords.shape[:-1]
    return flat.reshape(coords.shape), log_prob.reshape(apart), blobs.reshape(*apart, blobs.shape[1])


def advance(
    move: Steps | CorrectedSteps,
    coords: FloatArray,
    log_prob: FloatArray,
    n_steps: int,
    blobs: FloatArray | None = None,
) -> Chunk:
    """Advance all ensembles together.

    Parameters
    ----------
    move : Steps or CorrectedSteps
        Made for these walkers and so many steps.
    coords : (n_ensembles, n_walkers, n_dim) array
    log_prob : (n_ensembles, n_walkers) array
    n_steps : int
    blobs : (n_ensembles, n_walkers, n_blobs) array, optional
        What the density has found where they are; for corrected steps.

    Returns
    -------
    Chunk
    """
    import emcee

    n_ensembles, n_walkers, n_dim = coords.shape
    n_together = n_ensembles * n_walkers
    # The moves have the density, and know it wherever a walker is: emcee has none to evaluate.
    sampler = _sampler_type()(n_together, n_dim, None, moves=move, vectorize=True)
    found = None if blobs is None else blobs.reshape(n_together, blobs.shape[-1])
    start = emcee.State(coords.reshape(-1, n_dim), log_prob=log_prob.ravel(), blobs=found)
    sampler.run_mcmc(start, n_steps, skip_initial_state_check=True)
    chain, densities, kept = sampler.get_chain(), sampler.get_log_prob(), sampler.get_blobs()
    parts = chain, densities, np.empty((*densities.shape, 0)) if kept is None else kept
    shape = (n_steps, n_ensembles, n_walkers)
    return Chunk(*(np.moveaxis(part.reshape(*shape, *part.shape[2:]), 1, 0) for part in parts))


@cache
def _sampler_type() -> Any:
    """emcee's sampler without the random numbers whose state it writes down at every step: the moves have their own."""
    import emcee

    return type("Sampler", (emcee.EnsembleSampler,), {"random_state": None})
