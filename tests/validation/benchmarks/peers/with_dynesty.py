"""dynesty: static nested sampling, its size the live points; or dynamic, all for the posterior, its size the draws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from validation.benchmarks.peers import session
from validation.benchmarks.peers.density import Density

FINEST = 0.01
"""Share of the evidence that may be left when a static run stops, as a logarithm."""
LOWEST = -1e300
"""ln of the likelihood where no material is: dynesty wants a number."""
STEPS = "rwalk"
"""How points are proposed: what dynesty's own warning advises here, and five times faster than what it chooses."""


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of a size; the variant is "static" or "dynamic"."""
    import dynesty

    def log_likelihood(x: np.ndarray) -> float:
        return max(float(density.log_likelihood_of_x(x[None])[0]), LOWEST)

    def sample(size: int, seed: int) -> session.Draws:
        rng, n_dim = np.random.default_rng(seed), density.prior_mean.size
        if variant == "dynamic":
            sampler = dynesty.DynamicNestedSampler(log_likelihood, density.from_cube, n_dim, sample=STEPS, rstate=rng)
            sampler.run_nested(n_effective=size, wt_kwargs={"pfrac": 1.0}, print_progress=False)
        else:
            sampler = dynesty.NestedSampler(
                log_likelihood, density.from_cube, n_dim, nlive=size, sample=STEPS, rstate=rng
            )
            sampler.run_nested(dlogz=FINEST, print_progress=False)
        results = sampler.results
        weights = results.importance_weights()
        kept = weights > 0.0
        theta = density.theta(results.samples[kept])
        known = np.isfinite(theta).all(axis=1)
        return theta[known], weights[kept][known]

    return sample


if __name__ == "__main__":
    session.run(prepared)
