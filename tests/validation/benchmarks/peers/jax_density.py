"""The log likelihood of `density` for samplers that differentiate and compile it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from validation.benchmarks.peers.density import Density


def log_likelihood(density: Density) -> Callable[[Any], Any]:
    """ln of the likelihood of one x, a (4,) array of JAX; -inf where no material is."""
    import jax.numpy as jnp
    from jax.scipy.special import log_ndtr

    per_rigidity, factors = jnp.asarray(density.per_rigidity), jnp.asarray(density.log_factors)
    log_low, log_high = jnp.asarray(density.log_low), jnp.asarray(density.log_high)
    offset = float(np.log(2.0 * np.pi))

    def found(x: Any) -> Any:
        remainder = 1.0 - density.poisson_xy**2 * jnp.exp(x[1] - x[0])
        is_material = remainder > 0.0
        correction = jnp.log(jnp.where(is_material, remainder, 1.0))
        log_rigidities = x[:3] + factors - jnp.stack([correction, correction, jnp.zeros_like(correction)])
        log_frequency = 0.5 * jnp.log(per_rigidity @ jnp.exp(log_rigidities)) - offset
        noise = jnp.exp(x[3])
        low, high = (log_low - log_frequency) / noise, (log_high - log_frequency) / noise
        is_above = low + high > 0.0
        low, high = jnp.where(is_above, -high, low), jnp.where(is_above, -low, high)
        below = log_ndtr(high)
        total = jnp.sum(below + jnp.log(-jnp.expm1(log_ndtr(low) - below)))
        return jnp.where(is_material, total, -jnp.inf)

    return found
