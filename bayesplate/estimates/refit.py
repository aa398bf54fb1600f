"""The most likely constants under any law: by weighted squares or by deviances, inputs within their priors."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.board.material import RIGIDITIES
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import ReadingErrors

Predict = Callable[[Floats], Floats]
"""From (n_draws, n_free) parameters to (n_draws, n_modes) logarithms of frequencies.

The parameters are the logarithms of the free rigidities, D_x, D_y, D_s unless a Predictor says otherwise, and the
standard coordinates of the uncertain inputs, each of which counts as one more observation: zero with standard deviation
one.
"""
Misfit = Callable[[Floats], tuple[Floats, Floats]]
"""From (..., n_modes) logarithms of frequencies to residuals, which are squared and summed, and their derivatives.

Half the sum is the negative log likelihood of the readings up to a constant.
"""

_STEP = 1e-5
_REACH = 7.0
"""Largest change of ln D from the start of a fit: a thousandfold."""
_REST_SHARE = 0.9
"""Share of `_REACH` beyond which a fit has not come to rest: readings that leave a constant open lead there."""
_LEAST_GAIN = 1e-6
"""Share of the misfit that a step within bounds has to gain: less moves a parameter by a small part of its standard
error, and along a bent valley there are hundreds of such steps."""


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
        return not (np.isfinite(self.lower).any() or np.isfinite(self.upper).any())


def refit(predict: Predict, target: Floats, scales: Floats, start: Floats, bounds: Bounds | None = None) -> Floats:
    """Parameters that minimise the weighted squares of ln measured - ln predicted: (n_free,) array."""
    return most_likely(predict, normal_misfit(target, scales), start, bounds)


def normal_misfit(target: Floats, scales: Floats) -> Misfit:
    """Residuals of ln f over their standard deviations: normal errors of readings that are not rounded."""
    return lambda predicted: ((target - predicted) / scales, -1.0 / scales)


def deviance_misfit(errors: Sequence[ReadingErrors], noise: Sequence[float] | Floats) -> Misfit:
    """Signed deviance residuals of all readings, setup after setup, at one relative noise per setup."""
    ends = np.cumsum([setup_errors.frequency.size for setup_errors in errors])[:-1]

    def misfit(predicted: Floats) -> tuple[Floats, Floats]:
        rows = zip(errors, np.split(predicted, ends, axis=-1), noise, strict=True)
        residuals, slopes = zip(
            *(setup_errors.deviance_residuals(log_frequencies, level) for setup_errors, log_frequencies, level in rows),
            strict=True,
        )
        return np.concatenate(residuals, axis=-1), np.concatenate(slopes, axis=-1)

    return misfit


def most_likely(
    predict: Predict, misfit: Misfit, start: Floats, bounds: Bounds | None = None, left_out: Sequence[int] = ()
) -> Floats:
    """Parameters, (n_free,), that minimise the squares of a misfit, the constants within reach of the start.

    A step to where the law gives no frequency, or beyond reach, is refused and a shorter one tried; the result is nan
    where the law gives no frequency at the start. The readings `left_out` are not used.
    """
    from scipy.optimize import least_squares

    n = n_constants(predict)

    def drop_left_out(rows: Floats) -> Floats:
        return np.delete(rows, left_out, axis=0) if len(left_out) else rows

    def residuals(x: Floats) -> Floats:
        misfits = np.concatenate([drop_left_out(misfit(predict(x[None, :])[0])[0]), x[n:]])
        return misfits if _largest_change(x, start, n) <= _REACH else np.full_like(misfits, np.nan)

    def jacobian(x: Floats) -> Floats:
        chained = misfit(predict(x[None, :])[0])[1][:, None] * sensitivities(predict, x)
        slopes = np.nan_to_num(drop_left_out(chained), posinf=0.0, neginf=0.0)  # beside a place without frequencies
        return np.concatenate([slopes, np.eye(x.size)[n:]])

    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        if not np.isfinite(residuals(start)).all():
            return np.full(start.size, np.nan)
        if bounds is None or bounds.are_open:
            return np.asarray(least_squares(residuals, start, jacobian, method="lm", xtol=1e-10, ftol=1e-10).x)
        limits = (bounds.lower, bounds.upper)
        return np.asarray(least_squares(residuals, start, jacobian, bounds=limits, x_scale="jac", ftol=_LEAST_GAIN).x)


def has_come_to_rest(fitted: Floats, starts: Floats, n: int) -> Bools:
    """Whether (..., n_free) fits ended well within reach of their starts: else the n constants are not determined."""
    return np.asarray(_largest_change(fitted, starts, n) <= _REST_SHARE * _REACH)


def _largest_change(x: Floats, start: Floats, n: int) -> Floats:
    """The largest change of ln D; not a number where x is none."""
    return np.asarray(np.abs(x[..., :n] - start[..., :n]).max(axis=-1))


def design_matrix(predict: Predict, scales: Floats, at: Floats) -> Floats:
    """Weighted sensitivities of all observations at a point: (n_modes + n_inputs, n_free) array."""
    prior_rows = np.eye(at.size)[n_constants(predict) :]
    return np.concatenate([sensitivities(predict, at) / scales[:, None], prior_rows])


def sensitivities(predict: Predict, at: Floats) -> Floats:
    """Sensitivities of ln f to all parameters at a point, by differences: (n_modes, n_free) array.

    Those of its tangent where the predictor has one: a single solution of the modes gives them all.
    """
    steps = _STEP * np.eye(at.size)
    law = predict.tangent(at) if isinstance(predict, Predictor) else predict
    log_frequencies = law(np.concatenate([at + steps, at - steps]))
    return np.asarray(((log_frequencies[: at.size] - log_frequencies[at.size :]) / (2 * _STEP)).T)
