"""Leave one mode out: refit without it by the exact law, and see how far its frequency is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import N_CONSTANTS, Bounds, Misfit, Predict, most_likely, sensitivities
from bayesplate.modes.threads import in_threads

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
    misfit: Misfit,
    starts: NDArray[np.float64],
    bounds: Bounds | None = None,
    modes: Sequence[Sequence[int]] | None = None,
) -> Errors:
    """Errors of the most likely constants, in sample and with each mode left out in turn.

    Parameters
    ----------
    predict, misfit, bounds
        As for `bayesplate.estimates.refit.most_likely`.
    target : (n_modes,) array
        ln of the measured frequencies.
    starts : (n_starts, n_free) array
        Within the bounds. Each fit begins at the one where its own sum of squares is lowest, or at the fit of all
        modes: Student's likelihood may have another peak without the mode.

    Returns
    -------
    Errors
    """

    def best(starts: NDArray[np.float64], squares: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(starts[np.nanargmin(squares.sum(axis=1) + np.sum(starts[:, N_CONSTANTS:] ** 2, axis=1))])

    def squared(x: NDArray[np.float64]) -> NDArray[np.float64]:
        return misfit(predict(x))[0] ** 2

    squares = squared(starts)
    whole = most_likely(predict, misfit, best(starts, squares), bounds)
    in_sample = np.asarray(target - predict(whole[None, :])[0])
    left_out = np.full(target.size, np.nan)
    modes = [(reading,) for reading in range(target.size)] if modes is None else modes
    if len(modes) >= _FEWEST:
        starts, squares = (np.concatenate(both) for both in ((starts, whole[None]), (squares, squared(whole[None]))))
        there = sensitivities(predict, whole)  # most of the fits begin here: its slopes are found once

        def slopes(x: NDArray[np.float64]) -> NDArray[np.float64]:
            return there if np.array_equal(x, whole) else sensitivities(predict, x)

        def without(mode: list[int]) -> NDArray[np.float64]:
            start = best(starts, np.delete(squares, mode, axis=1))
            fitted = most_likely(predict, misfit, start, bounds, mode, slopes)
            return np.asarray((target - predict(fitted[None, :])[0])[mode])

        every = [list(mode) for mode in modes]
        for mode, errors in zip(every, in_threads(without, every), strict=True):
            left_out[mode] = errors
    return Errors(in_sample, left_out)
