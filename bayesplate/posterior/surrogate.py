"""A law between linear and exact: ln f of each mode as a polynomial of low order in the sampled parameters.

It is fitted by least squares to the exact law where the posterior is: first at draws of the normal approximation, then
at draws of its own posterior, until it holds at draws that it was not fitted to. It costs microseconds per draw,
however many effects the board has. The walkers walk on it and the exact law accepts or rejects where they end
(`bayesplate.posterior.moves.CorrectedSteps`), so that its error costs steps and never moves the posterior.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import comb
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
_REACH = 5.0
"""Standard deviations of the points beyond which the polynomial goes on level: it knows nothing there."""
_POINTS_PER_TERM = 3
_MOST_TERMS = 400
_FEWEST_POINTS = 512
_FEWEST_ROUNDS, _MOST_ROUNDS = 3, 8
_TEMPERATURE, _LOWEST = 4.0, -40.0
_FAR = 15.0
"""Points whose log density is lower than the highest by this and the number of parameters are no part of the posterior:
of a normal one less than a millionth lies there."""
_N_STEPS, _N_TAKEN = 40, 4
_N_ARCHIVED = 128
_BATCH = 2048
LEAST_ACCEPTANCE = 0.5
"""Of walks on a surrogate that serves. Below, most evaluations of the exact law would be for steps that are refused."""


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
    degree : int
        2 or 3.
    coefficients : (n_terms, n_modes) array
        Of 1, u_i, u_i u_j and, in third order, u_i u_j u_k.
    """

    columns: NDArray[np.intp]
    centre: Floats
    whitening: Floats
    degree: int
    coefficients: Floats

    @classmethod
    def fitted(cls, points: Solved, columns: NDArray[np.intp], degree: int) -> Surrogate:
        """By weighted least squares, to the points that are plates."""
        points = points.where(np.isfinite(points.log_frequency).all(axis=1) & np.isfinite(points.log_density))
        x, weights = points.theta[:, columns], points.weights
        factor = np.linalg.cholesky(np.cov(x.T, aweights=weights))
        none = np.empty((0, points.log_frequency.shape[1]))
        centre = np.average(x, axis=0, weights=weights)
        bare = cls(columns, centre, np.asarray(np.linalg.inv(factor).T), degree, none)
        roots = np.sqrt(weights)[:, None]
        found = np.linalg.lstsq(roots * bare._terms(points.theta), roots * points.log_frequency, rcond=None)[0]
        return replace(bare, coefficients=np.asarray(found, dtype=np.float64))

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
        first, second = np.triu_indices(len(u))
        products = u[first] * u[second]
        groups = [np.ones((1, u.shape[1])), u, products]
        if self.degree == 3:
            groups += [row * products[first >= i] for i, row in enumerate(u)]
        return np.concatenate(groups).T


def n_terms(n_parameters: int, degree: int) -> int:
    """How many coefficients a polynomial of that degree has."""
    return comb(n_parameters + degree, degree)


@dataclass(frozen=True, eq=False, kw_only=True)
class SurrogatePosterior(Posterior):
    """The posterior with frequencies from a surrogate of its law; priors and likelihood are the same."""

    surrogate: Surrogate

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
    gains = np.minimum(finite[None, :] - finite[:, None], 0.0)
    return float(starts @ np.exp(gains).sum(axis=1) / starts.sum()) / log_ratios.size


def find_surrogate(
    posterior: Posterior, centre: Floats, covariance: Floats, coordinates: TailCoordinates
) -> Surrogate | None:
    """Fit a surrogate to the law of a posterior, or find that none serves.

    Each round fits it anew, walks on it, and compares it with the law where the walkers then are; those places join the
    points of the next rounds. The degree rises from 2 to 3 once there are points enough for its coefficients: the
    better the surrogate, the more ends of walks are accepted.

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
    n_of = {degree: _POINTS_PER_TERM * n_terms(columns.size, degree) for degree in (2, 3)}
    n_points = max(_FEWEST_POINTS, n_of[2])
    highest_degree = next(n for n in (3, 2) if n_terms(columns.size, n) <= _MOST_TERMS or n == 2)
    rng = np.random.default_rng(0)
    theta = rng.multivariate_normal(centre, _WIDER**2 * covariance, n_points)
    theta[:, columns] = np.clip(theta[:, columns], bounds.lower, bounds.upper)
    points, found = _solved(posterior, coordinates, theta), None
    for n_rounds in range(1, _MOST_ROUNDS + 1):
        degree = highest_degree if n_of[highest_degree] <= len(points.theta) else 2
        surrogate = Surrogate.fitted(points, columns, degree)
        last = points.theta[-n_points:]
        density = coordinates.density(with_surrogate(posterior, surrogate))
        walked = _solved(posterior, coordinates, _walked(density, coordinates, last, rng))
        held_out = walked.where(walked.log_density > points.log_density.max() - _FAR - theta.shape[1])
        log_ratios = held_out.log_density - density(coordinates.y(held_out.theta))
        if 2 * len(log_ratios) > len(walked.theta) and acceptance(log_ratios) >= LEAST_ACCEPTANCE:
            found = surrogate
            if degree == highest_degree and n_rounds >= _FEWEST_ROUNDS:
                return found
        points = Solved(*(np.concatenate(parts) for parts in zip(points, walked, strict=True)))
    return found


def _solved(posterior: Posterior, coordinates: TailCoordinates, theta: Floats) -> Solved:
    """Frequencies and log density in the coordinates of the walk, by the law itself."""
    by_setup = posterior.every_log_frequency(theta)
    likelihood = posterior.log_likelihood_of(by_setup, theta).sum(axis=1)
    log_density = posterior.log_prior(theta) + likelihood + coordinates.log_jacobian(coordinates.y(theta))
    return Solved(theta, np.concatenate(by_setup, axis=1), log_density)


def _walked(density: LogPosterior, coordinates: TailCoordinates, theta: Floats, rng: np.random.Generator) -> Floats:
    """As many points, walked to where a surrogate's posterior is, which has that density in the walk's coordinates."""
    n_walkers = -(-len(theta) // _N_TAKEN)
    coords = coordinates.y(theta)
    start = coords[:n_walkers]
    archive, proposal = coords[None, :_N_ARCHIVED], Proposal.one_fitted(coords)
    steps = Steps(density, proposal, archive, "ID" * (_N_STEPS // 2), n_walkers, [rng])
    draws = advance(steps, start[None], density(start)[None], _N_STEPS).draws
    taken = draws[0, -1 :: -(_N_STEPS // (2 * _N_TAKEN))][:_N_TAKEN]
    return coordinates.theta(taken.reshape(-1, coords.shape[1])[: len(theta)])
