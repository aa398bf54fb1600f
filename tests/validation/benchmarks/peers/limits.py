"""What no chain can pass: independent draws, in closed form at one noise, and weighted ones of the same posterior."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from validation.benchmarks.peers import session
from validation.benchmarks.peers.density import Density

DEGREES_OF_FREEDOM = 5
WIDER = 1.2
SHARE_IN_TAIL, FARTHER = 0.3, 1.5
"""Of the weighted draws some reach far out in D_s, to where the readings tell no more than that it is small."""


def prepared(density: Density, variant: str) -> Callable[[int, int], session.Draws]:
    """Sampler of so many draws; the variant is "closed form" or "weighted"."""
    n_dim = density.centre.size
    near = WIDER**2 * density.covariance
    far = 2.0 * near
    far[:, 2] = far[2, :] = 0.0  # D_x and D_y no longer follow
    far[2, 2] = FARTHER**2
    parts = [(1.0 - SHARE_IN_TAIL, np.linalg.cholesky(near)), (SHARE_IN_TAIL, np.linalg.cholesky(far))]

    def closed_form(size: int, seed: int) -> session.Draws:
        """Normal: the law linearised in the logarithms at the estimate, the noise known, rounding a variance."""
        return np.random.default_rng(seed).multivariate_normal(density.centre, density.covariance, size), None

    def weighted(size: int, seed: int) -> session.Draws:
        """Two of Student's distributions about the estimate, with the ratio of the posterior to both as weight."""
        rng = np.random.default_rng(seed)
        z = rng.standard_normal((size, n_dim))
        z /= np.sqrt(rng.chisquare(DEGREES_OF_FREEDOM, size) / DEGREES_OF_FREEDOM)[:, None]
        is_far = rng.random(size) < SHARE_IN_TAIL
        steps = np.where(is_far[:, None], z @ parts[1][1].T, z @ parts[0][1].T)
        proposed = np.zeros(size)
        for share, root in parts:
            squares = (np.linalg.solve(root, steps.T) ** 2).sum(axis=0)
            log_shape = -0.5 * (DEGREES_OF_FREEDOM + n_dim) * np.log1p(squares / DEGREES_OF_FREEDOM)
            proposed += share * np.exp(log_shape) / np.prod(np.diagonal(root))
        theta = density.centre + steps
        log_ratio = density.log_posterior(theta) - np.log(proposed)
        return theta, np.exp(log_ratio - log_ratio.max())

    return weighted if variant == "weighted" else closed_form


if __name__ == "__main__":
    session.run(prepared)
