"""The sampled parameters: logarithms of rigidities and of each setup's noise, a standard normal for each input."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats, Indices
from bayesplate.board.board import Board, Values
from bayesplate.board.parameter import Parameter
from bayesplate.estimates.refit import Bounds


@dataclass(frozen=True)
class Parameters:
    """Names, order and meaning of the sampled columns.

    Columns: ln D_x, ln D_y, ln D_s (N m), of an isotropic board ln D alone; ln of the relative noise, one per setup;
    the standard coordinate z of each uncertain parameter of the board (`bayesplate.board.quantity`).
    """

    board: Board

    @property
    def n_constants(self) -> int:
        """Number of free rigidities, which are the first columns."""
        return self.board.symmetry.n

    @property
    def n_setups(self) -> int:
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
        """Names of the uncertain parameters."""
        return tuple(parameter.name for parameter in self.uncertain)

    @cached_property
    def names(self) -> tuple[str, ...]:
        noises = [f"log_{noise.name}" for noise in self.noises]
        return (*(f"log_{name}" for name in self.board.symmetry.free), *noises, *(f"z[{name}]" for name in self.inputs))

    @property
    def first_input(self) -> int:
        """Column of the first uncertain parameter of the board."""
        return self.n_constants + self.n_setups

    @cached_property
    def n_dim(self) -> int:
        return self.first_input + len(self.inputs)

    @cached_property
    def fitted_columns(self) -> Indices:
        """Columns that the frequencies depend on: all but the noise."""
        return np.r_[: self.n_constants, self.first_input : self.n_dim]

    @cached_property
    def effect_columns(self) -> list[int]:
        """Columns of the sizes of effects."""
        return [i for i, parameter in enumerate(self.uncertain, start=self.first_input) if parameter.is_of_effect]

    @cached_property
    def fitted_bounds(self) -> Bounds:
        """Limits of the fitted columns: those of the priors."""
        lower, upper = np.full(self.n_dim, -np.inf), np.full(self.n_dim, np.inf)
        for i, parameter in enumerate(self.uncertain, start=self.first_input):
            lower[i], upper[i] = parameter.prior.standard_bounds
        return Bounds(lower[self.fitted_columns], upper[self.fitted_columns])

    def within_bounds(self, theta: Floats) -> Floats:
        """(n_draws, n_dim) theta, its fitted columns moved within their limits."""
        theta, columns, limits = theta.copy(), self.fitted_columns, self.fitted_bounds
        theta[:, columns] = np.clip(theta[:, columns], limits.lower, limits.upper)
        return theta

    @cached_property
    def _exact(self) -> dict[str, Floats]:
        return {name: np.asarray(prior.mean) for name, prior in self.board.inputs.items() if prior.is_exact}

    def values(self, theta: Floats) -> dict[str, Floats]:
        """Rigidities and inputs by name, SI, from (n_draws, n_dim) theta: (n_draws,) arrays, numbers if exact."""
        values = dict(self._exact)
        for i, parameter in enumerate(self.uncertain, start=self.first_input):
            values[parameter.name] = parameter.prior.value(theta[:, i])
        free = [np.exp(theta[:, i]) for i in range(self.n_constants)]
        values.update(self.board.symmetry.rigidities(free, values["poisson_xy"]))
        return values

    def values_at(self, theta: Floats) -> dict[str, Floats]:
        """Constants and inputs at one point, each a number, from its (n_dim,) columns."""
        return {name: np.asarray(np.ravel(value)[0]) for name, value in self.values(theta[None, :]).items()}

    def log_noise(self, theta: Floats) -> Floats:
        """ln of the relative noise: (n_draws, n_setups) array."""
        return theta[:, self.n_constants : self.first_input]

    def log_widenings(self, theta: Floats) -> Floats:
        """ln of the noise at one point over the median of its prior: (n_setups,) array."""
        medians = np.array([setup.noise.median for setup in self.board.setups])
        return self.log_noise(theta[None])[0] - np.log(medians)

    def log_widening(self, theta: Floats) -> float:
        """The largest of `log_widenings`."""
        return float(np.max(self.log_widenings(theta)))

    def log_prior_inputs(self, theta: Floats) -> Floats:
        """Log density of the input columns: (n_draws,) array."""
        z = theta[:, self.first_input :]
        lower, upper, level = self._input_priors
        inside = ((z >= lower) & (z <= upper)).all(axis=1)
        return np.where(inside, level - 0.5 * np.einsum("ni,ni->n", z, z), -np.inf)

    @cached_property
    def _input_priors(self) -> tuple[Floats, Floats, float]:
        """Bounds of the input columns, and the constant of their log density: constant - z^2 / 2."""
        priors = [parameter.prior for parameter in self.uncertain]
        lower, upper = np.array([prior.standard_bounds for prior in priors]).reshape(-1, 2).T
        inside = np.clip(0.0, lower, upper)
        heights = [float(prior.log_prior(z)) + 0.5 * z**2 for prior, z in zip(priors, inside, strict=True)]
        return lower, upper, sum(heights)

    def log_prior_noise(self, theta: Floats) -> Floats:
        """Log density of the columns of noise: (n_draws,) array."""
        total = np.zeros(theta.shape[0])
        for log_noise, noise in zip(self.log_noise(theta).T, self.noises, strict=True):
            total += noise.prior.log_density_of_log(log_noise)
        return total

    def theta(self, values: Values, noise: Floats) -> Floats:
        """Columns of one point from rigidities, inputs and relative noises: (n_dim,) array; inverse of `values`."""
        inputs = [float(parameter.prior.standard(values[parameter.name])) for parameter in self.uncertain]
        return np.array([*np.log(self.board.symmetry.free_of(values)), *np.log(noise), *inputs])
