"""Where the walkers start, and the log posterior that they may trust.

Starts are normal around the estimate, three times its standard errors wide: ensembles that agree after starting so far
apart have forgotten where they came from.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.errors import BayesplateError, NotConvergedError, NotIdentifiableError

FloatArray = NDArray[np.float64]
LogPosterior = Callable[[FloatArray], FloatArray]
Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
"""A log posterior that tells what it found on the way too, an (n_points, n_blobs) array: emcee's blobs."""

_START_SPREAD = 3.0  # standard errors
_START_TRIES = 1000
_FOR_STARTS, _FOR_MOVES = 0, 1


@dataclass(frozen=True)
class GuardedPosterior:
    """The log posterior, refusing every value that would be accepted without being one.

    Attributes
    ----------
    log_posterior : callable, (n_points, n_dim) -> (n_points,) array
    names : tuple of str
        Parameter names for the message.
    """

    log_posterior: LogPosterior
    names: tuple[str, ...]

    def __call__(self, theta: FloatArray) -> FloatArray:
        return self.checked(self.log_posterior(theta), theta)

    def checked(self, found: FloatArray, theta: FloatArray) -> FloatArray:
        """What was found at some points, if every value may be one."""
        values = np.asarray(found, dtype=np.float64)
        if values.shape != theta.shape[:1]:
            raise BayesplateError(f"log posterior: wanted shape {theta.shape[:1]}, got {values.shape}")
        wrong = np.isnan(values) | (values == np.inf)
        if wrong.any():
            index = int(np.argmax(wrong))
            point = ", ".join(
                f"{name} = {float(value)!r}" for name, value in zip(self.names, theta[index], strict=True)
            )
            raise BayesplateError(
                f"log posterior: wanted a finite number or -inf, got {values[index]} at {point}; "
                "this is a fault of the program, please report it with this line"
            )
        return values


def start_ensembles(
    guarded: GuardedPosterior,
    centre: FloatArray,
    covariance: FloatArray,
    *,
    n_ensembles: int,
    n_walkers: int,
    seed: int,
) -> tuple[FloatArray, FloatArray]:
    """Start every ensemble from its own random numbers, which nothing else uses.

    Parameters
    ----------
    guarded : GuardedPosterior
    centre : (n_dim,) array
        The estimate.
    covariance : (n_dim, n_dim) array
        Its covariance.
    n_ensembles, n_walkers, seed : int

    Returns
    -------
    coords : (n_ensembles, n_walkers, n_dim) array
    log_prob : (n_ensembles, n_walkers) array

    Raises
    ------
    NotIdentifiableError
        If the covariance is not positive definite.
    NotConvergedError
        If no points of finite posterior are found.
    """
    covariance = np.asarray(covariance, dtype=np.float64)
    scale = np.sqrt(np.diag(covariance))
    try:
        if not (np.isfinite(covariance).all() and (scale > 0.0).all()):
            raise np.linalg.LinAlgError
        factor = scale[:, None] * np.linalg.cholesky(covariance / np.outer(scale, scale))
    except np.linalg.LinAlgError:
        raise NotIdentifiableError(
            "covariance of the starting estimate: wanted a positive definite matrix, got one that is not; "
            "the data and priors leave a direction undetermined"
        ) from None
    starts = [
        _finite_starts(guarded, centre, factor, n_walkers, np.random.default_rng(_line(seed, ensemble, _FOR_STARTS)))
        for ensemble in range(n_ensembles)
    ]
    return np.stack([coords for coords, _ in starts]), np.stack([log_prob for _, log_prob in starts])


def random_numbers(seed: int, ensemble: int, chunk: int) -> np.random.Generator:
    """What an ensemble draws from during one chunk of steps, and nothing else does.

    Every chunk has numbers of its own, so that a run that is continued needs no more than where the walkers stand.
    """
    return np.random.default_rng(_line(seed, ensemble, _FOR_MOVES, chunk))


def _line(seed: int, *key: int) -> np.random.SeedSequence:
    return np.random.SeedSequence(seed, spawn_key=key)


def _finite_starts(
    guarded: GuardedPosterior, centre: FloatArray, factor: FloatArray, n_walkers: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Draw walkers around the estimate, again and again those outside the support."""
    coords = np.empty((n_walkers, centre.size))
    log_prob = np.full(n_walkers, -np.inf)
    for _ in range(_START_TRIES):
        outside = np.flatnonzero(log_prob == -np.inf)
        if outside.size == 0:
            return coords, log_prob
        coords[outside] = centre + _START_SPREAD * rng.standard_normal((outside.size, centre.size)) @ factor.T
        log_prob[outside] = guarded(coords[outside])
    raise NotConvergedError(
        f"start of the sampler: wanted {n_walkers} points of finite posterior around the estimate, got "
        f"{int(np.isfinite(log_prob).sum())} in {_START_TRIES} tries; the estimate lies where the priors exclude it: "
        "check the priors, the labels and the units"
    )
