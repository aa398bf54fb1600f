"""Wrong posteriors that calibration has to find out: draws too close to their mean, and a noise fixed too low."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.setup import DEFAULT_NOISE
from bayesplate.quantities import Quantity

LESS_NOISE = Quantity.from_median(0.7 * DEFAULT_NOISE.median, 1.02)
NARROWER = {"spread 0.7 of itself": 0.7, "spread 0.8 of itself": 0.8}
"""By the mutant's name, what is left of the distance of each draw from their mean."""


def narrowed(draws: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Draws with so much of their distance from their mean: (n_draws, n_dim) array."""
    middle = draws.mean(axis=0)
    return middle + factor * (draws - middle)
