"""The boards' likelihoods multiplied: what all of them, or all but some, say of the shared parameters."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.campaign.likelihood import Likelihood, LogDensity, moments, spread_points
from bayesplate.campaign.pulls import Pull, moments_before, normal_posterior
from bayesplate.campaign.scatter import Scatter, ScatteredLikelihood, expected_width, scatters_of, widths
from bayesplate.campaign.shared import Shared
from bayesplate.diagnosis.terms import log_sum, normalised
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.mixture import Mixture
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample
from bayesplate.posterior.statistics import effective_draws

_LINE = 21
FEWEST_POINTS = 500
"""Points of equal weight that what all boards, or all but one, find likely has to rest on."""
_N_POINTS = {1: 2**12, 2: 2**14}
_MOST_POINTS = 2**15
_WIDER = 1.6
"""Than the posteriors from all boards and from all but each: the points at which densities are summed."""
_ROUNDS = 12
_HALVINGS = 30
_N_FITTED = 4096


@dataclass(frozen=True, eq=False)
class Together:
    """Boards that are independent given the shared numbers and the scatters of those that have one."""

    shared: tuple[Shared, ...]
    names: tuple[str, ...]  # of the boards
    likelihoods: tuple[Likelihood, ...]  # one per board, of its own numbers
    pulls: tuple[Pull, ...]  # what each board says by itself, as a normal likelihood of its own numbers
    points: Floats  # (n_points, n_coordinates) array: standard coordinates at which densities are summed
    log_spread: Floats  # (n_points,) array: ln of the density of these points

    @classmethod
    def of(
        cls, shared: Sequence[Shared], names: Sequence[str], likelihoods: Sequence[Likelihood], pulls: Sequence[Pull]
    ) -> Together:
        """Boards together, their points around all that they, or all but one of them, find likely."""
        weaker = [one.scattered(expected_width(shared)) for one in pulls]
        scatters = scatters_of(shared)
        spread = _around(
            [_beside(*normal_posterior([weaker[i] for i in kept]), scatters) for kept in _leaving_one(len(pulls))]
        )
        found = cls(tuple(shared), tuple(names), tuple(likelihoods), tuple(pulls), *spread)
        for _ in range(_ROUNDS):
            if found.fewest_points >= FEWEST_POINTS:
                break
            points, log_spread = _around([found._towards(without) for without in found.left_out])
            found = replace(found, points=points, log_spread=log_spread)
        return found

    @property
    def coordinates(self) -> tuple[Shared | Scatter, ...]:
        return (*self.shared, *scatters_of(self.shared))

    @cached_property
    def _seen(self) -> tuple[Likelihood, ...]:
        """Each board's likelihood of the coordinates."""
        if len(self.coordinates) == len(self.shared):
            return self.likelihoods
        both = zip(self.likelihoods, self.pulls, strict=True)
        return tuple(ScatteredLikelihood(self.shared, own, pull) for own, pull in both)

    @property
    def left_out(self) -> list[tuple[int, ...]]:
        """No board, then each of them."""
        return [(), *((i,) for i in range(len(self.names)))]

    def log_likelihoods(self, z: Floats) -> Floats:
        """ln of each board's likelihood at standard coordinates: (n_boards, n) array."""
        return np.stack([one.at(z) for one in self._seen])

    def log_prior(self, z: Floats) -> Floats:
        """ln of the prior density of the standard coordinates: (n,) array."""
        return np.sum([one.prior.log_prior(z[:, i]) for i, one in enumerate(self.coordinates)], axis=0)

    def log_density(self, z: Floats, without: Collection[int] = ()) -> Floats:
        """ln of the posterior density from all boards but some, not normalised: (n,) array."""
        kept = [one for i, one in enumerate(self._seen) if i not in without]
        return np.asarray(self.log_prior(z) + np.sum([one.at(z) for one in kept], axis=0))

    def log_evidence(self, without: Collection[int] = ()) -> float:
        """ln of the probability of the readings of all boards but some."""
        return float(log_sum(self._log_weights(without)) - np.log(len(self.points)))

    def weights(self, without: Collection[int] = ()) -> Floats:
        """Posterior weight of each point from all boards but some: (n_points,) array that sums to 1."""
        return normalised(self._log_weights(without))

    def moments(self, without: Collection[int] = ()) -> tuple[Floats, Floats]:
        """Mean and covariance of the standard coordinates from all boards but some."""
        return moments(self.points, self.weights(without))

    @cached_property
    def fewest_points(self) -> float:
        """Points of equal weight that the sums rest on, from all boards or all but one."""
        return min(effective_draws(self.weights(without)) for without in self.left_out)

    @cached_property
    def _of_a_board(self) -> Floats:
        """A board's own numbers at each of the points, drawn anew where they scatter: (n_points, n_shared) array."""
        n = len(self.shared)
        scattered = np.random.default_rng(_LINE).standard_normal((len(self.points), n))
        return np.asarray(self.points[:, :n] + widths(self.shared, self.points) * scattered)

    def taught(self, without: Collection[int] = ()) -> tuple[Floats, Floats]:
        """Mean and covariance of the own numbers of a board that all boards but some teach, unseen itself."""
        return moments(self._of_a_board, self.weights(without))

    def taught_draws(self, rng: np.random.Generator, n: int, without: Collection[int] = ()) -> Floats:
        """Draws of a board's own numbers as `taught`: (n, n_shared) array."""
        return self._of_a_board[rng.choice(len(self.points), size=n, p=self.weights(without))]

    def under_all(self, board: int) -> tuple[Floats, Floats]:
        """Mean and covariance of a board's own numbers under what the others and its own readings say."""
        log_weights = self._log_weights((board,)) + self.likelihoods[board].at(self._of_a_board)
        return moments(self._of_a_board, normalised(log_weights))

    def log_taught(self, without: Collection[int] = ()) -> LogDensity:
        """ln of the density of a board's own numbers as all boards but some teach them, not normalised.

        Where they scatter, of a mixture of Student distributions that is fitted to draws of them: what is unknown of
        the scatter gives it tails. Farther out than any of the draws it is zero.
        """
        if len(self.coordinates) == len(self.shared):
            return lambda z: self.log_density(z, without)
        draws = self.taught_draws(np.random.default_rng(_LINE), _N_FITTED, without)
        bounds = np.array([one.prior.standard_bounds[0] for one in self.shared])  # minus infinity where there is none
        for i in np.flatnonzero(np.isfinite(bounds)):  # their mirror image beside them, or the density would fall off
            mirrored = draws.copy()
            mirrored[:, i] = 2.0 * bounds[i] - mirrored[:, i]
            draws = np.concatenate([draws, mirrored])
        mixture = Mixture.fitted(np.random.default_rng(_LINE).permutation(draws))
        whole = Mixture.one_fitted(draws)
        reach = whole.squared_distances(draws).max()

        def log_density(z: Floats) -> Floats:
            inside = (z >= bounds).all(axis=1) & (whole.squared_distances(z)[0] <= reach)
            return np.where(inside, mixture.log_density(z), -np.inf)

        return log_density

    @cached_property
    def _at_points(self) -> tuple[Floats, Floats]:
        """ln likelihood of each board, and ln of the prior over the points' own density."""
        return self.log_likelihoods(self.points), self.log_prior(self.points) - self.log_spread

    def _towards(self, without: Collection[int]) -> tuple[Floats, Floats]:
        """Moments of the posterior, tempered until enough of the points have a share in them."""
        log_weights = self._log_weights(without)
        low, high = 0.0, 1.0
        if effective_draws(normalised(log_weights)) < FEWEST_POINTS:
            for _ in range(_HALVINGS):
                middle = 0.5 * (low + high)
                is_enough = effective_draws(normalised(middle * log_weights)) >= FEWEST_POINTS
                low, high = (middle, high) if is_enough else (low, middle)
            high = low
        return moments(self.points, normalised(high * log_weights))

    def _log_weights(self, without: Collection[int]) -> Floats:
        boards, prior = self._at_points
        kept = [i for i in range(len(boards)) if i not in without]
        return np.asarray(boards[kept].sum(axis=0) + prior)


