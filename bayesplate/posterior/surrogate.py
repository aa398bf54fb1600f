"""A law between linear and exact: ln f of each mode as a polynomial of low order in the sampled parameters.

It is of second order in all of them, and of up to fifth along the few directions in which ln f is bent most: of the
hundreds of terms of third order few matter, and fitted to a thousand points the others follow chance.

It is fitted by least squares to the exact law where the posterior is: first at draws of the normal approximation, then
at draws of its own posterior, until it holds at draws that it was not fitted to. It costs microseconds per draw,
however many effects the board has. The walkers walk on it and the exact law accepts or rejects where they end
(`bayesplate.posterior.moves.CorrectedSteps`), so that its error costs steps and never moves the posterior.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.plate.board import Values
from bayesplate.posterior.ensembles import advance
from bayesplate.posterior.moves import Steps
from bayesplate.posterior.proposals import Proposal
from bayesplate.posterior.starting import LogPosterior
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

_WIDER = 1.5
"""Than the normal approximation: the first points, so that the posterior's shoulders are among them."""
_REACH = 7.0
"""Standard deviations of the points beyond which the polynomial goes on level: it knows nothing there."""
ALONG_BENT = {3: 6, 4: 4, 5: 3}
"""Orders above the second, and along how many of the directions in which ln f is bent most."""
_POINTS_PER_TERM = 3
_FEWEST_POINTS = 512
_FEWEST_ROUNDS, _MOST_ROUNDS = 3, 8
_TEMPERATURE, _LOWEST = 4.0, -200.0
"""Of the weights in a fit, and of the walk to points far out. Lower differences of log densities than the second count
as that: a law that is wild out there must not bend the polynomial here."""
_FAR = 15.0
"""Points whose log density is lower than the highest by this and the number of parameters are no part of the posterior:
of a normal one less than a millionth lies there."""
_N_STEPS, _N_TAKEN = 40, 4
_N_ARCHIVED = 128
_BATCH = 2048
LEAST_ACCEPTANCE = 0.5
"""Of walks on a surrogate that serves. Below, most evaluations of the exact law would be for steps that are refused."""
_LEAST_ANYWHERE = 0.25
"""Of walks from any one point, below which the surrogate is taught on: where it is far too low a walker stays, and a
few that stay for a hundred steps make the autocorrelation time of all."""


class Solved(NamedTuple):
    """Points with what the law gives there: (n, n_dim) theta, (n, n_modes) ln f, (n,) log density."""

    theta: Floats
    log_frequency: Floats
    log_density: Floats

    def where(self, kept: NDArray[np.bool_]) -> Solved:
        """Some of the points."""
        return Solved(*(part[kept] for part in self))

    @property
    def weights(self) -> Floats:
        """What each point counts for in a fit: the density, tempered, so that far ones hardly matter; (n,) array."""
        below = self.log_density - self.log_density.max()
        return np.asarray(np.exp(np.maximum(below, _LOWEST) / _TEMPERATURE))


@dataclass(frozen=True, eq=False)
class Surrogate:
    """Polynomials for the frequencies of all modes that the likelihood looks at.

    Attributes
    ----------
    columns : (n_fitted,) array of int
        The parameters that frequencies depend on.
    centre : (n_fitted,) array
    whitening : (n_fitted, n_fitted) array
        Takes parameters less the centre to coordinates u of unit spread.
    bent : dict of (n_bent, n_fitted) array
        For each order above the second directions of u, the one first along which ln f is bent most.
    coefficients : (n_terms, n_modes) array
        Of 1, u_i, u_i u_j, and of the products of so many coordinates along `bent`.
    """

    columns: NDArray[np.intp]
    centre: Floats
    whitening: Floats
    bent: Mapping[int, Floats]
    coefficients: Floats

    @classmethod
    def fitted(cls, points: Solved, columns: NDArray[np.intp], along_bent: Mapping[int, int] = ALONG_BENT) -> Surrogate:
        """By weighted least squares, to the points that are plates: first of second order, which tells what is bent.

        Where the points count for too few by their weights it stays at that.

        Parameters
        ----------
        points : Solved
        columns : (n_fitted,) array of int
        along_bent : dict of int
            Orders above the second, and along how many of the directions in which ln f is bent most.
        """
        points = points.where(np.isfinite(points.log_frequency).all(axis=1) & np.isfinite(points.log_density))
        x, weights = points.theta[:, columns], points.weights
        factor = np.linalg.cholesky(np.atleast_2d(np.cov(x.T, aweights=weights)))
        centre = np.average(x, axis=0, weights=weights)
        none = np.empty((0, points.log_frequency.shape[1]))
        second = cls(columns, centre, np.asarray(np.linalg.inv(factor).T), {}, none)._fitted_to(points)
        if weights.sum() ** 2 < _POINTS_PER_TERM * n_terms(columns.size, along_bent) * (weights**2).sum():
            return second
        most_bent = second._most_bent()
        return replace(second, bent={order: most_bent[:n] for order, n in along_bent.items()})._fitted_to(points)

    def _fitted_to(self, points: Solved) -> Surrogate:
        roots = np.sqrt(points.weights)[:, None]
        found = np.linalg.lstsq(roots * self._terms(points.theta), roots * points.log_frequency, rcond=None)[0]
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
def _factors(order: int, n: int) -> NDArray[np.intp]:
    """Which of n coordinates each product of so many of them has: (n_products, order) array."""
    return np.array(list(combinations_with_replacement(range(n), order)), dtype=np.intp)


