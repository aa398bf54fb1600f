"""A law between linear and exact: ln f of each mode as a polynomial of low order in the sampled parameters.

It is of second order in all parameters, and of up to fifth order along the few directions in which ln f is bent most:
few of the hundreds of terms of third order matter, and with a thousand points the others would be fitted to chance.

It is fitted by least squares to the exact law over the posterior, and takes microseconds a draw, however many effects
the board has. Draws from its posterior are weighted to the exact law, so that its error does not bias a result.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Bools, Floats, Indices
from bayesplate.board.board import Values
from bayesplate.posterior.ensembles import pilot
from bayesplate.posterior.mixture import Mixture
from bayesplate.posterior.starts import cholesky_factor
from bayesplate.posterior.statistics import effective_share, smooth_weights, weights_suffice
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior
from bayesplate.streams import random_stream

_FIRST_WIDTH = 1.5
"""Width of the first points over the normal approximation, so that they cover the shoulders of the posterior."""
_REACH = 7.0
"""Distance, in standard deviations of the points, beyond which the polynomial is constant, for lack of points."""
BENT_DIRECTIONS = {3: 6, 4: 4, 5: 3}
"""For each order above the second, the number of most bent directions along which it has terms."""
_POINTS_PER_TERM = 3
_FEWEST_POINTS = 512
_MOST_ROUNDS = 6
_TEMPERATURE, _LOWEST_LOG_DENSITY = 4.0, -200.0
"""Temperature of the weights in a fit, and lower limit of a point's log density there, relative to the highest."""
_BATCH = 2048
_GOOD_SHARE = 0.5
"""Effective share of the draws under the law at which a surrogate is good enough."""
_SEARCH_WIDTH, _LARGEST_MISSING = 2.0, 0.02
"""Width, over that of the draws, of the search for probability that a surrogate misses; the largest share missed."""


class LawPoints(NamedTuple):
    """Points computed by the law: (n, n_dim) theta, (n, n_modes) ln f, (n,) log density."""

    theta: Floats
    log_frequency: Floats
    log_density: Floats

    def select(self, is_selected: Bools) -> LawPoints:
        """The points of a mask."""
        return LawPoints(*(array[is_selected] for array in self))

    def joined_with(self, *others: LawPoints) -> LawPoints:
        """These points and others together."""
        return LawPoints(*(np.concatenate(arrays) for arrays in zip(self, *others, strict=True)))

    @property
    def weights(self) -> Floats:
        """Weight of each point in a fit, (n,): the tempered density, small for distant points."""
        log_relative = self.log_density - self.log_density.max()
        return np.asarray(np.exp(np.maximum(log_relative, _LOWEST_LOG_DENSITY) / _TEMPERATURE))


