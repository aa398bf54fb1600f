"""The noise prior of a board's setups as a few weighted levels."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.board import Board

Floats = NDArray[np.float64]

_LOW, _HIGH = -2.5, 3.5
_LEVELS = {1: 9, 2: 5, 3: 4}
_FEW_LEVELS = {1: 5, 2: 4, 3: 3}


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
    """Equidistant levels in the logarithm of the noise, every setup's with every other's.

    Parameters
    ----------
    board : Board
    few : bool
        Fewer levels, for combinations of effects.
    """
    counts = _FEW_LEVELS if few else _LEVELS
    n = counts.get(len(board.setups), 3)
    t = np.linspace(_LOW, _HIGH, 2 * n + 1)[1::2]
    each = np.exp(-0.5 * t**2)
    levels = [setup.noise.median * np.exp(setup.noise.log_sd * t) for setup in board.setups]
    sd = np.array(list(product(*levels)))
    weights = np.prod(np.array(list(product(*([each] * len(board.setups))))), axis=1)
    return NoiseGrid(sd, weights / weights.sum())
