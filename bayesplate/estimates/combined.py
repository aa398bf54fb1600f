"""Combined modes: mixtures of the measured modes that would each answer to one constant alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

COMBINED = ("alpha", "beta", "gamma")
"""For D_x, D_y and D_s."""


def combination(coefficients: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much of each mode makes each combined mode, (3, n_modes): the inverse of X = (a, b, c) by Moore and Penrose.

    Its product with X is the unit matrix: the combined psi are d_x, d_y and d_s (Ducceschi et al., section 3).
    ValueError if the modes do not separate the three constants.
    """
    if coefficients.shape[0] < 3 or np.linalg.matrix_rank(coefficients) < 3:
        raise ValueError(f"combined modes: wanted modes that tell three constants apart, got {len(coefficients)} modes")
    return np.asarray(np.linalg.pinv(coefficients))


def combined_shapes(coefficients: NDArray[np.float64], shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shapes of the combined modes alpha, beta and gamma, (3, n_x, n_y), from (n_modes, n_x, n_y) shapes on one grid.

    Each mode enters with unit norm, positive next to the corner of x1 and y1: the paper does not state its signs, and
    the combined shapes depend on them.
    """
    norms = np.sqrt(np.sum(shapes**2, axis=(1, 2)))
    units = shapes * (corner_signs(shapes) / norms)[:, None, None]
    return np.asarray(np.tensordot(combination(coefficients), units, axes=1))


def corner_signs(shapes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Sign of each shape next to the corner of x1 and y1, where held edges may be zero themselves."""
    n_x, n_y = shapes.shape[1] // 10 + 2, shapes.shape[2] // 10 + 2
    near = shapes[:, -n_x:, -n_y:].sum(axis=(1, 2))
    return np.where(near < 0, -1.0, 1.0)