def n_terms(n_parameters: int, along_bent: Mapping[int, int] = ALONG_BENT) -> int:
    """How many coefficients a surrogate has for each mode."""
    orders = {0: n_parameters, 1: n_parameters, 2: n_parameters, **along_bent}
    return sum(len(_factors(order, min(n, n_parameters))) for order, n in orders.items())


@dataclass(frozen=True, eq=False, kw_only=True)
class SurrogatePosterior(Posterior):
    """The posterior with frequencies from a surrogate of its law, and an end where that knows nothing.

    Priors and likelihood are the same.
    """

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


def acceptance(log_ratios: Floats) -> float:
    """How often the end of a walk on a surrogate will be accepted under the law, where walks forget their start.

    Modes that belong to no peak may be wrong at no cost, and where two modes that cross by a hair are sorted by
    frequency no polynomial follows either; so a surrogate is judged by what its errors do to the density.

    Parameters
    ----------
    log_ratios : (n_draws,) array
        ln of the posterior's density less that of the surrogate's, at draws of the latter. Weighted with their ratio
        these are draws of the former, where walks begin. Infinite where one of them is zero: such ends are refused.
    """
    finite = log_ratios[np.isfinite(log_ratios)]
    if not finite.size:
        return 0.0
    starts = np.exp(finite - finite.max())
    return float(starts @ accepted_from(log_ratios) / starts.sum())


def accepted_from(log_ratios: Floats) -> Floats:
    """The same for walks from each of the draws where both densities are above zero: (n_finite,) array."""
    finite = log_ratios[np.isfinite(log_ratios)]
    gains = np.minimum(finite[None, :] - finite[:, None], 0.0)
    return np.asarray(np.exp(gains).sum(axis=1) / log_ratios.size)


def find_surrogate(
    posterior: Posterior, centre: Floats, covariance: Floats, coordinates: TailCoordinates
) -> Surrogate | None:
    """Fit a surrogate to the law of a posterior, or find that none serves.

    Each round fits it anew, walks on it, and compares it with the law where the walkers then are. Those places join the
    points of the next rounds, and so do others from a walk that is tempered, and such as steps of the chain will
    propose: a surrogate that is too low in a tail of the posterior would hold a walker there for long.

    Parameters
    ----------
    posterior : Posterior
    centre, covariance : (n_dim,) and (n_dim, n_dim) arrays
        Normal approximation.
    coordinates : TailCoordinates
        In which the walkers walk.

    Returns
    -------
    Surrogate or None
        None if no walk on one would be accepted half of the time, within a few rounds.
    """
    columns, bounds = posterior.parameters.fitted_columns, posterior.parameters.fitted_bounds
    n_points = max(_FEWEST_POINTS, _POINTS_PER_TERM * n_terms(columns.size))
    rng = np.random.default_rng(0)
    theta = rng.multivariate_normal(centre, _WIDER**2 * covariance, n_points)
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower, bounds.upper)
    points, found = _solved(posterior, coordinates, theta), None
    for n_rounds in range(1, _MOST_ROUNDS + 1):
        surrogate = Surrogate.fitted(points, columns)
        density = coordinates.density(with_surrogate(posterior, surrogate))
        walked = _solved(posterior, coordinates, _walked(density, 1.0, coordinates, theta, rng))
        held_out = walked.where(walked.log_density > points.log_density.max() - _FAR - theta.shape[1])
        log_ratios = held_out.log_density - density(coordinates.y(held_out.theta))
        if 2 * len(log_ratios) > n_points and acceptance(log_ratios) >= LEAST_ACCEPTANCE:
            found = surrogate
            if n_rounds >= _FEWEST_ROUNDS and accepted_from(log_ratios).min() >= _LEAST_ANYWHERE:
                return found
        further_out = _solved(posterior, coordinates, _walked(density, _TEMPERATURE, coordinates, theta, rng))
        proposal = Proposal.fitted(coordinates.y(walked.theta))
        proposed = _solved(posterior, coordinates, coordinates.theta(proposal.points(n_points, rng)))
        points = Solved(*(np.concatenate(parts) for parts in zip(points, walked, further_out, proposed, strict=True)))
        theta = walked.theta
    return found


def _solved(posterior: Posterior, coordinates: TailCoordinates, theta: Floats) -> Solved:
    """Frequencies and log density in the coordinates of the walk, by the law itself."""
    by_setup = posterior.every_log_frequency(theta)
    likelihood = posterior.log_likelihood_of(by_setup, theta).sum(axis=1)
    log_density = posterior.log_prior(theta) + likelihood + coordinates.log_jacobian(coordinates.y(theta))
    return Solved(theta, np.concatenate(by_setup, axis=1), log_density)


def _walked(
    density: LogPosterior, temperature: float, coordinates: TailCoordinates, theta: Floats, rng: np.random.Generator
) -> Floats:
    """As many points, walked to where a surrogate's posterior is, which has that density in the walk's coordinates."""

    def tempered(points: Floats) -> Floats:
        return density(points) / temperature

    n_walkers = -(-len(theta) // _N_TAKEN)
    coords = coordinates.y(theta)
    start = coords[:n_walkers]
    archive, proposal = coords[None, :_N_ARCHIVED], Proposal.one_fitted(coords)
    steps = Steps(tempered, proposal, archive, "ID" * (_N_STEPS // 2), n_walkers, [rng])
    draws = advance(steps, start[None], tempered(start)[None], _N_STEPS).draws
    taken = draws[0, -1 :: -(_N_STEPS // (2 * _N_TAKEN))][:_N_TAKEN]
    return coordinates.theta(taken.reshape(-1, coords.shape[1])[: len(theta)])
