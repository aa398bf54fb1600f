"""Modes of a window found one by one: where what a fit leaves looks most like a mode, one is added and all refitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.recordings.local_fit import Fitted, Window, likelihood_gain, refined, shapes

Floats = NDArray[np.float64]

MOST_MODES = 14
"""In one window."""
_BEYOND = 0.15
"""Share of the window's width beyond its ends up to which a mode may lie whose tail is seen."""
_DAMPINGS = (0.001, 0.004, 0.012, 0.035)
"""Damping ratios that are tried."""
_STEP = 0.7
"""Of the frequencies that are tried, in lines."""
_STEPS = 10
"""Of the fit after each new mode."""
_LEAST_OWN = 1e-4
"""Share of a mode's shape that those before it must leave."""


@dataclass(frozen=True, eq=False)
class Found:
    """Modes of a window.

    Attributes
    ----------
    path : tuple of (n_modes, 2) array, Hz
        Modes with one mode, with two, and so on: what a diagram of stability shows.
    """

    fit: Fitted
    path: tuple[Floats, ...]


def search(window: Window, least_gain: float) -> Found:
    """Add modes to a window while the likelihood gains.

    Parameters
    ----------
    least_gain : float
        Twice the ln of the likelihood that a mode must gain.
    """
    fit = refined(window, np.zeros((0, 2)))
    candidates = _candidates(window)
    tried = shapes(window.frequency, candidates) * window.weights[:, None]
    own = np.sum(np.abs(tried) ** 2, axis=0)
    adjoint = np.ascontiguousarray(tried.conj().T)
    path = []
    for _ in range(MOST_MODES):
        if fit.n_free < 2 * len(fit.poles) + 8:
            break
        free = own - np.sum(np.abs(adjoint @ fit.orthogonal) ** 2, axis=1)
        gains = np.sum(np.abs(adjoint @ (fit.rest / np.sqrt(fit.variance))) ** 2, axis=1)
        best = int(np.argmax(gains / np.maximum(free, _LEAST_OWN * own)))
        better = refined(window, np.concatenate([fit.poles, candidates[best][None]]), _STEPS)
        if likelihood_gain(fit, better) < least_gain:
            break
        fit = better
        path.append(fit.poles)
    return Found(fit, tuple(path))


def _candidates(window: Window) -> Floats:
    """Frequencies and decay rates that are tried: (n, 2) array, Hz."""
    low, high = window.frequency[0], window.frequency[-1]
    reach = _BEYOND * (high - low)
    frequency = np.arange(max(low - reach, window.spacing), high + reach, _STEP * window.spacing)
    decay = np.maximum(np.outer(frequency, _DAMPINGS), 0.1 * window.spacing)
    return np.stack([np.repeat(frequency, len(_DAMPINGS)), decay.ravel()], axis=1)
