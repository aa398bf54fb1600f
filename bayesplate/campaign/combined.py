"""The product of the boards' likelihoods: the posterior of the shared parameters from all boards, or all but some."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.likelihood import Likelihood, moments, spread_points
from bayesplate.campaign.normal_likelihood import NormalLikelihood, normal_posterior, prior_moments
from bayesplate.campaign.scatter import Scatter, ScatteredLikelihood, expected_width, scatter_widths, scatters_of
from bayesplate.campaign.shared import SharedParameter
from bayesplate.diagnosis.terms import log_sum, normalised_weights
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.mixture import Mixture
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample
from bayesplate.posterior.starts import LogDensity
from bayesplate.posterior.statistics import effective_draws

_LINE = 21
FEWEST_POINTS = 500
"""Points of equal weight on which the posterior from all boards, or all but one, has to rest."""
_N_POINTS_BY_DIMENSION = {1: 2**12, 2: 2**14}
_MOST_POINTS = 2**15
_WIDENING = 1.6
"""Factor by which the points are spread wider than the posteriors from all boards and from all but each."""
_ROUNDS = 12
_HALVINGS = 30
_N_MIXTURE_DRAWS = 4096


@dataclass(frozen=True, eq=False)
class CombinedBoards:
    """Boards that are independent given the shared numbers and the scatters of those that have one."""

    shared: tuple[SharedParameter, ...]
    names: tuple[str, ...]  # of the boards
    likelihoods: tuple[Likelihood, ...]  # one per board, of its own numbers
    normal_likelihoods: tuple[NormalLikelihood, ...]  # one per board, the normal likelihood of its own numbers
    points: Floats  # (n_points, n_coordinates) array: standard coordinates at which densities are summed
    log_spread: Floats  # (n_points,) array: ln of the density of these points

    @classmethod
    def of(
        cls,
        shared: Sequence[SharedParameter],
        names: Sequence[str],
        likelihoods: Sequence[Likelihood],
        normal_likelihoods: Sequence[NormalLikelihood],
    ) -> CombinedBoards:
        """The boards combined, with points around the posteriors from all of them and from all but each."""
        scattered_likelihoods = [likelihood.scattered(expected_width(shared)) for likelihood in normal_likelihoods]
        scatters = scatters_of(shared)
        spread = _points_around(
            [
                _append_scatters(*normal_posterior([scattered_likelihoods[i] for i in indices]), scatters)
                for indices in _leave_one_out(len(normal_likelihoods))
            ]
        )
        combined = cls(tuple(shared), tuple(names), tuple(likelihoods), tuple(normal_likelihoods), *spread)
        for _ in range(_ROUNDS):
            if combined.fewest_points >= FEWEST_POINTS:
                break
            points, log_spread = _points_around([combined._tempered_moments(without) for without in combined.left_out])
            combined = replace(combined, points=points, log_spread=log_spread)
        return combined

    @property
    def coordinates(self) -> tuple[SharedParameter | Scatter, ...]:
        return (*self.shared, *scatters_of(self.shared))

    @cached_property
    def _coordinate_likelihoods(self) -> tuple[Likelihood, ...]:
        """Each board's likelihood of the coordinates."""
        if len(self.coordinates) == len(self.shared):
            return self.likelihoods
        pairs = zip(self.likelihoods, self.normal_likelihoods, strict=True)
        return tuple(ScatteredLikelihood(self.shared, exact, normal) for exact, normal in pairs)

    @property
    def left_out(self) -> list[tuple[int, ...]]:
        """No board, then each of them."""
        return [(), *((i,) for i in range(len(self.names)))]

    def log_likelihoods(self, z: Floats) -> Floats:
        """ln of each board's likelihood at standard coordinates: (n_boards, n) array."""
        return np.stack([likelihood.at(z) for likelihood in self._coordinate_likelihoods])

    def log_prior(self, z: Floats) -> Floats:
        """ln of the prior density of the standard coordinates: (n,) array."""
        return np.sum([coordinate.prior.log_prior(z[:, i]) for i, coordinate in enumerate(self.coordinates)], axis=0)

    def log_density(self, z: Floats, without: Collection[int] = ()) -> Floats:
        """ln of the posterior density from all boards but some, not normalised: (n,) array."""
        likelihoods = [likelihood for i, likelihood in enumerate(self._coordinate_likelihoods) if i not in without]
        return np.asarray(self.log_prior(z) + np.sum([likelihood.at(z) for likelihood in likelihoods], axis=0))

    def log_evidence(self, without: Collection[int] = ()) -> float:
        """ln of the probability of the readings of all boards but some."""
        return float(log_sum(self._log_weights(without)) - np.log(len(self.points)))

    def weights(self, without: Collection[int] = ()) -> Floats:
        """Posterior weight of each point from all boards but some: (n_points,) array that sums to 1."""
        return normalised_weights(self._log_weights(without))

    def moments(self, without: Collection[int] = ()) -> tuple[Floats, Floats]:
        """Mean and covariance of the standard coordinates from all boards but some."""
        return moments(self.points, self.weights(without))

    @cached_property
    def fewest_points(self) -> float:
        """Number of points of equal weight on which the sums rest, the least from all boards or all but one."""
        return min(effective_draws(self.weights(without)) for without in self.left_out)

    @cached_property
    def _board_numbers(self) -> Floats:
        """A board's own numbers at each point, drawn about the shared ones where they scatter: (n_points, n_shared)
        array."""
        n = len(self.shared)
        scattered = np.random.default_rng(_LINE).standard_normal((len(self.points), n))
        return np.asarray(self.points[:, :n] + scatter_widths(self.shared, self.points) * scattered)

    def moments_from_others(self, without: Collection[int] = ()) -> tuple[Floats, Floats]:
        """Mean and covariance of an unmeasured board's own numbers, as all boards but some teach them."""
        return moments(self._board_numbers, self.weights(without))

    def draws_from_others(self, rng: np.random.Generator, n: int, without: Collection[int] = ()) -> Floats:
        """Draws of an unmeasured board's own numbers, as all boards but some teach them: (n, n_shared) array."""
        return self._board_numbers[rng.choice(len(self.points), size=n, p=self.weights(without))]

    def moments_from_all(self, board: int) -> tuple[Floats, Floats]:
        """Mean and covariance of a board's own numbers, given the other boards and its own readings."""
        log_weights = self._log_weights((board,)) + self.likelihoods[board].at(self._board_numbers)
        return moments(self._board_numbers, normalised_weights(log_weights))

    def log_density_from_others(self, without: Collection[int] = ()) -> LogDensity:
        """ln of the density of a board's own numbers as all boards but some teach them, not normalised.

        Where they scatter, it is that of a mixture of Student distributions fitted to draws of them: the uncertainty of
        the scatter gives it tails. It is zero beyond all of the draws.
        """
        if len(self.coordinates) == len(self.shared):
            return lambda z: self.log_density(z, without)
        draws = self.draws_from_others(np.random.default_rng(_LINE), _N_MIXTURE_DRAWS, without)
        # minus infinity where there is none
        bounds = np.array([parameter.prior.standard_bounds[0] for parameter in self.shared])
        for i in np.flatnonzero(np.isfinite(bounds)):  # their mirror image beside them, or the density would fall off
            mirrored = draws.copy()
            mirrored[:, i] = 2.0 * bounds[i] - mirrored[:, i]
            draws = np.concatenate([draws, mirrored])
        mixture = Mixture.fitted(np.random.default_rng(_LINE).permutation(draws))
        envelope = Mixture.fitted_single(draws)
        reach = envelope.squared_distances(draws).max()

        def log_density(z: Floats) -> Floats:
            is_inside = (z >= bounds).all(axis=1) & (envelope.squared_distances(z)[0] <= reach)
            return np.where(is_inside, mixture.log_density(z), -np.inf)

        return log_density

    @cached_property
    def _log_densities_at_points(self) -> tuple[Floats, Floats]:
        """ln likelihood of each board, and ln of the prior over the points' own density."""
        return self.log_likelihoods(self.points), self.log_prior(self.points) - self.log_spread

    def _tempered_moments(self, without: Collection[int]) -> tuple[Floats, Floats]:
        """Moments of the posterior, tempered until enough of the points have a share in them."""
        log_weights = self._log_weights(without)
        low, high = 0.0, 1.0
        if effective_draws(normalised_weights(log_weights)) < FEWEST_POINTS:
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                is_enough = effective_draws(normalised_weights(middle * log_weights)) >= FEWEST_POINTS
                low, high = (middle, high) if is_enough else (low, middle)
            high = low
        return moments(self.points, normalised_weights(high * log_weights))

    def _log_weights(self, without: Collection[int]) -> Floats:
        log_likelihoods, log_prior = self._log_densities_at_points
        indices = [i for i in range(len(log_likelihoods)) if i not in without]
        return np.asarray(log_likelihoods[indices].sum(axis=0) + log_prior)


