"""Given functions as unknowns of a plate's sides, and deflections made of them."""

from __future__ import annotations

import numpy as np
from numpy.polynomial import Polynomial

from bayesplate.plate.terms import Deflections, Parity


def unknowns(side, value, slope):
    """Values and slopes at the nodes of a side: (n_functions,) array."""
    return np.column_stack([np.broadcast_to(one(side.nodes), side.nodes.shape) for one in (value, slope)]).ravel()


def power(side, degree):
    """Those of x^degree."""
    one = Polynomial.basis(degree)
    return unknowns(side, one, one.deriv())


def deflections(x, y, grids, parity=(0, 0)):
    """Deflections of (n_vectors, n_functions_x, n_functions_y) unknowns."""
    return Deflections(x, y, Parity(*parity), np.asarray(grids))
