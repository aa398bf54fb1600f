"""What each rigidity gives to the squared frequencies: the paper's a, b, c of any plate, and what they leave over."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Values, density, vibrating_lengths
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.setup import Setup
from bayesplate.frequencies.system import System


class Columns(NamedTuple):
    """omega^2 / lambda = a D_x + b D_y + c D_s + rest, exact at the point where the modes were computed.

    Attributes
    ----------
    coefficients : (n_modes, 3) array
        Columns a, b, c.
    rest : (n_modes,) array, N m
        What shear and other effects give; zero for the bare thin plate.
    """

    coefficients: NDArray[np.float64]
    rest: NDArray[np.float64]

    def shares(self, rigidities: NDArray[np.float64]) -> NDArray[np.float64]:
        """Share of D_x, D_y, D_s and of all the rest in each mode's energy: (n_modes, 4) array, rows sum to 1."""
        parts = np.column_stack([self.coefficients * rigidities, self.rest])
        return np.asarray(parts / parts.sum(axis=1, keepdims=True))


def columns(system: System, values: Values, stiffness: NDArray[np.float64]) -> Columns:
    """Coefficients of modes from their energies in the terms of the plate.

    Parameters
    ----------
    values : dict of float
        D_x, D_y, D_s (N m), the board's inputs and the effects' parameters, where the modes were computed.
    stiffness : (n_modes, n_terms) array
        phi' K_i phi of the mass-normalised modes.

    References
    ----------
    Ducceschi et al., eq. (10) and (12).
    """
    per_lambda = inverse_lambda(values, system.setup)
    total = stiffness @ system.weights(values).stiffness[0] * per_lambda
    found = []
    for name in RIGIDITIES:
        without = system.weights({**values, name: 0.0 * values[name]}).stiffness[0]
        found.append((total - stiffness @ without * per_lambda) / float(values[name]))
    coefficients = np.column_stack(found)
    constants = np.array([float(values[name]) for name in RIGIDITIES])
    rest = total - coefficients @ constants
    rest[np.abs(rest) < 1e-9 * total] = 0.0
    return Columns(coefficients, rest)


def inverse_lambda(values: Values, setup: Setup) -> float:
    """The paper's 1 / lambda = rho h A^2 of a setup at given inputs, kg m^2."""
    length_x, length_y = vibrating_lengths(values, setup)
    return float(density(values) * values["thickness"] * (length_x * length_y) ** 2)
