"""The likelihood of what is shared from one board, everything that is the board's own integrated out.

At each node of the shared parameters the integral is taken by importance draws. They come from a mixture that was
fitted to the board's own posterior draws about their regression on the shared parameters, so that it follows a node
away from where these draws are; where it follows badly it is moved, and if need be fitted anew, by its own weighted
draws. The same random numbers serve all nodes: what error they leave is nearly the same everywhere, and drops out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.posterior.proposals import DEGREES_OF_FREEDOM, Proposal
from bayesplate.posterior.reweighting import effective_draws

Floats = NDArray[np.float64]
LogDensity = Callable[[Floats, Floats], Floats]
"""From (n, n_own) and (n, n_shared) arrays to the log density of the data and of what is the board's own: (n,)."""

N_DRAWS = 1024
_GOOD, _POOR = 0.25, 0.08
"""Effective share of the draws from which the mixture stays where it is, and below which it is fitted anew."""
_MOVES = 3
_FAR = 8.0
"""Standard deviations of a squared distance from the nearest part of the mixture beyond which there is nothing."""
_STUDENT = (DEGREES_OF_FREEDOM - 2.0) / DEGREES_OF_FREEDOM
"""Covariance's square distances from those in units of a Student distribution's scale matrix."""
_WIDER = 1.15
"""Factor on what an anew fitted mixture covers: weighted draws know little of their tails."""


@dataclass(frozen=True, eq=False)
class Marginal:
    """ln of a board's marginal likelihood at nodes, and what draws the board's own parameters there.

    Attributes
    ----------
    nodes : (n_nodes, n_shared) array
        Standard coordinates of the shared parameters.
    log_likelihood : (n_nodes,) array
        -inf where the board excludes a node.
    effective : (n_nodes,) array
        How many draws of equal weight each rests on.
    proposals : tuple of Proposal
        Of the board's own parameters, one per node.
    follow : callable
        Takes shared parameters to what the own ones are on average where these are.
    """

    nodes: Floats
    log_likelihood: Floats
    effective: Floats
    proposals: tuple[Proposal, ...]
    follow: Callable[[Floats], Floats]

    def error(self, node: int) -> float:
        """Standard error of the log likelihood at a node, by its effective draws."""
        return float(self.effective[node] ** -0.5)

    def nearest(self, z: Floats) -> NDArray[np.intp]:
        """The node nearest to each point: (n,) array."""
        scale = self.nodes.std(axis=0)
        away = (z[:, None, :] - self.nodes[None]) / np.where(scale > 0, scale, 1.0)
        return np.argmin((away**2).sum(axis=2), axis=1)

    def draw_own(self, z: Floats, rng: np.random.Generator) -> tuple[Floats, Floats]:
        """Proposals of what is the board's own at points of the shared parameters, and ln of their density.

        Parameters
        ----------
        z : (n, n_shared) array
        rng : numpy.random.Generator

        Returns
        -------
        own : (n, n_own) array
        log_density : (n,) array
        """
        nearest = self.nearest(z)
        shift = self.follow(z) - self.follow(self.nodes)[nearest]
        own, log_density = np.empty_like(shift), np.empty(len(z))
        for node in np.unique(nearest):
            rows = nearest == node
            proposal = self.proposals[node]
            points, log_density[rows] = _near(proposal, *_drawn(proposal, int(rows.sum()), rng))
            own[rows] = points + shift[rows]
        return own, log_density


@dataclass(frozen=True, eq=False)
class _Tried:
    """Draws from a mixture at a node, with their weights."""

    proposal: Proposal
    points: Floats
    log_weights: Floats

    @property
    def weights(self) -> Floats:
        shares = np.exp(self.log_weights - self.log_weights.max())
        return np.asarray(shares / shares.sum())

    @property
    def effective(self) -> float:
        return effective_draws(self.weights) if np.isfinite(self.log_weights.max()) else 0.0

    @property
    def log_mean(self) -> float:
        top = float(self.log_weights.max())
        return top + float(np.log(np.mean(np.exp(self.log_weights - top)))) if np.isfinite(top) else -np.inf


