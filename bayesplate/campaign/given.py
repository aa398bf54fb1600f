"""The density of one board where what is shared is given."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.campaign.shared import Shared
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.target import Posterior


@dataclass(frozen=True, eq=False)
class GivenShared:
    """A board's posterior as a density of what is its own, given the shared parameters."""

    posterior: Posterior  # of the board by itself, under its law or a surrogate of it
    shared: tuple[Shared, ...]

    @property
    def _parameters(self) -> Parameters:
        return self.posterior.parameters

    @cached_property
    def _set(self) -> dict[int, int]:
        """Column of the board -> index of the shared parameter that sets it."""
        names, first = self._parameters.inputs, self._parameters.first_input
        return {
            first + names.index(one.name): i
            for i, shared in enumerate(self.shared)
            for one in shared.parameters(self.posterior.board)
        }

    @cached_property
    def own_columns(self) -> NDArray[np.intp]:
        """Columns that are the board's own."""
        return np.array([i for i in range(self._parameters.n_dim) if i not in self._set], dtype=np.intp)

    @property
    def is_one_to_one(self) -> bool:
        """Whether each shared parameter is one of the board's; setups with one each have several, equal when shared."""
        return len(self._set) == len(self.shared)

    def z_of(self, theta: Floats) -> Floats:
        """Standard coordinates of the shared parameters that draws of the board amount to: (n_draws, n_shared) array.

        Where several setups of the board have their own, that of the first.
        """
        values = self._parameters.values(theta)
        found = np.empty((len(theta), len(self.shared)))
        for i, shared in enumerate(self.shared):
            name = shared.parameters(self.posterior.board)[0].name
            found[:, i] = shared.prior.standard(shared.from_board(values[name], values))
        return found

    def theta(self, own: Floats, z: Floats) -> Floats:
        """All columns of the board, (n_draws, n_dim), from its own, (n_draws, n_own), and shared z, (n_draws,
        n_shared)."""
        theta = np.zeros((len(own), self._parameters.n_dim))
        theta[:, self.own_columns] = own
        values = self._parameters.values(theta)
        for column, i in self._set.items():
            shared = self.shared[i]
            prior = self._parameters.uncertain[column - self._parameters.first_input].prior
            with np.errstate(over="ignore", invalid="ignore"):  # far out it is infinite, and has no density
                of_board = shared.of_board(np.asarray(shared.prior.value(z[:, i])), values)
                theta[:, column] = prior.standard(of_board)
        return theta

    def log_density(self, own: Floats, z: Floats) -> Floats:
        """ln of the likelihood times the prior of what is the board's own: (n_draws,) array; -inf where it is zero."""
        theta = self.theta(own, z)
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
            if shared.to:
                (one,) = shared.parameters(self.posterior.board)
                ratio = shared.from_board(values[one.name], values)
                with np.errstate(invalid="ignore"):
                    total += shared.prior.log_density_of_log(np.log(ratio))
                    total -= one.prior.log_density_of_log(np.log(values[one.name]))
        return np.nan_to_num(total, nan=-np.inf, neginf=-np.inf)

    def _log_prior_of_own(self, theta: Floats) -> Floats:
        """Log prior density of the own columns: (n_draws,) array."""
        parameters = self._parameters
        total = self.posterior.log_prior_constants(theta) + parameters.log_prior_noise(theta)
        for i, one in enumerate(parameters.uncertain, start=parameters.first_input):
            if i not in self._set:
                total += one.prior.log_prior(theta[:, i])
        return total
