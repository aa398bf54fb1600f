"""The most likely constants under any law: by weighted squares or by deviances, inputs within their priors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.frequencies.predictor import Predictor
from bayesplate.plate.material import RIGIDITIES
from bayesplate.plate.readings import ReadingErrors

Floats = NDArray[np.float64]
Predict = Callable[[Floats], Floats]
"""From (n_draws, n_free) parameters to (n_draws, n_modes) logarithms of frequencies.

The parameters are the logarithms of the free rigidities, D_x, D_y, D_s unless a Predictor says otherwise, and the
standard coordinates of the uncertain inputs, each of which counts as one more observation: zero with standard deviation
one.
"""
Misfit = Callable[[Floats], tuple[Floats, Floats]]
"""From (..., n_modes) logarithms of frequencies to what is squared and summed over the readings, and its derivatives.

Half the sum is the negative log likelihood of the readings but for a constant.
"""

_STEP = 1e-5


def n_constants(predict: Predict) -> int:
    """How many of the parameters are logarithms of free rigidities, which have no priors in a fit."""
    return predict.n_constants if isinstance(predict, Predictor) else len(RIGIDITIES)


@dataclass(frozen=True, eq=False)
class Bounds:
    """Limits of the fitted parameters: (n_free,) arrays, infinite where there are none."""

    lower: Floats
    upper: Floats

    @property
    def are_open(self) -> bool:
        """Whether there are no limits at all."""
        return not (np.isfinite(self.lower).any() or np.isfinite(self.upper).any())


def refit(predict: Predict, target: Floats, scales: Floats, start: Floats, bounds: Bounds | None = None) -> Floats:
    """Parameters that minimise the weighted squares of ln measured - ln predicted.

    Parameters
    ----------
    predict : callable
        See `Predict`.
    target : (n_modes,) array
        ln of the measured frequencies.
    scales : (n_modes,) array
        Relative uncertainties.
    start : (n_free,) array
        Within the bounds.
    bounds : Bounds, optional

    Returns
    -------
    (n_free,) array
    """
    return most_likely(predict, normal_misfit(target, scales), start, bounds)


def normal_misfit(target: Floats, scales: Floats) -> Misfit:
    """Residuals of ln f over their standard deviations: normal errors of readings that are not rounded."""
    return lambda predicted: ((target - predicted) / scales, -1.0 / scales)


def deviance_misfit(errors: Sequence[ReadingErrors], noise: Sequence[float] | Floats) -> Misfit:
    """Signed deviance residuals of all readings, setup after setup, at one relative noise per setup."""
    ends = np.cumsum([one.frequency.size for one in errors])[:-1]

    def misfit(predicted: Floats) -> tuple[Floats, Floats]:
        parts = zip(errors, np.split(predicted, ends, axis=-1), noise, strict=True)
        residuals, slopes = zip(*(one.deviance_residuals(part, level) for one, part, level in parts), strict=True)
        return np.concatenate(residuals, axis=-1), np.concatenate(slopes, axis=-1)

    return misfit


def most_likely(
    predict: Predict,
    misfit: Misfit,
    start: Floats,
    bounds: Bounds | None = None,
    left_out: Sequence[int] = (),
) -> Floats:
    """Parameters that minimise the squares of a misfit.

    Parameters
    ----------
    predict : callable
        See `Predict`.
    misfit : callable
        See `Misfit`.
    start : (n_free,) array
        Within the bounds.
    bounds : Bounds, optional
    left_out : sequence of int, optional
        Readings that are not used.

    Returns
    -------
    (n_free,) array
    """
    from scipy.optimize import least_squares

    n = n_constants(predict)

    def without(rows: Floats) -> Floats:
        return np.delete(rows, left_out, axis=0) if len(left_out) else rows

    def residuals(x: Floats) -> Floats:
        return np.concatenate([without(misfit(predict(x[None, :])[0])[0]), x[n:]])

    def jacobian(x: Floats) -> Floats:
        chained = misfit(predict(x[None, :])[0])[1][:, None] * sensitivities(predict, x)
        return np.concatenate([without(chained), np.eye(x.size)[n:]])

    if bounds is None or bounds.are_open:
        return np.asarray(least_squares(residuals, start, jacobian, method="lm", xtol=1e-10, ftol=1e-10).x)
    limits = (bounds.lower, bounds.upper)
    return np.asarray(least_squares(residuals, start, jacobian, bounds=limits, x_scale="jac").x)


def design(predict: Predict, scales: Floats, at: Floats) -> Floats:
    """Weighted sensitivities of all observations at a point: (n_modes + n_inputs, n_free) array."""
    own = np.eye(at.size)[n_constants(predict) :]
    return np.concatenate([sensitivities(predict, at) / scales[:, None], own])


def sensitivities(predict: Predict, at: Floats) -> Floats:
    """Sensitivities of ln f to all parameters at a point, by differences: (n_modes, n_free) array.

    Those of its tangent where the predictor has one: a single solution of the modes gives them all.
    """
    steps = _STEP * np.eye(at.size)
    near = predict.tangent(at) if isinstance(predict, Predictor) else predict
    both = near(np.concatenate([at + steps, at - steps]))
    return np.asarray(((both[: at.size] - both[at.size :]) / (2 * _STEP)).T)
