"""How probable readings are where the constants are left open: to first order, at several levels of noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def log_probability(residuals: Floats, constants: Floats, variances: Floats, inputs: Floats | None = None) -> Floats:
    """ln of the probability density of the readings under flat priors of the logarithms of the constants.

    Parameters
    ----------
    residuals : (n_modes,) array
        ln measured - ln predicted, at some constants and at the middle of the inputs' priors.
    constants : (n_modes, 3) array
        Sensitivities of ln f to the logarithms of the constants.
    variances : (n_levels, n_modes) array
        Of each reading's error, level by level.
    inputs : (n_modes, n_inputs) array, optional
        Sensitivities to the uncertain inputs, each of which has a standard normal prior.

    Returns
    -------
    (n_levels,) array
    """
    covariance = variances[:, :, None] * np.eye(residuals.size)
    if inputs is not None:
        covariance = covariance + inputs @ inputs.T
    n_constants = constants.shape[1]
    weighted = np.linalg.solve(covariance, np.column_stack([constants, residuals])[None])
    information = constants.T @ weighted[..., :n_constants]
    seen = constants.T @ weighted[..., n_constants:]
    explained = (np.swapaxes(seen, 1, 2) @ np.linalg.solve(information, seen))[:, 0, 0]
    squares = weighted[..., n_constants] @ residuals - explained
    volumes = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
    return np.asarray(-0.5 * (squares + volumes + (residuals.size - n_constants) * np.log(2.0 * np.pi)))
