"""A law between linear and exact: ln f of each mode as a polynomial of low order in the sampled parameters.

It is of second order in all of them, and of up to fifth along the few directions in which ln f is bent most: of the
hundreds of terms of third order few matter, and fitted to a thousand points the others follow chance.

It is fitted by least squares to the exact law where the posterior is, and costs microseconds a draw, however many
effects the board has. Draws from its posterior are weighted to the exact law, so that its error never moves a result.
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
from bayesplate.posterior.statistics import effective_share, may_stand, smoothed
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior
from bayesplate.streams import stream

_WIDER = 1.5
"""Than the normal approximation: the first points, so that the posterior's shoulders are among them."""
_REACH = 7.0
"""Standard deviations of the points beyond which the polynomial goes on level: it knows nothing there."""
ALONG_BENT = {3: 6, 4: 4, 5: 3}
"""Orders above the second, and along how many of the directions in which ln f is bent most."""
_POINTS_PER_TERM = 3
_FEWEST_POINTS = 512
_MOST_ROUNDS = 6
_TEMPERATURE, _LOWEST = 4.0, -200.0
"""Of the weights in a fit. Lower differences of log densities than the second count as that: a law that is wild far out
must not bend the polynomial here."""
_BATCH = 2048
_GOOD_SHARE = 0.5
"""Of the draws that count under the law, from which on a surrogate is taught no further."""
_FARTHER, _MAY_LACK = 2.0, 0.02
"""Times the width of its draws, where it is looked for probability that it lacks; and how much it may lack."""


class Solved(NamedTuple):
    """Points with what the law gives there: (n, n_dim) theta, (n, n_modes) ln f, (n,) log density."""

    theta: Floats
    log_frequency: Floats
    log_density: Floats

    def where(self, kept: Bools) -> Solved:
        """Some of the points."""
        return Solved(*(part[kept] for part in self))

    def beside(self, *others: Solved) -> Solved:
        """These points and others."""
        return Solved(*(np.concatenate(parts) for parts in zip(self, *others, strict=True)))

    @property
    def weights(self) -> Floats:
        """Weight of each point in a fit, (n,): the density, tempered, so that far ones hardly matter."""
        below = self.log_density - self.log_density.max()
        return np.asarray(np.exp(np.maximum(below, _LOWEST) / _TEMPERATURE))


@dataclass(frozen=True, eq=False)
class Surrogate:
    """Polynomials for the frequencies of all modes in the likelihood."""

    columns: Indices  # (n_fitted,), the parameters that frequencies depend on
    centre: Floats  # (n_fitted,)
    whitening: Floats  # (n_fitted, n_fitted), from parameters less the centre to coordinates u of unit spread
    bent: Mapping[int, Floats]  # by order above the second (n_bent, n_fitted) directions of u, the most bent first
    coefficients: Floats  # (n_terms, n_modes), of 1, u_i, u_i u_j, and of the products of coordinates along `bent`
    points: Solved  # it was fitted to these

    @classmethod
    def fitted(cls, points: Solved, columns: Indices, along_bent: Mapping[int, int] = ALONG_BENT) -> Surrogate:
        """By weighted least squares, to the points that are plates: first of second order, which shows what is bent.

        It stays at that order where the points count for too few by their weights. `along_bent` is as `ALONG_BENT`.
        """
        points = points.where(np.isfinite(points.log_frequency).all(axis=1) & np.isfinite(points.log_density))
        x, weights = points.theta[:, columns], points.weights
        factor = np.linalg.cholesky(np.atleast_2d(np.cov(x.T, aweights=weights)))
        centre = np.average(x, axis=0, weights=weights)
        none = np.empty((0, points.log_frequency.shape[1]))
        second = cls(columns, centre, np.asarray(np.linalg.inv(factor).T), {}, none, points)._fitted()
        if weights.sum() ** 2 < _POINTS_PER_TERM * n_terms(columns.size, along_bent) * (weights**2).sum():
            return second
        most_bent = second._most_bent()
        return replace(second, bent={order: most_bent[:n] for order, n in along_bent.items()})._fitted()

    def taught(self, *further: Solved) -> Surrogate:
        """The same fitted to further points too."""
        return Surrogate.fitted(self.points.beside(*further), self.columns)

    def _fitted(self) -> Surrogate:
        roots, terms = np.sqrt(self.points.weights)[:, None], self._terms(self.points.theta)
        found = np.linalg.lstsq(roots * terms, roots * self.points.log_frequency, rcond=None)[0]
        return replace(self, coefficients=np.asarray(found, dtype=np.float64))

    def _most_bent(self) -> Floats:
        """Directions by the second derivatives of all modes along them, squared and added up."""
        n = self.columns.size
        first, second = np.triu_indices(n)
        hessians = np.zeros((self.coefficients.shape[1], n, n))
        hessians[:, first, second] = self.coefficients[-len(first) :].T
        hessians += np.swapaxes(hessians, 1, 2)
        return np.asarray(np.linalg.eigh((hessians @ hessians).sum(axis=0))[1].T[::-1])

    def log_frequencies(self, theta: Floats) -> Floats:
        """ln f (Hz) of these modes, setup after setup: (n_draws, n_modes) array from (n_draws, n_dim)."""
        parts = [self._terms(theta[i : i + _BATCH]) @ self.coefficients for i in range(0, len(theta), _BATCH)]
        return np.concatenate(parts) if parts else np.empty((0, self.coefficients.shape[1]))

    def log_within(self, theta: Floats) -> Floats:
        """ln of a weight, 1 within reach of the points, that falls beyond as a normal density: (n_draws,) array.

        With it the density of a surrogate ends where it knows nothing, rather than go on level without bound.
        """
        beyond = np.maximum(np.abs(self._whitened(theta)) - _REACH, 0.0)
        return np.asarray(-((_REACH + 0.5 * beyond) * beyond).sum(axis=1))

    def _whitened(self, theta: Floats) -> Floats:
        return np.asarray((theta[:, self.columns] - self.centre) @ self.whitening)

    def _terms(self, theta: Floats) -> Floats:
        u = np.clip(self._whitened(theta), -_REACH, _REACH).T
        groups = [np.ones((1, u.shape[1])), u, u[_factors(2, len(u))].prod(axis=1)]
        groups += [(bent @ u)[_factors(order, len(bent))].prod(axis=1) for order, bent in self.bent.items()]
        return np.concatenate(groups).T


