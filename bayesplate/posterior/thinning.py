"""Draws of ensembles as chains for ArviZ: chain = ensemble, thinned to half an autocorrelation time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def thinning(tau_max: float) -> int:
    """Steps from one draw that is kept to the next: half the largest autocorrelation time."""
    return max(1, int(tau_max / 2.0)) if np.isfinite(tau_max) else 1


def walker_major(draws: Floats) -> Floats:
    """(n_ensembles, n_steps, n_walkers, ...) draws as (n_ensembles, n_draws, ...): one walker after the other.

    So neighbours are steps of one walker, and ArviZ's effective sizes see the true autocorrelation; step by step it
    would take the walkers of a step for consecutive draws.
    """
    return np.swapaxes(draws, 1, 2).reshape(len(draws), -1, *draws.shape[3:])


def thin_walker_major(draws: Floats, burn_in: int, tau_max: float, *, n_draws_max: int | None = None) -> Floats:
    """Thin draws to half an autocorrelation time and order them for ArviZ.

    Parameters
    ----------
    draws : (n_ensembles, n_steps, n_walkers, ...) array
        Draws, or anything else with these first axes, as the log posterior.
    burn_in : int
        Steps to drop first.
    tau_max : float, steps
        Largest autocorrelation time.
    n_draws_max : int, optional
        Thin further until a chain holds at most so many draws (but at least one per walker).

    Returns
    -------
    (n_ensembles, n_draws, ...) array
    """
    n_steps, n_walkers = draws.shape[1:3]
    every = thinning(tau_max)
    if n_draws_max is not None:
        every = max(every, -(-(n_steps - burn_in) // max(1, n_draws_max // n_walkers)))
    return walker_major(draws[:, burn_in::every])
