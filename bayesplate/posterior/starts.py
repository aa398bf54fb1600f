"""Starting points of the walkers: three standard errors around the estimate, where the posterior is not zero.

Ensembles that agree after such distant starts no longer depend on them.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.errors import BayesplateError, NotConvergedError, NotIdentifiableError

LogDensity = Callable[[Floats], Floats]
"""Vectorised: (n_points, n_dim) to (n_points,); minus infinity outside the support."""

_SPREAD = 3.0  # standard errors
_TRIES = 1000


def guard_log_density(log_density: LogDensity, names: Sequence[str]) -> LogDensity:
    """A log density that raises BayesplateError where its value is nan or plus infinity; `names` for the message."""

    def checked_log_density(points: Floats) -> Floats:
        values = np.asarray(log_density(points), dtype=np.float64)
        if values.shape != points.shape[:1]:
            raise BayesplateError(f"log posterior: wanted shape {points.shape[:1]}, got {values.shape}")
        is_invalid = np.isnan(values) | (values == np.inf)
        if is_invalid.any():
            i = int(np.argmax(is_invalid))
            point = ", ".join(f"{name} = {float(value)!r}" for name, value in zip(names, points[i], strict=True))
            raise BayesplateError(
                f"log posterior: wanted a finite number or -inf, got {values[i]} at {point}; "
                "this is a fault of the program, please report it with this line"
            )
        return values

    return checked_log_density


def cholesky_factor(covariance: Floats) -> Floats:
    """Lower Cholesky factor of the estimate's covariance, whatever the units of the parameters.

    NotIdentifiableError if it is not positive definite.
    """
    covariance = np.asarray(covariance, dtype=np.float64)
    scale = np.sqrt(np.diag(covariance))
    try:
        if not (np.isfinite(covariance).all() and (scale > 0.0).all()):
            raise np.linalg.LinAlgError
        return np.asarray(scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale)))
    except np.linalg.LinAlgError:
        raise NotIdentifiableError(
            "covariance of the starting estimate: wanted a positive definite matrix, got one that is not; "
            "the data and priors leave a direction undetermined"
        ) from None


def draws_around_estimate(centre: Floats, factor: Floats, rng: np.random.Generator) -> Callable[[int], Floats]:
    """Draws of points three standard errors around the estimate, from the Cholesky factor of its covariance."""
    return lambda n: centre + _SPREAD * rng.standard_normal((n, len(centre))) @ factor.T


def finite_starts(log_density: LogDensity, draw: Callable[[int], Floats], n_walkers: int) -> tuple[Floats, Floats]:
    """Points of finite log density, and these densities; NotConvergedError where too few are found."""
    points = draw(n_walkers)
    log_prob = np.asarray(log_density(points))
    for _ in range(_TRIES):
        outside = np.flatnonzero(log_prob == -np.inf)
        if outside.size == 0:
            return points, log_prob
        points[outside] = draw(outside.size)
        log_prob[outside] = log_density(points[outside])
    raise NotConvergedError(
        f"start of the sampler: wanted {n_walkers} points of finite posterior around the estimate, got "
        f"{int(np.isfinite(log_prob).sum())} in {_TRIES} tries; the estimate lies where the priors exclude it: "
        "check the priors, the labels and the units"
    )
