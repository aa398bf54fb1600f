"""The distribution of the boards' constants: partial pooling, the next board, and a prior card.

ln E_x, ln E_y and ln G_xy of the boards are normal with a mean and a standard deviation of the population, each
constant by itself. A fit determines a board's constants to a few percent, so that the likelihood of their logarithms is
normal with a mean m and a covariance C after division by the prior of the fit. Then all is closed form:

    m of a board ~ N(mean, C + sd^2),        its constants given the population ~ N((C^-1 + sd^-2)^-1 ..).

The shared numbers move the constants of all boards together, so that more boards do not average their error out: m is
then the mean given the shared numbers, linear in them, and their deviation from their mean is sampled too. Numbers that
scatter between boards count as each board's own.

References
----------
A. Gelman, Prior distributions for variance parameters in hierarchical models, Bayesian Analysis 1 (2006). [half-normal]
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.material import MODULI
from bayesplate.board.prior import PriorCard
from bayesplate.board.quantity import Quantity
from bayesplate.errors import Fault, InputError
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.draws import Draws
from bayesplate.posterior.sampling import Chains, SamplerSettings, sample

_LEAST_SD = 1e-3
"""Standard deviation of ln E below which a population has none for all practical purposes."""
_N_CONSTANTS = len(MODULI)


@dataclass(frozen=True, eq=False)
class BoardConstants:
    """A board's normal likelihood of ln E_x, ln E_y, ln G_xy (Pa), given what is shared."""

    name: str
    mean: Floats  # (3,) array
    covariance: Floats  # (3, 3) array, where the shared numbers are known
    # (3, n_shared) array: slope of the mean on the standard coordinates of the shared numbers that do not scatter
    slopes: Floats = field(default_factory=lambda: np.zeros((_N_CONSTANTS, 0)))

    @classmethod
    def of(cls, draws: Draws, shared: Floats | None = None) -> BoardConstants:
        """The likelihood from the posterior of a board, the prior of its constants divided out.

        `shared` are standard coordinates of the shared numbers at the draws, (n_draws, n_shared).
        """
        name = draws.problem.board.name
        logs = np.column_stack([np.log(draws.moduli[name]).ravel() for name in MODULI])
        log_prior = draws.problem.posterior.log_prior_constants(draws.flat)
        weights = np.exp(log_prior.min() - log_prior)
        mean = np.average(logs, axis=0, weights=weights)
        shared = np.empty((len(logs), 0)) if shared is None else shared
        joint_covariance = np.cov(np.column_stack([logs, shared]).T, aweights=weights)
        cross_covariance, shared_covariance = (
            joint_covariance[:_N_CONSTANTS, _N_CONSTANTS:],
            joint_covariance[_N_CONSTANTS:, _N_CONSTANTS:],
        )
        slopes = np.linalg.solve(shared_covariance, cross_covariance.T).T
        return cls(name, mean, joint_covariance[:_N_CONSTANTS, :_N_CONSTANTS] - slopes @ cross_covariance.T, slopes)


@dataclass(frozen=True, eq=False)
class Population:
    """The posterior of the distribution of the boards' constants."""

    boards: tuple[BoardConstants, ...]
    # of the means of ln E_x, ln E_y, ln G_xy, then ln of their standard deviations, then the deviations of the shared
    # numbers from their mean
    chains: Chains
    convergence: Convergence
    # (n_shared, n_shared) array: covariance of the standard coordinates of the shared numbers, from all boards
    common: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def means(self) -> Floats:
        """Draws of the mean of ln E (Pa): (n_draws, 3) array."""
        return self.chains.pooled[:, :_N_CONSTANTS]

    @property
    def sds(self) -> Floats:
        """Draws of the standard deviation of ln E: (n_draws, 3) array."""
        return np.exp(self.chains.pooled[:, _N_CONSTANTS : 2 * _N_CONSTANTS])

    def next_board(self, rng: np.random.Generator) -> Floats:
        """Draws of ln E_x, ln E_y, ln G_xy of a board that has not been measured: (n_draws, 3) array."""
        return self.means + self.sds * rng.standard_normal(self.means.shape)

    def pooled(self, board: int, rng: np.random.Generator) -> Floats:
        """Draws of ln E of a board under the population: (n_draws, 3) array."""
        constants = self.boards[board]
        own_precision = np.linalg.inv(constants.covariance)
        precision = own_precision + _diagonal(self.sds**-2.0)
        mean = (
            constants.mean
            + self.chains.pooled[:, 2 * _N_CONSTANTS :] @ np.linalg.cholesky(self.common).T @ constants.slopes.T
        )
        lean = mean @ own_precision + self.means * self.sds**-2.0
        middle = np.linalg.solve(precision, lean[:, :, None])
        factor = np.swapaxes(np.linalg.cholesky(precision), 1, 2)
        normal = rng.standard_normal((*lean.shape, 1))
        return np.asarray((middle + np.linalg.solve(factor, normal))[:, :, 0])