def marginal_likelihood(
    log_density: LogDensity, own: Floats, z: Floats, nodes: Floats, rng: np.random.Generator, n_draws: int = N_DRAWS
) -> Marginal:
    """Integrate over what is a board's own, at each node of what is shared.

    Parameters
    ----------
    log_density : callable
        See `LogDensity`.
    own, z : (n, n_own) and (n, n_shared) arrays
        Draws of the board's own posterior under whatever prior of the shared parameters.
    nodes : (n_nodes, n_shared) array
    rng : numpy.random.Generator
    n_draws : int
        At each node.

    Returns
    -------
    Marginal
    """
    follow = _regression(own, z)
    mixture = Proposal.fitted(own - follow(z))
    base, log_base = _near(mixture, *_drawn(mixture, n_draws, rng))
    centres = follow(nodes)
    order = np.argsort(np.square((nodes - z.mean(axis=0)) / (z.std(axis=0) + 1e-12)).sum(axis=1))
    moved = np.zeros_like(centres)
    done: list[int] = []
    log_likelihood, effective = np.full(len(nodes), -np.inf), np.zeros(len(nodes))
    proposals = [mixture] * len(nodes)

    def at(node: int, move: Floats) -> _Tried:
        points = base + centres[node] + move
        density = log_density(points, np.broadcast_to(nodes[node], (n_draws, nodes.shape[1])))
        return _Tried(_shifted(mixture, centres[node] + move), points, density - log_base)

    for node in (int(i) for i in order):
        if done:
            moved[node] = moved[done[int(np.argmin(np.square(nodes[done] - nodes[node]).sum(axis=1)))]]
        best = at(node, moved[node])
        for _ in range(_MOVES):
            if best.effective >= _GOOD * n_draws or best.effective == 0.0:
                break
            move = best.weights @ best.points - centres[node] - base.mean(axis=0)
            tried = at(node, move)
            if tried.effective <= best.effective:
                break
            best, moved[node] = tried, move
        if 0.0 < best.effective < _POOR * n_draws:
            best = _fitted_anew(log_density, nodes[node], best, rng)
        log_likelihood[node], effective[node], proposals[node] = best.log_mean, best.effective, best.proposal
        if best.effective > 0.0:
            done.append(node)
    return Marginal(nodes, log_likelihood, effective, tuple(proposals), follow)


def _regression(own: Floats, z: Floats) -> Callable[[Floats], Floats]:
    """Takes shared parameters to what the own ones are on average where these are: linear least squares."""
    middle = z.mean(axis=0)
    columns = np.column_stack([np.ones(len(z)), z - middle])
    slopes = np.linalg.lstsq(columns, own, rcond=None)[0]
    return lambda at: np.column_stack([np.ones(len(at)), at - middle]) @ slopes


def _drawn(proposal: Proposal, n: int, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Draws from a mixture, and ln of its density there."""
    points = proposal.points(n, rng)
    return points, proposal.log_density(points)


def _near(proposal: Proposal, points: Floats, log_drawn: Floats) -> tuple[Floats, Floats]:
    """Draws, those far beyond everything that the mixture was fitted to being taken for impossible.

    Its tails reach to where a surrogate knows nothing of the law. There the density is infinite, so that the weight is
    zero.
    """
    n = points.shape[1]
    squares = np.min([part.squared_distances(points) for part in proposal.parts], axis=0) * _STUDENT
    return points, np.where(squares > n + _FAR * np.sqrt(2.0 * n), np.inf, log_drawn)


def _shifted(proposal: Proposal, by: Floats) -> Proposal:
    return replace(proposal, parts=tuple(replace(part, centre=part.centre + by) for part in proposal.parts))


def _fitted_anew(log_density: LogDensity, node: Floats, tried: _Tried, rng: np.random.Generator) -> _Tried:
    """One Student distribution where the weighted draws are, as long as it serves better."""
    n_draws = len(tried.points)
    for _ in range(_MOVES):
        weights = tried.weights**0.5  # tempered: a few draws would otherwise be all that is seen
        weights = weights / weights.sum()
        centre = weights @ tried.points
        away = tried.points - centre
        proposal = Proposal.with_covariance(centre, _WIDER**2 * (weights[:, None] * away).T @ away)
        points, log_drawn = _drawn(proposal, n_draws, rng)
        density = log_density(points, np.broadcast_to(node, (n_draws, node.size)))
        again = _Tried(proposal, points, density - log_drawn)
        if again.effective <= tried.effective:
            break
        tried = again
    return tried
