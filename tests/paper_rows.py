"""The paper's a, b, c from the energies of a thin plate's modes on the unit square."""

from __future__ import annotations

import numpy as np


def paper_coefficients(coefficients: np.ndarray, aspect_ratio: float, nu_xy: float) -> np.ndarray:
    """(n_modes, 3) a, b, c of omega^2 = lambda (a D_x + b D_y + c D_s) from (n_modes, 4): eq. (12)."""
    xx, yy, mix, xy = coefficients.T
    return np.column_stack([xx / aspect_ratio**2, yy * aspect_ratio**2 + nu_xy * mix, xy])
