"""Weighted least squares under any law, with the uncertain inputs moving within their priors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Predict = Callable[[Floats], Floats]
"""From (n_draws, n_free) parameters to (n_draws, n_modes) logarithms of frequencies.

The parameters are ln D_x, ln D_y, ln D_s, and the standard coordinates of the uncertain inputs, each of which counts
as one more observation: zero with standard deviation one.
"""

N_CONSTANTS = 3
_STEP = 1e-5


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
    """Parameters that minimise the weighted squares.

    Parameters
    ----------
    predict : callable
        See `Predict`.
    target : (n_modes,) array
        ln of the measured frequencies; not a number leaves a mode out.
    scales : (n_modes,) array
        Relative uncertainties.
    start : (n_free,) array
        Within the bounds.
    bounds : Bounds, optional

    Returns
    -------
    (n_free,) array
    """
    from scipy.optimize import least_squares

    used = np.isfinite(target)

    def residuals(x: Floats) -> Floats:
        misfits = (predict(x[None, :])[0] - target)[used] / scales[used]
        return np.concatenate([misfits, x[N_CONSTANTS:]])

    def jacobian(x: Floats) -> Floats:
        return design(predict, scales, x)[np.r_[used, np.ones(x.size - N_CONSTANTS, dtype=bool)]]

    if bounds is None or bounds.are_open:
        return np.asarray(least_squares(residuals, start, jacobian, method="lm", xtol=1e-12, ftol=1e-12).x)
    limits = (bounds.lower, bounds.upper)
    return np.asarray(least_squares(residuals, start, jacobian, bounds=limits, x_scale="jac").x)


def design(predict: Predict, scales: Floats, at: Floats) -> Floats:
    """Weighted sensitivities of all observations at a point: (n_modes + n_inputs, n_free) array."""
    steps = _STEP * np.eye(at.size)
    both = predict(np.concatenate([at + steps, at - steps]))
    slopes = ((both[: at.size] - both[at.size :]) / (2 * _STEP)).T / scales[:, None]
    return np.concatenate([slopes, np.eye(at.size)[N_CONSTANTS:]])
