"""Leave one mode out: refit without it by the exact law, and see how far its frequency is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import N_CONSTANTS, Bounds, Misfit, Predict, has_come_to_rest
from bayesplate.estimates.side_by_side import most_likely_of_each

_FEWEST = 4


@dataclass(frozen=True, eq=False)
class Errors:
    """ln measured - ln predicted of every mode, by one estimator.

    Attributes
    ----------
    in_sample : (n_modes,) array
        Against the fit of all modes.
    left_out : (n_modes,) array
        Against a refit that has not seen the mode; not a number where the other modes leave a constant open, so that
        the refit runs out of reach, and everywhere if fewer than four modes are given.
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
        lost = squares.sum(axis=1) + np.sum(starts[:, N_CONSTANTS:] ** 2, axis=1)
        return np.asarray(starts[np.argmin(np.where(np.isfinite(lost), lost, np.inf))])

    def squared(x: NDArray[np.float64]) -> NDArray[np.float64]:
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):  # a start may be no plate
            return misfit(predict(x))[0] ** 2

    squares = squared(starts)
    (whole,) = most_likely_of_each(predict, misfit, best(starts, squares)[None], [()], bounds)
    in_sample = np.asarray(target - predict(whole[None, :])[0])
    left_out = np.full(target.size, np.nan)
    modes = [(reading,) for reading in range(target.size)] if modes is None else modes
    if len(modes) >= _FEWEST:
        starts, squares = (np.concatenate(both) for both in ((starts, whole[None]), (squares, squared(whole[None]))))
        without = np.stack([best(starts, np.delete(squares, list(mode), axis=1)) for mode in modes])
        fitted = most_likely_of_each(predict, misfit, without, modes, bounds)
        fitted[~has_come_to_rest(fitted, without)] = np.nan
        for mode, predicted in zip(map(list, modes), predict(fitted), strict=True):
            left_out[mode] = (target - predicted)[mode]
    return Errors(in_sample, left_out)
