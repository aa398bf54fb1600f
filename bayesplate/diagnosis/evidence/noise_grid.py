"""The noise prior of a board's setups as a few weighted levels."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.board import Board

Floats = NDArray[np.float64]

_LOW, _HIGH = -2.5, 3.5
_LEVELS, _FEW_LEVELS = {1: 9, 2: 5}, {1: 5, 2: 4}
"""Along each of one or two setups."""
_POINTS, _FEW_POINTS = 64, 32
"""Of more setups together, whose product would grow without bound; powers of two, as Sobol's sequence wants them."""


@dataclass(frozen=True, eq=False)
class NoiseGrid:
    """Levels of the relative noise.

    Attributes
    ----------
    sd : (n_levels, n_setups) array
    weights : (n_levels,) array
        Prior probability, summing to 1.
    """

    sd: Floats
    weights: Floats


def noise_grid(board: Board, *, few: bool = False) -> NoiseGrid:
    """Equidistant levels in the logarithm of the noise of one setup, each with each of two, and points among more.

    The points are the first of Sobol's sequence (USSR Comput. Math. Math. Phys. 7, 1967), each in the middle of its
    share of the prior: as many for twenty setups as for three, so that the more setups, the coarser they lie.

    Parameters
    ----------
    board : Board
    few : bool
        Fewer levels, for combinations of effects.
    """
    n_setups = len(board.setups)
    counts = _FEW_LEVELS if few else _LEVELS
    if n_setups in counts:
        axis = np.linspace(_LOW, _HIGH, 2 * counts[n_setups] + 1)[1::2]
        t = np.array(list(product(*[axis] * n_setups)))
        weights = np.exp(-0.5 * (t**2).sum(axis=1))
    else:
        t = _points(_FEW_POINTS if few else _POINTS, n_setups)
        weights = np.ones(len(t))
    each = [setup.noise.median * np.exp(setup.noise.log_sd * t[:, i]) for i, setup in enumerate(board.setups)]
    return NoiseGrid(np.stack(each, axis=1), weights / weights.sum())


def _points(n_points: int, n_dim: int) -> Floats:
    """Standard normal coordinates of equally weighted points: (n_points, n_dim) array."""
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    shares = Sobol(n_dim, scramble=False).random(n_points) + 0.5 / n_points
    return np.asarray(ndtri(shares))