def sample_shared(
    combined: CombinedBoards, settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> tuple[Chains, Convergence]:
    """Sample the shared numbers, then their scatters, in standard coordinates, from all boards."""
    names = [coordinate.name for coordinate in combined.coordinates]
    return sample(combined.log_density, *combined.moments(), settings, names=names, progress=progress)


def shared_values(coordinates: Sequence[SharedParameter | Scatter], z: Floats) -> dict[str, Floats]:
    """Shared numbers and scatters by name, SI, from (..., n_coordinates) standard coordinates: (...) arrays."""
    return {coordinate.name: np.asarray(coordinate.prior.value(z[..., i])) for i, coordinate in enumerate(coordinates)}


def _leave_one_out(n: int) -> Iterator[list[int]]:
    """Indices of all of n boards, then of all but each; a single board is never left out."""
    yield list(range(n))
    for left_out in range(n if n > 1 else 0):
        yield [i for i in range(n) if i != left_out]


def _append_scatters(mean: Floats, covariance: Floats, scatters: Sequence[Scatter]) -> tuple[Floats, Floats]:
    """Moments of the numbers followed by the prior moments of the scatters."""
    from scipy.linalg import block_diag

    scatter_moments = [prior_moments(scatter.prior) for scatter in scatters]
    return np.r_[mean, [middle for middle, _ in scatter_moments]], block_diag(
        covariance, *(variance for _, variance in scatter_moments)
    )


def _points_around(distributions: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """Points around several normal distributions, and ln of their density.

    Each direction is as wide as the widest distribution, so that a single one apart from the others is covered.
    """
    means, covariances = [np.array(arrays) for arrays in zip(*distributions, strict=True)]
    middle = means.mean(axis=0)
    apart = (means - middle)[:, :, None] * (means - middle)[:, None, :]
    spread = (covariances + apart).mean(axis=0)
    widest = np.diagonal(covariances + apart, axis1=1, axis2=2).max(axis=0)
    grow = np.clip(np.sqrt(widest / np.diagonal(spread)), 1.0, 2.0)
    factor = np.asarray(_WIDENING * np.linalg.cholesky(spread * np.outer(grow, grow)))
    return spread_points(middle, factor, _N_POINTS_BY_DIMENSION.get(middle.size, _MOST_POINTS))