@dataclass(frozen=True, eq=False)
class Surrogate:
    """Polynomials for the frequencies of all modes in the likelihood."""

    columns: Indices  # (n_fitted,), the parameters that frequencies depend on
    centre: Floats  # (n_fitted,)
    whitening: Floats  # (n_fitted, n_fitted), from parameters less the centre to coordinates u of unit spread
    bent: Mapping[int, Floats]  # by order above the second (n_bent, n_fitted) directions of u, the most bent first
    coefficients: Floats  # (n_terms, n_modes), of 1, u_i, u_i u_j, and of the products of coordinates along `bent`
    points: LawPoints  # the points of the fit

    @classmethod
    def fitted(cls, points: LawPoints, columns: Indices, along_bent: Mapping[int, int] = BENT_DIRECTIONS) -> Surrogate:
        """Fit by weighted least squares to the points that are plates.

        The fit of second order shows the most bent directions; higher orders along these follow if the points, by
        their weights, are enough. `along_bent` is as `BENT_DIRECTIONS`.
        """
        points = points.select(np.isfinite(points.log_frequency).all(axis=1) & np.isfinite(points.log_density))
        x, weights = points.theta[:, columns], points.weights
        factor = np.linalg.cholesky(np.atleast_2d(np.cov(x.T, aweights=weights)))
        centre = np.average(x, axis=0, weights=weights)
        no_coefficients = np.empty((0, points.log_frequency.shape[1]))
        second_order = cls(columns, centre, np.asarray(np.linalg.inv(factor).T), {}, no_coefficients, points)._fitted()
        if weights.sum() ** 2 < _POINTS_PER_TERM * n_terms(columns.size, along_bent) * (weights**2).sum():
            return second_order
        most_bent = second_order._bent_directions()
        return replace(second_order, bent={order: most_bent[:n] for order, n in along_bent.items()})._fitted()

    def refitted_with(self, *further: LawPoints) -> Surrogate:
        """The surrogate fitted to further points as well."""
        return Surrogate.fitted(self.points.joined_with(*further), self.columns)

    def _fitted(self) -> Surrogate:
        roots, terms = np.sqrt(self.points.weights)[:, None], self._terms(self.points.theta)
        coefficients = np.linalg.lstsq(roots * terms, roots * self.points.log_frequency, rcond=None)[0]
        return replace(self, coefficients=np.asarray(coefficients, dtype=np.float64))

    def _bent_directions(self) -> Floats:
        """Directions in order of bending: the sum over modes of the squared second derivatives along them."""
        n = self.columns.size
        first, second = np.triu_indices(n)
        hessians = np.zeros((self.coefficients.shape[1], n, n))
        hessians[:, first, second] = self.coefficients[-len(first) :].T
        hessians += np.swapaxes(hessians, 1, 2)
        return np.asarray(np.linalg.eigh((hessians @ hessians).sum(axis=0))[1].T[::-1])

    def log_frequencies(self, theta: Floats) -> Floats:
        """ln f (Hz) of all modes in the likelihood, setup after setup: (n_draws, n_modes) from (n_draws, n_dim)."""
        batches = [self._terms(theta[i : i + _BATCH]) @ self.coefficients for i in range(0, len(theta), _BATCH)]
        return np.concatenate(batches) if batches else np.empty((0, self.coefficients.shape[1]))

    def log_within(self, theta: Floats) -> Floats:
        """ln of a weight that is 1 near the points and falls like a normal density beyond: (n_draws,) array.

        It bounds the density of a surrogate, which would otherwise stay constant far from the points.
        """
        excess = np.maximum(np.abs(self._whitened(theta)) - _REACH, 0.0)
        return np.asarray(-((_REACH + 0.5 * excess) * excess).sum(axis=1))

    def _whitened(self, theta: Floats) -> Floats:
        return np.asarray((theta[:, self.columns] - self.centre) @ self.whitening)

    def _terms(self, theta: Floats) -> Floats:
        u = np.clip(self._whitened(theta), -_REACH, _REACH).T
        groups = [np.ones((1, u.shape[1])), u, u[_factor_indices(2, len(u))].prod(axis=1)]
        groups += [(bent @ u)[_factor_indices(order, len(bent))].prod(axis=1) for order, bent in self.bent.items()]
        return np.concatenate(groups).T


@lru_cache(maxsize=64)
def _factor_indices(order: int, n: int) -> Indices:
    """Indices of the coordinates in each product of `order` of n coordinates: (n_products, order) array."""
    return np.array(list(combinations_with_replacement(range(n), order)), dtype=np.intp)


def n_terms(n_parameters: int, along_bent: Mapping[int, int] = BENT_DIRECTIONS) -> int:
    """Number of coefficients of a surrogate for each mode."""
    orders = {0: n_parameters, 1: n_parameters, 2: n_parameters, **along_bent}
    return sum(len(_factor_indices(order, min(n, n_parameters))) for order, n in orders.items())


