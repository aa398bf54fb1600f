"""How probable readings are where the constants are left open: to first order, at several levels of noise."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def log_probability(residuals: Floats, constants: Floats, variances: Floats, inputs: Floats | None = None) -> Floats:
    """ln of the probability density of the readings under flat priors of the logarithms of the constants.

    Parameters
    ----------
    residuals : (n_modes,) or (n_sets, n_modes) array
        ln measured - ln predicted, at some constants and at the middle of the inputs' priors.
    constants : (n_modes, 3) array
        Sensitivities of ln f to the logarithms of the constants.
    variances : (n_levels, n_modes) array
        Of each reading's error, level by level.
    inputs : (n_modes, n_inputs) array, optional
        Sensitivities to the uncertain inputs, each of which has a standard normal prior.

    Returns
    -------
    (n_levels,) or (n_levels, n_sets) array
    """
    covariance = variances[:, :, None] * np.eye(residuals.shape[-1])
    if inputs is not None:
        covariance = covariance + inputs @ inputs.T
    precision = np.linalg.inv(covariance)
    weighted = precision @ constants
    information = constants.T @ weighted
    seen = np.linalg.solve(information, np.swapaxes(weighted, 1, 2))
    squares = np.stack([np.sum((residuals @ one) * residuals, axis=-1) for one in precision - weighted @ seen])
    volumes = np.linalg.slogdet(covariance)[1] + np.linalg.slogdet(information)[1]
    volumes += (residuals.shape[-1] - constants.shape[1]) * np.log(2.0 * np.pi)
    return np.asarray(-0.5 * (squares + volumes.reshape(-1, *[1] * (squares.ndim - 1))))
