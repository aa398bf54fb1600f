"""The sampled parameters: logarithms of rigidities and of each setup's noise, a standard normal for each input."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.effects import is_effect_parameter
from bayesplate.estimates.refit import Bounds
from bayesplate.plate.board import Board, Values
from bayesplate.plate.material import RIGIDITIES

N_RIGIDITIES = len(RIGIDITIES)


@dataclass(frozen=True)
class Parameters:
    """Names, order and meaning of the columns that are sampled.

    Columns: ln D_x, ln D_y, ln D_s (N m); ln of the relative noise, one a setup; the standard coordinate z of each
    uncertain input of the card (`bayesplate.quantities`).

    Attributes
    ----------
    board : Board
    """

    board: Board

    @property
    def n_setups(self) -> int:
        """Number of setups."""
        return len(self.board.setups)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the uncertain inputs, in the order of their columns."""
        return tuple(self.board.uncertain_inputs)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        noises = [f"log_noise[{setup.name}]" for setup in self.board.setups]
        return (*(f"log_{name}" for name in RIGIDITIES), *noises, *(f"z[{name}]" for name in self.inputs))

    @property
    def n_dim(self) -> int:
        """Number of columns."""
        return N_RIGIDITIES + self.n_setups + len(self.inputs)

    @property
    def fitted_columns(self) -> NDArray[np.intp]:
        """Columns that frequencies depend on: all but the noise."""
        return np.r_[:N_RIGIDITIES, N_RIGIDITIES + self.n_setups : self.n_dim]

    @property
    def effect_columns(self) -> list[int]:
        """Columns of the parameters of effects."""
        return [i for i, n in enumerate(self.inputs, start=N_RIGIDITIES + self.n_setups) if is_effect_parameter(n)]

    @property
    def fitted_bounds(self) -> Bounds:
        """Limits of the fitted columns: those of the inputs' priors."""
        lower, upper = np.full(self.n_dim, -np.inf), np.full(self.n_dim, np.inf)
        for i, quantity in enumerate(self.board.uncertain_inputs.values(), start=N_RIGIDITIES + self.n_setups):
            lower[i] = float(quantity.standard(quantity.lower)) if np.isfinite(quantity.lower) else -np.inf
            upper[i] = float(quantity.standard(quantity.upper)) if np.isfinite(quantity.upper) else np.inf
        return Bounds(lower[self.fitted_columns], upper[self.fitted_columns])

    def values(self, theta: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Rigidities and inputs by name, SI; (n_draws,) arrays, or numbers for exact inputs.

        Parameters
        ----------
        theta : (n_draws, n_dim) array
        """
        values: dict[str, NDArray[np.float64]] = {}
        for name, quantity in self.board.inputs.items():
            if quantity.is_exact:
                values[name] = np.asarray(quantity.mean)
            else:
                values[name] = quantity.value(self._z(theta, name))
        return values | {name: np.exp(theta[:, i]) for i, name in enumerate(RIGIDITIES)}

    def log_noise(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """ln of the relative noise: (n_draws, n_setups) array."""
        return theta[:, N_RIGIDITIES : N_RIGIDITIES + self.n_setups]

    def log_prior_inputs(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log density of the input columns: (n_draws,) array."""
        total = np.zeros(theta.shape[0])
        for name, quantity in self.board.uncertain_inputs.items():
            total += quantity.log_prior(self._z(theta, name))
        return total

    def theta(self, values: Values, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Columns of one point from rigidities, inputs and relative noises: (n_dim,) array; inverse of `values`."""
        inputs = [float(q.standard(values[name])) for name, q in self.board.uncertain_inputs.items()]
        return np.array([*(np.log(float(values[n])) for n in RIGIDITIES), *np.log(noise), *inputs])

    def _z(self, theta: NDArray[np.float64], name: str) -> NDArray[np.float64]:
        return theta[:, N_RIGIDITIES + self.n_setups + self.inputs.index(name)]