@dataclass(frozen=True, eq=False, kw_only=True)
class SurrogatePosterior(Posterior):
    """The posterior with frequencies from a surrogate of its law, bounded to the region of the surrogate's points."""

    surrogate: Surrogate

    def evaluate(self, theta: Floats) -> tuple[Floats, Floats]:
        """Log density, and ln f of all modes, as of `bayesplate.posterior.target.Posterior.evaluate`."""
        log_density, log_frequency = super().evaluate(theta)
        return log_density + self.surrogate.log_within(theta), log_frequency

    def mode_log_frequencies(self, theta: Floats, values: Values | None = None) -> list[Floats]:
        """ln f of the labelled modes, then of those that peaks may be: one (n_draws, n_modes) array per setup."""
        return self.by_setup(self.surrogate.log_frequencies(theta))


def with_surrogate(posterior: Posterior, surrogate: Surrogate) -> SurrogatePosterior:
    """The posterior with its frequencies from a surrogate."""
    return SurrogatePosterior(
        posterior.board, posterior.prior, posterior.models, posterior.law, posterior.robust, surrogate=surrogate
    )


def find_surrogate(
    posterior: Posterior, centre: Floats, covariance: Floats, coordinates: TailCoordinates
) -> Surrogate | None:
    """Fit a surrogate to the law of a posterior, or return None where none is good enough.

    Each round fits the surrogate, walks on it, weights the draws to the law, and searches around them for probability
    that it misses. All points of a round are added to those of the next. None if after a few rounds the draws have too
    small an effective share under the law, or a part of the posterior is missed. The walk is in `coordinates`.
    """
    columns, bounds = posterior.parameters.fitted_columns, posterior.parameters.fitted_bounds
    n_points = max(_FEWEST_POINTS, _POINTS_PER_TERM * n_terms(columns.size))
    rng = random_stream(0, "surrogate")
    factor = cholesky_factor(coordinates.start_covariance(covariance))
    theta = rng.multivariate_normal(centre, _FIRST_WIDTH**2 * covariance, n_points)
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower, bounds.upper)
    surrogate = Surrogate.fitted(_law_points(posterior, coordinates, theta), columns)
    for _ in range(_MOST_ROUNDS):
        density = coordinates.density(with_surrogate(posterior, surrogate))
        draws = pilot(density, coordinates.start, factor, rng).draws
        y = draws[rng.choice(len(draws), min(n_points, len(draws)), replace=False)]
        law_points = _law_points(posterior, coordinates, coordinates.theta(y))
        weights, pareto_k = smooth_weights(law_points.log_density - density(y))
        proposal = Mixture.fitted(draws).widened(_SEARCH_WIDTH)
        y = proposal.points(n_points, rng)
        y = y[coordinates.is_near(y)]
        outer_points = _law_points(posterior, coordinates, coordinates.theta(y))
        missing_share = missing_probability(outer_points.log_density, density(y), proposal.log_density(y))
        if (
            weights_suffice(weights, pareto_k)
            and effective_share(weights) >= _GOOD_SHARE
            and missing_share <= _LARGEST_MISSING
        ):
            return surrogate
        surrogate = surrogate.refitted_with(law_points, outer_points)
    return None


def missing_probability(log_law: Floats, log_surrogate: Floats, log_proposal: Floats) -> float:
    """Share of the probability under a law that lies where the surrogate's density is less than half the law's.

    Draws of the surrogate do not reach that region, so the (n_draws,) log densities are at draws of a wider proposal,
    the first two up to a constant.
    """
    weights, surrogate_weights = (
        np.exp(log - np.logaddexp.reduce(log)) for log in (log_law - log_proposal, log_surrogate - log_proposal)
    )
    return float(weights[surrogate_weights < 0.5 * weights].sum())


def _law_points(posterior: Posterior, coordinates: TailCoordinates, theta: Floats) -> LawPoints:
    """Points with frequencies and log density by the law itself; the density is that of the walk's coordinates."""
    by_setup = posterior.mode_log_frequencies(theta)
    likelihood = posterior.log_likelihood_of(by_setup, theta).sum(axis=1)
    log_density = posterior.log_prior(theta) + likelihood + coordinates.log_jacobian(coordinates.y(theta))
    return LawPoints(theta, np.concatenate(by_setup, axis=1), log_density)
