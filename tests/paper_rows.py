"""The paper's a, b, c as it prints them, and from the energies of a thin plate's modes on the unit square."""

from __future__ import annotations

import numpy as np

from bayesplate.board.setup import CLAMPED_NOISE, Setup

SETUPS = {
    "cantilever": Setup("cantilever", ("clamped", "free"), ("free", "free"), (), CLAMPED_NOISE, first_label=(1, 0)),
    "clamped": Setup("clamped", ("clamped", "clamped"), ("clamped", "clamped"), (), CLAMPED_NOISE),
}
COEFFICIENTS = {
    "cantilever": {
        (1, 0): (3.21, 0.00, 0.00),
        (1, 1): (3.99, 0.94, 40.5),
        (2, 0): (117.0, 41.9, 13.6),
        (1, 2): (14.4, 1720, 155),
        (2, 1): (124, 15.6, 328),
        (2, 2): (134, 1910, 1260),
    },
    "clamped": {
        (0, 0): (236, 1214, 146.9),
        (0, 1): (237.5, 8589, 552.3),
        (1, 0): (1790, 1652, 534.9),
        (0, 2): (242, 31910, 1196),
        (1, 1): (1792, 10180, 2051),
        (1, 2): (1799, 35250, 4469),
    },
}
"""Tables "Linear fit results": a, b, c by label, in the order of the table; side ratios 223 / 114 and 150 / 103."""


def beams_of(name: str, label: tuple[int, int]) -> tuple[int, int]:
    """Orders of the beam functions behind a label."""
    first = SETUPS[name].first_label
    return label[0] - first[0], label[1] - first[1]


def paper_coefficients(coefficients: np.ndarray, aspect_ratio: float, nu_xy: float) -> np.ndarray:
    """(n_modes, 3) a, b, c of omega^2 = lambda (a D_x + b D_y + c D_s) from (n_modes, 4): eq. (12)."""
    xx, yy, mix, xy = coefficients.T
    return np.column_stack([xx / aspect_ratio**2, yy * aspect_ratio**2 + nu_xy * mix, xy])
