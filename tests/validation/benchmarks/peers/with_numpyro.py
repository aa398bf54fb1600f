"""NumPyro's NUTS: four chains, a thousand steps of warm-up each, in double precision."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from validation.benchmarks.peers import jax_density, session
from validation.benchmarks.peers.density import Density

N_CHAINS, N_WARM_UP = 4, 1000


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many draws of each chain; the variant is how chains are run: "sequential" or "vectorized"."""
    import jax
    import numpyro
    import numpyro.distributions as dist

    numpyro.enable_x64()
    log_likelihood = jax_density.log_likelihood(density)

    def model() -> None:
        x = numpyro.sample("x", dist.Normal(density.prior_mean, density.prior_sd).to_event(1))
        numpyro.factor("readings", log_likelihood(x))

    @cache
    def mcmc(size: int) -> Any:
        at = numpyro.infer.init_to_value(values={"x": density.x(density.centre[None])[0]})
        kernel = numpyro.infer.NUTS(model, init_strategy=at)
        return numpyro.infer.MCMC(
            kernel,
            num_warmup=N_WARM_UP,
            num_samples=size,
            num_chains=N_CHAINS,
            chain_method=variant,
            progress_bar=False,
        )

    def sample(size: int, seed: int) -> session.Draws:
        sampler = mcmc(size)
        sampler.run(jax.random.PRNGKey(seed))
        chains = np.asarray(sampler.get_samples(group_by_chain=True)["x"])  # (chain, step, column)
        theta = density.theta(chains.reshape(-1, chains.shape[-1])).reshape(chains.shape)
        return np.swapaxes(theta, 0, 1), None

    return sample


if __name__ == "__main__":
    session.run(prepared)
