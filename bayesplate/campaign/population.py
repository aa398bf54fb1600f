"""The distribution that the boards' constants come from: partial pooling, the next board, and a prior card.

ln E_x, ln E_y and ln G_xy of the boards are normal about a mean and with a standard deviation of the population, each
constant for itself. A board knows its constants to a few per cent, so that its likelihood of their logarithms is normal
with a mean m and a covariance C once the prior that it was fitted under is divided out. Then all is closed form:

    m of a board ~ N(mean, C + sd^2),        its constants given the population ~ N((C^-1 + sd^-2)^-1 ..).

What all boards share moves the constants of all of them together, so that more boards do not average it out: m is then
that given the shared numbers, linear in them, and how far these are off their mean is sampled too. Numbers that scatter
between boards are taken to be each board's own.

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
from bayesplate.posterior.inference import Inference
from bayesplate.posterior.sampling import Chains, SamplerSettings, sample

_STEADY = 1e-3
"""Standard deviation of ln E below which a population has none for all practical purposes."""
_CONSTANTS = len(MODULI)


@dataclass(frozen=True, eq=False)
class BoardConstants:
    """A board's normal likelihood of ln E_x, ln E_y, ln G_xy (Pa), given what is shared."""

    name: str
    mean: Floats  # (3,) array
    covariance: Floats  # (3, 3) array, where the shared numbers are known
    # (3, n_shared) array: what the mean does with the standard coordinates of the shared numbers that all boards have
    # the same
    slopes: Floats = field(default_factory=lambda: np.zeros((_CONSTANTS, 0)))

    @classmethod
    def of(cls, inference: Inference, draws: Draws, shared: Floats | None = None) -> BoardConstants:
        """From the posterior of a board, the prior of its constants divided out.

        `shared` are standard coordinates of the shared numbers at the draws, (n_draws, n_shared).
        """
        name = inference.problem.board.name
        logs = np.column_stack([np.log(draws.moduli[name]).ravel() for name in MODULI])
        log_prior = inference.problem.posterior.log_prior_constants(draws.flat)
        weights = np.exp(log_prior.min() - log_prior)
        mean = np.average(logs, axis=0, weights=weights)
        shared = np.empty((len(logs), 0)) if shared is None else shared
        both = np.cov(np.column_stack([logs, shared]).T, aweights=weights)
        across, of_shared = both[:_CONSTANTS, _CONSTANTS:], both[_CONSTANTS:, _CONSTANTS:]
        slopes = np.linalg.solve(of_shared, across.T).T
        return cls(name, mean, both[:_CONSTANTS, :_CONSTANTS] - slopes @ across.T, slopes)


@dataclass(frozen=True, eq=False)
class Population:
    """What the boards say of the distribution of their constants."""

    boards: tuple[BoardConstants, ...]
    # of mean of ln E_x, ln E_y, ln G_xy, then ln of their standard deviations, then how far the shared numbers are off
    # their mean
    chains: Chains
    convergence: Convergence
    # (n_shared, n_shared) array: covariance of the standard coordinates of the shared numbers, from all boards
    common: Floats = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def means(self) -> Floats:
        """Draws of the mean of ln E (Pa): (n_draws, 3) array."""
        return self.chains.pooled[:, :_CONSTANTS]

    @property
    def sds(self) -> Floats:
        """Draws of the standard deviation of ln E: (n_draws, 3) array."""
        return np.exp(self.chains.pooled[:, _CONSTANTS : 2 * _CONSTANTS])

    def next_board(self, rng: np.random.Generator) -> Floats:
        """Draws of ln E_x, ln E_y, ln G_xy of a board that was not measured yet: (n_draws, 3) array."""
        return self.means + self.sds * rng.standard_normal(self.means.shape)

    def pooled(self, board: int, rng: np.random.Generator) -> Floats:
        """Draws of ln E of a board under the population: (n_draws, 3) array."""
        one = self.boards[board]
        own = np.linalg.inv(one.covariance)
        precision = own + _diagonal(self.sds**-2.0)
        mean = one.mean + self.chains.pooled[:, 2 * _CONSTANTS :] @ np.linalg.cholesky(self.common).T @ one.slopes.T
        lean = mean @ own + self.means * self.sds**-2.0
        middle = np.linalg.solve(precision, lean[:, :, None])
        factor = np.swapaxes(np.linalg.cholesky(precision), 1, 2)
        normal = rng.standard_normal((*lean.shape, 1))
        return np.asarray((middle + np.linalg.solve(factor, normal))[:, :, 0])


def find_population(
    boards: Sequence[BoardConstants], prior: PriorCard, settings: SamplerSettings, common: Floats | None = None
) -> Population:
    """Sample mean and standard deviation of the constants of all boards of such a kind.

    The prior's medians and factors are believed of the mean; the standard deviation of ln E is half-normal on the scale
    of the factor. `common` is the covariance of the standard coordinates of what all boards share, which is off by the
    same on all of them: the mean of many boards does not average it out.
    """
    common = np.zeros((0, 0)) if common is None else common
    away = np.array([one.slopes @ np.linalg.cholesky(common) for one in boards])
    n_shared = len(common)
    middle = np.array([np.log(prior.constants[name].median) for name in MODULI])
    width = np.array([prior.constants[name].log_sd for name in MODULI])
    seen = np.array([one.mean for one in boards])
    covariances = np.array([one.covariance for one in boards])
    own = np.diagonal(covariances, axis1=1, axis2=2).mean(axis=0)
    spread = np.sqrt(np.maximum(seen.var(axis=0, ddof=1) - own, 0.0) + (0.1 * width) ** 2)

    def log_posterior(theta: Floats) -> Floats:
        means, log_sds, off = np.split(theta, [_CONSTANTS, 2 * _CONSTANTS], axis=1)
        sds = np.exp(np.clip(log_sds, np.log(_STEADY), None))
        total = -0.5 * (((means - middle) / width) ** 2 + (sds / width) ** 2).sum(axis=1) + log_sds.sum(axis=1)
        total -= 0.5 * (off**2).sum(axis=1)
        there = seen[None] + np.einsum("bck,nk->nbc", away, off)
        factors = np.linalg.cholesky(covariances[None] + _diagonal(sds**2)[:, None])
        left = np.linalg.solve(factors, (there - means[:, None])[..., None])[..., 0]
        total -= 0.5 * (left**2).sum(axis=(1, 2))
        total -= np.log(np.diagonal(factors, axis1=2, axis2=3)).sum(axis=(1, 2))
        return np.where((log_sds < np.log(_STEADY)).any(axis=1), -np.inf, total)

    n = len(boards)
    centre = np.concatenate([seen.mean(axis=0), np.log(spread), np.zeros(n_shared)])
    covariance = np.diag(np.concatenate([spread**2 / n, np.full(_CONSTANTS, 0.5 / n), np.ones(n_shared)]))
    along = away.mean(axis=0)  # the mean goes with what the shared numbers are off by
    covariance[:_CONSTANTS, :_CONSTANTS] += along @ along.T
    covariance[:_CONSTANTS, 2 * _CONSTANTS :] = along
    covariance[2 * _CONSTANTS :, :_CONSTANTS] = along.T
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


def prior_of(population: Population, name: str, source: str, rng: np.random.Generator) -> PriorCard:
    """What the boards teach of the next one, as a prior card.

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
