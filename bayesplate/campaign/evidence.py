"""The probability of a board's readings, from draws of its posterior: bridge sampling.

A mixture that is fitted to one half of the draws is compared with the posterior at the other half and at draws of its
own; the ratio of the two densities in both directions gives the integral with the least error that these points allow.

References
----------
X.-L. Meng and W. H. Wong, Simulating ratios of normalizing constants via a simple identity: a theoretical exploration,
Statistica Sinica 6 (1996).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.diagnosis.terms import log_sum
from bayesplate.posterior.mixture import Mixture

N_POINTS = 1024
"""At which the density is looked at, among the draws and as many beside them."""
_MOST_PASSES = 200
_SETTLED = 1e-8


def bridge_sampling(log_density: Callable[[Floats], Floats], draws: Floats, rng: np.random.Generator) -> float:
    """ln of the integral of a density that is not normalised, from draws of it in random order.

    `log_density` takes (n, n_dim) points, -inf where it is zero.
    """
    half = len(draws) // 2
    mixture = Mixture.fitted(draws[:half])
    there = draws[half:][:N_POINTS]
    beside = mixture.points(N_POINTS, rng)
    at_draws = log_density(there) - mixture.log_density(there)
    at_points = log_density(beside) - mixture.log_density(beside)
    at_points = np.where(np.isfinite(at_points), at_points, -np.inf)
    log_share, found = np.log(len(there) / len(beside)), float(np.median(at_draws))
    for _ in range(_MOST_PASSES):
        above = at_points - np.logaddexp(log_share + at_points, found)
        below = -np.logaddexp(log_share + at_draws, found)
        before, found = found, float(log_sum(above) - np.log(len(beside)) - log_sum(below) + np.log(len(there)))
        if abs(found - before) < _SETTLED:
            break
    return found
