"""How probable each reading is given the others, by constants that were fitted to all: to first order about the fit.

The constants are left open and the noise is averaged over its prior, so that neither a better fit to the reading itself
nor a noise that follows it can raise its score.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bayesplate.board.board import Board
from bayesplate.diagnosis.evidence.noise_grid import noise_grid, reach_of
from bayesplate.estimates.marginal import log_probability
from bayesplate.frequencies.reading_errors import reading_sd

Floats = NDArray[np.float64]
Group = Sequence[int]
"""Readings that are scored together: those of one mode, in all sessions of a setup."""


def scores_given(
    board: Board, errors: Floats, slopes: Floats, groups: Sequence[Group], given: Sequence[Group] | None = None
) -> Floats:
    """ln of the probability density of the readings of each group given others: (n_groups,) array.

    Parameters
    ----------
    board : Board
    errors : (n_readings,) array
        ln measured - ln predicted at fitted constants; not a number where a reading is no mode.
    slopes : (n_readings, 3) array
        d ln f / d ln D there.
    groups : sequence of sequence of int
    given : sequence of sequence of int, optional
        Readings by which each group is predicted; by default all but its own.
    """
    is_mode = np.isfinite(errors)
    index = np.repeat(np.arange(len(board.setups)), [len(setup.readings) for setup in board.setups])
    few = len(board.setups) <= 2
    grid = noise_grid(board, reach=reach_of(board, index, errors) if few else ())
    variances = np.stack([reading_sd(board.setups, list(level)) for level in grid.sd]) ** 2

    def log_density(rows: NDArray[np.intp]) -> float:
        each = log_probability(errors[rows], slopes[rows], variances[:, rows])
        return float(logsumexp(each, b=grid.weights))

    found = []
    for i, group in enumerate(groups):
        own = np.isin(np.arange(errors.size), group) & is_mode
        others = is_mode & ~own if given is None else np.isin(np.arange(errors.size), given[i]) & is_mode & ~own
        found.append(log_density(np.flatnonzero(own | others)) - log_density(np.flatnonzero(others)))
    return np.array(found)
