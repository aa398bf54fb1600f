"""The noise prior of a board's setups as a few weighted levels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board

Floats = NDArray[np.float64]

_LOW, _HIGH, _HIGHEST = -2.5, 3.5, 9.0
_MARGIN = 1.5
"""Standard deviations of the prior: a noise stands a few tenths off the rms, and is tried 1.5 times smaller."""
_LEVELS, _FEW_LEVELS = {1: 9, 2: 5}, {1: 5, 2: 4}
"""Along each of one or two setups."""
_POINTS, _FEW_POINTS = 64, 32
"""Of more setups together, whose product would grow without bound; powers of two, as Sobol's sequence wants them."""


@dataclass(frozen=True, eq=False)
class NoiseGrid:
    """Levels of the relative noise."""

    sd: Floats  # (n_levels, n_setups) array
    weights: Floats  # (n_levels,) array: prior probability, summing to 1


def noise_grid(board: Board, *, few: bool = False, reach: Sequence[float] = ()) -> NoiseGrid:
    """Equidistant levels in the logarithm of the noise of one setup, each with each of two, and points among more.

    The points are the first of Sobol's sequence (USSR Comput. Math. Math. Phys. 7, 1967), each in the middle of its
    share of the prior: as many for twenty setups as for three, so that the more setups, the coarser they lie; a `few`
    for combinations of effects. The levels of one or two setups go up to `reach` at least, in standard coordinates: a
    misfit of many times the noise is a large noise rather than one that no level comes near.
    """
    n_setups = len(board.setups)
    counts = _FEW_LEVELS if few else _LEVELS
    if n_setups in counts:
        axes = [_levels(counts[n_setups], top) for top in reach or (_HIGH,) * n_setups]
        t = np.array(list(product(*axes)))
        weights = np.exp(-0.5 * (t**2).sum(axis=1))
    else:
        t = _points(_FEW_POINTS if few else _POINTS, n_setups)
        weights = np.ones(len(t))
    each = [setup.noise.median * np.exp(setup.noise.log_sd * t[:, i]) for i, setup in enumerate(board.setups)]
    return NoiseGrid(np.stack(each, axis=1), weights / weights.sum())


def reach_of(board: Board, setup_index: NDArray[np.intp], residual: Floats) -> tuple[float, ...]:
    """How far up the levels of each setup's noise have to go for its residual (ln f; NaN: no mode): standard
    coordinates."""
    found = []
    for i, setup in enumerate(board.setups):
        own = residual[(setup_index == i) & np.isfinite(residual)]
        rms = float(np.sqrt(np.mean(own**2))) if own.size else 0.0
        needed = np.log(rms / setup.noise.median) / setup.noise.log_sd + _MARGIN if rms > 0.0 else _HIGH
        found.append(float(np.clip(needed, _HIGH, _HIGHEST)))
    return tuple(found)


def _levels(n_levels: int, top: float) -> Floats:
    """So many levels up to where the prior ends for most boards, and more of the same distance up to the top."""
    step = (_HIGH - _LOW) / n_levels
    n_more = int(np.ceil((top - _HIGH) / step - 1e-9))
    return np.asarray(_LOW + step * (np.arange(n_levels + n_more) + 0.5))


def _points(n_points: int, n_dim: int) -> Floats:
    """Standard normal coordinates of equally weighted points: (n_points, n_dim) array."""
    from scipy.special import ndtri
    from scipy.stats.qmc import Sobol

    shares = Sobol(n_dim, scramble=False).random(n_points) + 0.5 / n_points
    return np.asarray(ndtri(shares))
