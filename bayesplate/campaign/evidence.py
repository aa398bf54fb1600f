"""The probability of a board's readings, from draws of its posterior: bridge sampling.

A mixture is fitted to one half of the draws, and compared with the posterior at the other half and at draws of the
mixture; the ratios of the two densities there give the integral with the least error that these points allow.

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

N_BRIDGE_POINTS = 1024
"""Points at which the density is evaluated, among the draws and among those of the mixture, at most."""
_MOST_PASSES = 200
_TOLERANCE = 1e-8


def bridge_sampling(log_density: Callable[[Floats], Floats], draws: Floats, rng: np.random.Generator) -> float:
    """ln of the integral of a density that is not normalised, from draws of it in random order.

    `log_density` takes (n, n_dim) points, -inf where it is zero.
    """
    half = len(draws) // 2
    mixture = Mixture.fitted(draws[:half])
    posterior_points = draws[half:][:N_BRIDGE_POINTS]
    mixture_points = mixture.points(N_BRIDGE_POINTS, rng)
    at_draws = log_density(posterior_points) - mixture.log_density(posterior_points)
    at_points = log_density(mixture_points) - mixture.log_density(mixture_points)
    at_points = np.where(np.isfinite(at_points), at_points, -np.inf)
    log_share, log_evidence = np.log(len(posterior_points) / len(mixture_points)), float(np.median(at_draws))
    for _ in range(_MOST_PASSES):
        above = at_points - np.logaddexp(log_share + at_points, log_evidence)
        below = -np.logaddexp(log_share + at_draws, log_evidence)
        previous, log_evidence = (
            log_evidence,
            float(log_sum(above) - np.log(len(mixture_points)) - log_sum(below) + np.log(len(posterior_points))),
        )
        if abs(log_evidence - previous) < _TOLERANCE:
            break
    return log_evidence