@lru_cache(maxsize=64)
def _factors(order: int, n: int) -> Indices:
    """Which of n coordinates each product of so many of them has: (n_products, order) array."""
    return np.array(list(combinations_with_replacement(range(n), order)), dtype=np.intp)


def n_terms(n_parameters: int, along_bent: Mapping[int, int] = ALONG_BENT) -> int:
    """Number of coefficients of a surrogate for each mode."""
    orders = {0: n_parameters, 1: n_parameters, 2: n_parameters, **along_bent}
    return sum(len(_factors(order, min(n, n_parameters))) for order, n in orders.items())


@dataclass(frozen=True, eq=False, kw_only=True)
class SurrogatePosterior(Posterior):
    """The posterior with frequencies from a surrogate of its law, and an end beyond the points of that."""

    surrogate: Surrogate

    def evaluate(self, theta: Floats) -> tuple[Floats, Floats]:
        """Log density, and ln f of all modes, as of `bayesplate.posterior.target.Posterior.evaluate`."""
        log_density, log_frequency = super().evaluate(theta)
        return log_density + self.surrogate.log_within(theta), log_frequency

    def every_log_frequency(self, theta: Floats, values: Values | None = None) -> list[Floats]:
        """ln f of the labelled modes, then of those that peaks may be: one (n_draws, n_every) array per setup."""
        return self.by_setup(self.surrogate.log_frequencies(theta))


def with_surrogate(posterior: Posterior, surrogate: Surrogate) -> SurrogatePosterior:
    """A posterior whose frequencies a surrogate gives."""
    return SurrogatePosterior(
        posterior.board, posterior.prior, posterior.models, posterior.law, posterior.robust, surrogate=surrogate
    )


def find_surrogate(
    posterior: Posterior, centre: Floats, covariance: Floats, coordinates: TailCoordinates
) -> Surrogate | None:
    """Fit a surrogate to the law of a posterior, or find that none serves.

    Each round fits it anew, walks on it, weights the draws to the law, and looks around them for probability that it
    lacks. All points of a round join those of the next. None if after a few rounds too few draws of it would count
    under the law, or it lacks a part of the posterior. The walkers walk in `coordinates`.
    """
    columns, bounds = posterior.parameters.fitted_columns, posterior.parameters.fitted_bounds
    n_points = max(_FEWEST_POINTS, _POINTS_PER_TERM * n_terms(columns.size))
    rng = stream(0, "surrogate")
    factor = cholesky_factor(coordinates.start_covariance(covariance))
    theta = rng.multivariate_normal(centre, _WIDER**2 * covariance, n_points)
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower, bounds.upper)
    surrogate = Surrogate.fitted(_solved(posterior, coordinates, theta), columns)
    for _ in range(_MOST_ROUNDS):
        density = coordinates.density(with_surrogate(posterior, surrogate))
        walked = pilot(density, coordinates.start, factor, rng).draws
        y = walked[rng.choice(len(walked), n_points, replace=False)]
        solved = _solved(posterior, coordinates, coordinates.theta(y))
        weights, pareto_k = smoothed(solved.log_density - density(y))
        proposal = Mixture.fitted(walked).widened(_FARTHER)
        y = proposal.points(n_points, rng)
        y = y[coordinates.is_near(y)]
        further_out = _solved(posterior, coordinates, coordinates.theta(y))
        lacks = share_lacking(further_out.log_density, density(y), proposal.log_density(y))
        if may_stand(weights, pareto_k) and effective_share(weights) >= _GOOD_SHARE and lacks <= _MAY_LACK:
            return surrogate
        surrogate = surrogate.taught(solved, further_out)
    return None


def share_lacking(log_law: Floats, log_surrogate: Floats, log_proposal: Floats) -> float:
    """Share of the probability under a law that lies where a surrogate has less than half of it.

    Draws of the surrogate do not show it, for none comes there: (n_draws,) log densities are at draws of a wider
    proposal, the first two up to a constant.
    """
    weights, of_surrogate = (
        np.exp(log - np.logaddexp.reduce(log)) for log in (log_law - log_proposal, log_surrogate - log_proposal)
    )
    return float(weights[of_surrogate < 0.5 * weights].sum())


def _solved(posterior: Posterior, coordinates: TailCoordinates, theta: Floats) -> Solved:
    """Frequencies and log density in the coordinates of the walk, by the law itself."""
    by_setup = posterior.every_log_frequency(theta)
    likelihood = posterior.log_likelihood_of(by_setup, theta).sum(axis=1)
    log_density = posterior.log_prior(theta) + likelihood + coordinates.log_jacobian(coordinates.y(theta))
    return Solved(theta, np.concatenate(by_setup, axis=1), log_density)
