"""Leave one mode out: refit without it by the exact law, and see how far its frequency is missed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import Bounds, Predict, refit

_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Errors:
    """ln measured - ln predicted of every mode, by one estimator.

    Attributes
    ----------
    in_sample : (n_modes,) array
        Against the fit of all modes.
    left_out : (n_modes,) array
        Against a refit that has not seen the mode; not a number everywhere if fewer than four modes are given, because
        then no fold determines three constants.
    """

    in_sample: NDArray[np.float64]
    left_out: NDArray[np.float64]


def prediction_errors(
    predict: Predict,
    target: NDArray[np.float64],
    scales: NDArray[np.float64],
    start: NDArray[np.float64],
    bounds: Bounds | None = None,
) -> Errors:
    """Errors of the weighted least-squares fit, in sample and with each mode left out in turn.

    Parameters
    ----------
    predict, target, scales, start, bounds
        As for `bayesplate.estimates.refit.refit`.

    Returns
    -------
    Errors
    """

    def error(used: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(target - predict(refit(predict, used, scales, start, bounds)[None, :])[0])

    left_out = np.full(target.size, np.nan)
    if target.size >= _FEWEST:
        for mode in range(target.size):
            without = target.copy()
            without[mode] = np.nan
            left_out[mode] = error(without)[mode]
    return Errors(error(target), left_out)