def find_population(
    boards: Sequence[BoardConstants], prior: PriorCard, settings: SamplerSettings, common: Floats | None = None
) -> Population:
    """Sample the mean and the standard deviation of the constants of the population.

    The prior's medians and factors are the prior of the mean; the standard deviation of ln E is half-normal on the
    scale of the factor. `common` is the covariance of the standard coordinates of the shared numbers, whose error is
    the same on all boards: the mean of many boards does not average it out.
    """
    common = np.zeros((0, 0)) if common is None else common
    shared_slopes = np.array([board.slopes @ np.linalg.cholesky(common) for board in boards])
    n_shared = len(common)
    middle = np.array([np.log(prior.constants[name].median) for name in MODULI])
    width = np.array([prior.constants[name].log_sd for name in MODULI])
    board_means = np.array([board.mean for board in boards])
    covariances = np.array([board.covariance for board in boards])
    mean_variance = np.diagonal(covariances, axis1=1, axis2=2).mean(axis=0)
    spread = np.sqrt(np.maximum(board_means.var(axis=0, ddof=1) - mean_variance, 0.0) + (0.1 * width) ** 2)

    def log_posterior(theta: Floats) -> Floats:
        means, log_sds, offsets = np.split(theta, [_N_CONSTANTS, 2 * _N_CONSTANTS], axis=1)
        sds = np.exp(np.clip(log_sds, np.log(_LEAST_SD), None))
        total = -0.5 * (((means - middle) / width) ** 2 + (sds / width) ** 2).sum(axis=1) + log_sds.sum(axis=1)
        total -= 0.5 * (offsets**2).sum(axis=1)
        shifted_means = board_means[None] + np.einsum("bck,nk->nbc", shared_slopes, offsets)
        factors = np.linalg.cholesky(covariances[None] + _diagonal(sds**2)[:, None])
        whitened = np.linalg.solve(factors, (shifted_means - means[:, None])[..., None])[..., 0]
        total -= 0.5 * (whitened**2).sum(axis=(1, 2))
        total -= np.log(np.diagonal(factors, axis1=2, axis2=3)).sum(axis=(1, 2))
        return np.where((log_sds < np.log(_LEAST_SD)).any(axis=1), -np.inf, total)

    n = len(boards)
    centre = np.concatenate([board_means.mean(axis=0), np.log(spread), np.zeros(n_shared)])
    covariance = np.diag(np.concatenate([spread**2 / n, np.full(_N_CONSTANTS, 0.5 / n), np.ones(n_shared)]))
    along = shared_slopes.mean(axis=0)  # the mean moves with the deviation of the shared numbers
    covariance[:_N_CONSTANTS, :_N_CONSTANTS] += along @ along.T
    covariance[:_N_CONSTANTS, 2 * _N_CONSTANTS :] = along
    covariance[2 * _N_CONSTANTS :, :_N_CONSTANTS] = along.T
    names = [f"{what} of ln {name}" for what in ("mean", "ln sd") for name in MODULI]
    names += [f"shared number {i}" for i in range(n_shared)]
    chains, convergence = sample(log_posterior, centre, covariance, settings, names=names)
    return Population(tuple(boards), chains, convergence, common)


def require_moduli(prior: PriorCard, place: str) -> None:
    """InputError where a prior card states rigidities, which go with each board's thickness, or E alone."""
    wanted = "a prior card of E_x, E_y, G_xy"
    if prior.is_of_isotropic:
        raise InputError(Fault(place, wanted, f"{prior.name}, which states E alone"))
    if set(prior.constants) != set(MODULI):
        raise InputError(Fault(place, wanted, f"{prior.name}, one of D_x, D_y, D_s, which go with the thickness"))


def next_board_prior(population: Population, name: str, source: str, rng: np.random.Generator) -> PriorCard:
    """The prediction of the next board's constants, as a prior card.

    Each constant is log-normal with the mean and standard deviation of the prediction's logarithm.
    """
    predicted = population.next_board(rng)
    constants = {
        key: Quantity.from_median(float(np.exp(values.mean())), float(np.exp(values.std())))
        for key, values in zip(MODULI, predicted.T, strict=True)
    }
    return PriorCard.from_quantities(name, constants, source=source)


def _diagonal(values: Floats) -> Floats:
    """Diagonal matrices: (n, k, k) array from (n, k)."""
    return np.asarray(values[:, :, None] * np.eye(values.shape[1]))
