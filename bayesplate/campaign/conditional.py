"""The density of one board, given the shared parameters."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.campaign.shared import SharedParameter
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.target import Posterior


@dataclass(frozen=True, eq=False)
class ConditionalPosterior:
    """A board's posterior as a density of its own parameters, given the shared ones."""

    posterior: Posterior  # of the board by itself, under its law or a surrogate of it
    shared: tuple[SharedParameter, ...]

    @property
    def _parameters(self) -> Parameters:
        return self.posterior.parameters

    @cached_property
    def _shared_by_column(self) -> dict[int, int]:
        """Index of the shared parameter that sets a column of the board, by column."""
        names, first = self._parameters.inputs, self._parameters.first_input
        return {
            first + names.index(parameter.name): i
            for i, shared in enumerate(self.shared)
            for parameter in shared.parameters(self.posterior.board)
        }

    @cached_property
    def own_columns(self) -> NDArray[np.intp]:
        """Columns of the board's own parameters."""
        return np.array([i for i in range(self._parameters.n_dim) if i not in self._shared_by_column], dtype=np.intp)

    @property
    def is_one_to_one(self) -> bool:
        """Whether each shared parameter sets one column of the board, and not one of each setup."""
        return len(self._shared_by_column) == len(self.shared)

    def z_of(self, theta: Floats) -> Floats:
        """Standard coordinates of the shared parameters at draws of the board: (n_draws, n_shared) array.

        Where each setup of the board has its own, that of the first setup.
        """
        values = self._parameters.values(theta)
        z = np.empty((len(theta), len(self.shared)))
        for i, shared in enumerate(self.shared):
            name = shared.parameters(self.posterior.board)[0].name
            z[:, i] = shared.prior.standard(shared.from_board(values[name], values))
        return z

    def theta(self, own_theta: Floats, z: Floats) -> Floats:
        """All columns of the board, (n_draws, n_dim), from its own ones, (n_draws, n_own), and the shared z,
        (n_draws, n_shared)."""
        theta = np.zeros((len(own_theta), self._parameters.n_dim))
        theta[:, self.own_columns] = own_theta
        values = self._parameters.values(theta)
        for column, i in self._shared_by_column.items():
            shared = self.shared[i]
            prior = self._parameters.uncertain[column - self._parameters.first_input].prior
            with np.errstate(over="ignore", invalid="ignore"):  # an extreme z gives infinity, which has no density
                of_board = shared.of_board(np.asarray(shared.prior.value(z[:, i])), values)
                theta[:, column] = prior.standard(of_board)
        return theta

    def log_density(self, own_theta: Floats, z: Floats) -> Floats:
        """ln of the likelihood times the prior of the board's own parameters: (n_draws,) array; -inf where it is 0."""
        theta = self.theta(own_theta, z)
        total = self._log_prior_of_own(theta)
        inside = np.isfinite(total) & np.isfinite(theta).all(axis=1)
        total[~inside] = -np.inf
        if inside.any():
            total[inside] += self.posterior.log_likelihood(theta[inside]).sum(axis=1)
        return np.nan_to_num(total, nan=-np.inf, neginf=-np.inf)

    def log_reweighting(self, theta: Floats) -> Floats:
        """ln of the campaign's prior over the board's own prior at draws of the board: (n_draws,) array.

        Zero where a value is shared under the board's own prior.
        """
        values = self._parameters.values(theta)
        total = np.zeros(len(theta))
        for shared in self.shared:
            if shared.ratio_to:
                (parameter,) = shared.parameters(self.posterior.board)
                ratio = shared.from_board(values[parameter.name], values)
                with np.errstate(invalid="ignore"):
                    total += shared.prior.log_density_of_log(np.log(ratio))
                    total -= parameter.prior.log_density_of_log(np.log(values[parameter.name]))
        return np.nan_to_num(total, nan=-np.inf, neginf=-np.inf)

    def _log_prior_of_own(self, theta: Floats) -> Floats:
        """Log prior density of the own columns: (n_draws,) array."""
        parameters = self._parameters
        total = self.posterior.log_prior_constants(theta) + parameters.log_prior_noise(theta)
        for i, parameter in enumerate(parameters.uncertain, start=parameters.first_input):
            if i not in self._shared_by_column:
                total += parameter.prior.log_prior(theta[:, i])
        return total