def walk(
    together: Together, settings: SamplerSettings, progress: Callable[[Progress], None] | None = None
) -> tuple[Chains, Convergence]:
    """Sample the shared numbers, then their scatters, in standard coordinates, from all boards."""
    names = [one.name for one in together.coordinates]
    return sample(together.log_density, *together.moments(), settings, names=names, progress=progress)


def values_of(coordinates: Sequence[Shared | Scatter], z: Floats) -> dict[str, Floats]:
    """What is learned by name, SI, from (..., n_coordinates) standard coordinates: (...) arrays."""
    return {one.name: np.asarray(one.prior.value(z[..., i])) for i, one in enumerate(coordinates)}


def _leaving_one(n: int) -> Iterator[list[int]]:
    """All of n boards, then all but each; a single board is left in."""
    yield list(range(n))
    for left in range(n if n > 1 else 0):
        yield [i for i in range(n) if i != left]


def _beside(mean: Floats, covariance: Floats, scatters: Sequence[Scatter]) -> tuple[Floats, Floats]:
    """Moments of the numbers with those of scatters beside them, of which no board said anything yet."""
    from scipy.linalg import block_diag

    before = [moments_before(one.prior) for one in scatters]
    return np.r_[mean, [middle for middle, _ in before]], block_diag(covariance, *(variance for _, variance in before))


def _around(every: Sequence[tuple[Floats, Floats]]) -> tuple[Floats, Floats]:
    """Points around several normal distributions, and ln of their density.

    One that stands apart from many is not averaged away: each direction is as wide as the widest of them.
    """
    means, covariances = [np.array(part) for part in zip(*every, strict=True)]
    middle = means.mean(axis=0)
    apart = (means - middle)[:, :, None] * (means - middle)[:, None, :]
    spread = (covariances + apart).mean(axis=0)
    widest = np.diagonal(covariances + apart, axis1=1, axis2=2).max(axis=0)
    grow = np.clip(np.sqrt(widest / np.diagonal(spread)), 1.0, 2.0)
    factor = np.asarray(_WIDER * np.linalg.cholesky(spread * np.outer(grow, grow)))
    return spread_points(middle, factor, _N_POINTS.get(middle.size, _MOST_POINTS))
