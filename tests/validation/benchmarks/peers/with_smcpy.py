"""SMCPy: particles from the prior to the posterior, tempered adaptively, moved by vectorised Metropolis steps."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from validation.benchmarks.peers import session
from validation.benchmarks.peers.density import Density

N_STEPS = 10
"""Of each particle between two temperatures."""
LOWEST = -1e10
"""ln of the likelihood where no material is: tempering multiplies it."""


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many particles."""
    import smcpy
    from scipy import stats
    from smcpy.log_likelihoods import BaseLogLike

    class RoundedReadings(BaseLogLike):
        """ln of the probability of the intervals."""

        def __call__(self, inputs: np.ndarray) -> np.ndarray:
            return np.maximum(density.log_likelihood_of_x(inputs), LOWEST)

    def sample(size: int, seed: int) -> session.Draws:
        priors = [stats.norm(mean, sd) for mean, sd in zip(density.prior_mean, density.prior_sd, strict=True)]
        mcmc = smcpy.VectorMCMC(density.theta, np.zeros(1), priors, log_like_func=RoundedReadings)
        names = ("log_E_x", "log_E_y", "log_G_xy", "log_noise")
        kernel = smcpy.VectorMCMCKernel(mcmc, names, rng=np.random.default_rng(seed))
        steps, _ = smcpy.AdaptiveSampler(kernel, show_progress_bar=False).sample(size, N_STEPS)
        last = steps[-1]
        return density.theta(np.asarray(last.params)), np.asarray(last.weights).ravel()

    return sample


if __name__ == "__main__":
    session.run(prepared)
