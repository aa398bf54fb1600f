"""BlackJAX's NUTS: window adaptation of a thousand steps, then four chains together, all compiled, double precision."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from validation.benchmarks.peers import jax_density, session
from validation.benchmarks.peers.density import Density

N_CHAINS, N_WARM_UP = 4, 1000


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many draws of each chain."""
    import blackjax
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    mean, sd = jnp.asarray(density.prior_mean), jnp.asarray(density.prior_sd)
    log_likelihood = jax_density.log_likelihood(density)

    def log_posterior(x: Any) -> Any:
        return -0.5 * jnp.sum(((x - mean) / sd) ** 2) + log_likelihood(x)

    adaptation = blackjax.window_adaptation(blackjax.nuts, log_posterior)

    @partial(jax.jit, static_argnums=2)
    def chains(key: Any, start: Any, size: int) -> Any:
        warm_up, key = jax.random.split(key)
        (state, parameters), _ = adaptation.run(warm_up, start, N_WARM_UP)
        step = blackjax.nuts(log_posterior, **parameters).step

        def one(states: Any, key: Any) -> Any:
            states, _ = jax.vmap(step)(jax.random.split(key, N_CHAINS), states)
            return states, states.position

        first = jax.tree.map(lambda leaf: jnp.repeat(jnp.asarray(leaf)[None], N_CHAINS, axis=0), state)
        return jax.lax.scan(one, first, jax.random.split(key, size))[1]

    def sample(size: int, seed: int) -> session.Draws:
        start = jnp.asarray(density.x(density.centre[None])[0])
        drawn = np.asarray(chains(jax.random.key(seed), start, size))  # (step, chain, column)
        return density.theta(drawn.reshape(-1, drawn.shape[-1])).reshape(drawn.shape), None

    return sample


if __name__ == "__main__":
    session.run(prepared)
