"""Leave one mode out: refit without it by the exact law, and see how far its frequency is missed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.estimates.refit import N_CONSTANTS, Bounds, Misfit, Predict, most_likely

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
        Within the bounds. Each fit begins at the one where its own sum of squares is lowest: Student's likelihood may
        have another peak without the mode.

    Returns
    -------
    Errors
    """

    squares = misfit(predict(starts))[0] ** 2
    inputs = np.sum(starts[:, N_CONSTANTS:] ** 2, axis=1)

    def error(left_out: Sequence[int] = ()) -> NDArray[np.float64]:
        used = np.delete(squares, left_out, axis=1)
        start = starts[np.nanargmin(used.sum(axis=1) + inputs)]
        fitted = most_likely(predict, misfit, start, bounds, left_out)
        return np.asarray(target - predict(fitted[None, :])[0])

    left_out = np.full(target.size, np.nan)
    modes = [(reading,) for reading in range(target.size)] if modes is None else modes
    if len(modes) >= _FEWEST:
        for mode in map(list, modes):
            left_out[mode] = error(mode)[mode]
    return Errors(error(), left_out)
