"""emcee as its documentation has it: stretch moves from a small ball about the estimate; a sixth more is burnt."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from validation.benchmarks.peers import session
from validation.benchmarks.peers.density import Density

N_WALKERS = 32
FEWEST_BURNT = 200


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many steps; the variant "one by one" asks for one point at a time."""
    import emcee

    def one(theta: np.ndarray) -> float:
        return float(density.log_posterior(theta[None])[0])

    is_vectorised = variant != "one by one"
    log_posterior = density.log_posterior if is_vectorised else one

    def sample(size: int, seed: int) -> session.Draws:
        start = density.starts(N_WALKERS, np.random.default_rng(seed))
        sampler = emcee.EnsembleSampler(N_WALKERS, start.shape[1], log_posterior, vectorize=is_vectorised)
        state = emcee.State(start, random_state=np.random.RandomState(seed).get_state())
        burnt = max(FEWEST_BURNT, size // 6)
        sampler.run_mcmc(state, burnt + size)
        return sampler.get_chain(discard=burnt), None

    return sample


if __name__ == "__main__":
    session.run(prepared)
