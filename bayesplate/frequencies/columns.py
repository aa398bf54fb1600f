"""Contribution of each rigidity to the squared frequencies: the paper's a, b, c for any plate, and a rest."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Values, board_density, vibrating_lengths
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.setup import Setup
from bayesplate.frequencies.system import System


class ModalCoefficients(NamedTuple):
    """omega^2 / lambda = a D_x + b D_y + c D_s + rest, exact at the point where the modes were computed."""

    coefficients: Floats  # (n_modes, 3): a, b, c
    rest: Floats  # (n_modes,), N m: contribution of shear and other effects; zero for the bare thin plate

    def shares(self, rigidities: Floats) -> Floats:
        """Share of D_x, D_y, D_s and of the rest in each mode's energy: (n_modes, 4) array, rows sum to 1."""
        terms = np.column_stack([self.coefficients * rigidities, self.rest])
        return np.asarray(terms / terms.sum(axis=1, keepdims=True))


def modal_coefficients(system: System, values: Values, stiffness: Floats) -> ModalCoefficients:
    """Coefficients of modes from their (n_modes, n_terms) energies phi' K_i phi: Ducceschi et al., eq. (10, 12)."""
    per_lambda = inverse_lambda(values, system.setup)
    total, without = (squared * per_lambda for squared in squared_frequencies_by_rigidity(system, values, stiffness))
    constants = np.array([float(values[name]) for name in RIGIDITIES])
    coefficients = (total[:, None] - without) / constants
    rest = total - coefficients @ constants
    rest[np.abs(rest) < 1e-9 * total] = 0.0
    return ModalCoefficients(coefficients, rest)


def mean_coefficients(modal: Sequence[ModalCoefficients], frequencies: Floats) -> ModalCoefficients:
    """Coefficients of the square of mean frequencies, of modes at each place of what roved.

    `frequencies` is an (n_places, n_modes) array. Its mean is what is read, so that the mean of the coefficients is
    multiplied by the square of the mean over the mean of the squares.
    """
    share = frequencies.mean(axis=0) ** 2 / (frequencies**2).mean(axis=0)
    coefficients = np.mean([station.coefficients for station in modal], axis=0)
    rest = np.mean([station.rest for station in modal], axis=0)
    return ModalCoefficients(share[:, None] * coefficients, share * rest)


def squared_frequencies_by_rigidity(system: System, values: Values, stiffness: Floats) -> tuple[Floats, Floats]:
    """omega^2 of modes, (n_modes,) s^-2, and omega^2 with D_x, D_y or D_s set to zero, (n_modes, 3)."""
    zeroed = (system.weights({**values, name: 0.0 * values[name]}).stiffness[0] for name in RIGIDITIES)
    without = np.column_stack([stiffness @ weights for weights in zeroed])
    return stiffness @ system.weights(values).stiffness[0], without


def inverse_lambda(values: Values, setup: Setup) -> float:
    """The paper's 1 / lambda = rho h A^2 of a setup at given inputs, kg m^2."""
    length_x, length_y = vibrating_lengths(values, setup)
    return float(board_density(values) * values["thickness"] * (length_x * length_y) ** 2)
