"""The sampled parameters: logarithms of rigidities and of each setup's noise, a standard normal for each input."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Parameter
from bayesplate.estimates.refit import Bounds


@dataclass(frozen=True)
class Parameters:
    """Names, order and meaning of the columns that are sampled.

    Columns: ln D_x, ln D_y, ln D_s (N m), of an isotropic board ln D alone; ln of the relative noise, one per setup;
    the standard coordinate z of each uncertain parameter of the board (`bayesplate.board.quantity`).
    """

    board: Board

    @property
    def n_constants(self) -> int:
        """Number of free rigidities: the first columns."""
        return self.board.symmetry.n

    @property
    def n_setups(self) -> int:
        """Number of setups."""
        return len(self.board.setups)

    @cached_property
    def noises(self) -> tuple[Parameter, ...]:
        """The relative noise of each setup."""
        return tuple(setup.noise_parameter for setup in self.board.setups)

    @property
    def uncertain(self) -> tuple[Parameter, ...]:
        """The uncertain parameters of the board, in the order of their columns."""
        return self.board.uncertain

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(parameter.name for parameter in self.uncertain)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        noises = [f"log_{noise.name}" for noise in self.noises]
        return (*(f"log_{name}" for name in self.board.symmetry.free), *noises, *(f"z[{name}]" for name in self.inputs))

    @property
    def first_input(self) -> int:
        """Column of the first uncertain parameter of the board."""
        return self.n_constants + self.n_setups

    @cached_property
    def n_dim(self) -> int:
        """Number of columns."""
        return self.first_input + len(self.inputs)

    @cached_property
    def fitted_columns(self) -> NDArray[np.intp]:
        """Columns that frequencies depend on: all but the noise."""
        return np.r_[: self.n_constants, self.first_input : self.n_dim]

    @cached_property
    def effect_columns(self) -> list[int]:
        """Columns of the sizes of effects."""
        return [i for i, one in enumerate(self.uncertain, start=self.first_input) if one.is_of_effect]

    @cached_property
    def fitted_bounds(self) -> Bounds:
        """Limits of the fitted columns: those of the priors."""
        lower, upper = np.full(self.n_dim, -np.inf), np.full(self.n_dim, np.inf)
        for i, parameter in enumerate(self.uncertain, start=self.first_input):
            lower[i], upper[i] = parameter.prior.standard_bounds
        return Bounds(lower[self.fitted_columns], upper[self.fitted_columns])

    @cached_property
    def _exact(self) -> dict[str, NDArray[np.float64]]:
        return {name: np.asarray(prior.mean) for name, prior in self.board.inputs.items() if prior.is_exact}

    def values(self, theta: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Rigidities and inputs by name, SI; (n_draws,) arrays, or numbers for exact inputs.

        Parameters
        ----------
        theta : (n_draws, n_dim) array
        """
        values = dict(self._exact)
        for i, parameter in enumerate(self.uncertain, start=self.first_input):
            values[parameter.name] = parameter.prior.value(theta[:, i])
        free = [np.exp(theta[:, i]) for i in range(self.n_constants)]
        values.update(self.board.symmetry.rigidities(free, values["poisson_xy"]))
        return values

    def values_at(self, theta: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Constants and inputs at one point, each a number, from its (n_dim,) columns."""
        return {name: np.asarray(np.ravel(value)[0]) for name, value in self.values(theta[None, :]).items()}

    def log_noise(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """ln of the relative noise: (n_draws, n_setups) array."""
        return theta[:, self.n_constants : self.first_input]

    def log_prior_inputs(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log density of the input columns: (n_draws,) array."""
        z = theta[:, self.first_input :]
        lower, upper, level = self._input_priors
        inside = ((z >= lower) & (z <= upper)).all(axis=1)
        return np.where(inside, level - 0.5 * np.einsum("ni,ni->n", z, z), -np.inf)

    @cached_property
    def _input_priors(self) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
        """Bounds of the input columns, and what their log density is beside -z^2 / 2 between them."""
        priors = [parameter.prior for parameter in self.uncertain]
        lower, upper = np.array([prior.standard_bounds for prior in priors]).reshape(-1, 2).T
        inside = np.clip(0.0, lower, upper)
        heights = [float(prior.log_prior(z)) + 0.5 * z**2 for prior, z in zip(priors, inside, strict=True)]
        return lower, upper, sum(heights)

    def log_prior_noise(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        """Log density of the columns of noise: (n_draws,) array."""
        total = np.zeros(theta.shape[0])
        for log_noise, noise in zip(self.log_noise(theta).T, self.noises, strict=True):
            total += noise.prior.log_density_of_log(log_noise)
        return total

    def theta(self, values: Values, noise: NDArray[np.float64]) -> NDArray[np.float64]:
        """Columns of one point from rigidities, inputs and relative noises: (n_dim,) array; inverse of `values`."""
        inputs = [float(one.prior.standard(values[one.name])) for one in self.uncertain]
        return np.array([*np.log(self.board.symmetry.free_of(values)), *np.log(noise), *inputs])
