"""How walkers move: proposals that look at no other walker, so that those of all walkers are evaluated together.

Independent
    Drawn from a mixture of Student distributions that was fitted to the warm-up. Such a proposal depends on no walker,
    so those of all walkers and of many steps ahead are evaluated in one call; only accepting them goes step by step. It
    is accepted more often than not and then forgets everything.
Differential
    The walker plus a difference of two draws of an archive, which is a part of the warm-up too. It keeps what the
    mixture does not know, curvature and tails, in reach.

Proposal and archives are fixed once the warm-up ends, and the warm-up is discarded. Each step then is a Metropolis
update of one walker by itself: with the ratio of the proposal's densities where it is independent, without one where it
is differential, for a difference of the archive is as probable as its opposite. So each step leaves the posterior of
every walker unchanged, and so does any fixed order of steps. Nothing adapts on draws that are kept. An ensemble has its
own random numbers and its own archive and never looks at another one: its draws are those that it would make alone.

Where a surrogate stands for a costly density, a step of the chain is a walk of several such updates under the
surrogate, whose end is accepted or not under the density itself (`CorrectedSteps`).

References
----------
L. Tierney, Markov chains for exploring posterior distributions, Annals of Statistics 22 (1994): independent proposals.
C. J. F. ter Braak and J. A. Vrugt, Differential evolution Markov chain with snooker updater and fewer chains,
Statistics and Computing 18 (2008): differences of an archive.
J. S. Liu, Monte Carlo Strategies in Scientific Computing (2001), 9.4.3: surrogate transitions.
J. A. Christen and C. Fox, Markov chain Monte Carlo using an approximation, J. Comput. Graph. Stat. 14 (2005).
"""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from bayesplate.posterior.proposals import Proposal
from bayesplate.posterior.starting import Evaluate, LogPosterior

FloatArray = NDArray[np.float64]
Generators = Sequence[np.random.Generator]

ORDERS = ((0.3, "IIID"), (0.15, "ID"), (0.0, "IDDD"))
"""Of the steps, by the acceptance that independent ones will have: where it is good they are most of them, for they
are cheap and forget everything; where it is poor, as with twenty parameters and more, differential ones must do it."""
_SHORT = 0.25
"""Of whole differences, which overshoot where a tail of the posterior is thinner than its middle."""
DIRECT_EVERY = 8
"""Every so many steps one is an independent one under the density itself, so that places which the surrogate does not
know, where it has next to no probability, are entered and left at their right rate."""


def order_for(log_ratios: FloatArray) -> str:
    """Order of the steps, one letter each, repeated as long as wanted.

    Parameters
    ----------
    log_ratios : (n_draws,) array
        ln of the density less that of the proposal, at draws of the density. If they are normal with the variance v,
        independent proposals are accepted with the probability 2 Phi(-sqrt(v / 2)).
    """
    acceptance = 2.0 * ndtr(-np.sqrt(0.5 * np.var(log_ratios)))
    return next((order for least, order in ORDERS if acceptance >= least), ORDERS[-1][1])


def walk_order(order: str, n_dim: int) -> str:
    """Order of the updates of one walk under a surrogate, longer where there are more parameters to forget.

    The same backwards: only then may the end of a walk be corrected as it is.
    """
    there = order * max(1, round(n_dim / 5))
    return there + there[::-1]


def differences(archive: FloatArray, n_differences: int, rng: np.random.Generator) -> FloatArray:
    """Differences of an archive's pairs, as emcee's move proposes them, half of them short: (n_differences, n_dim)."""
    import emcee

    move = emcee.moves.DEMove()
    move.setup(archive)
    legacy = SimpleNamespace(choice=rng.choice, randn=lambda *shape: rng.standard_normal(shape))  # names of emcee's
    whole = np.asarray(move.get_proposal(np.zeros((n_differences, archive.shape[1])), [archive], legacy)[0])
    return whole * np.where(rng.random(n_differences) < 0.5, 1.0, _SHORT)[:, None]


def log_uniform(n: int, rng: np.random.Generator) -> FloatArray:
    """Logarithms of uniform random numbers, which those of ratios of densities are compared with: (n,) array."""
    with np.errstate(divide="ignore"):  # zero is among them
        return np.asarray(np.log(rng.random(n)))


def _beside(drawn: Sequence[FloatArray], n_walkers: int) -> FloatArray:
    """One ensemble beside the other: (n_some, n_ensembles * n_walkers, ...) from one (n_some * n_walkers, ...) each."""
    return np.concatenate([part.reshape(-1, n_walkers, *part.shape[1:]) for part in drawn], axis=1)


class Steps:
    """Metropolis updates of many walkers under one density, with all random numbers drawn in advance; an emcee move.

    Parameters
    ----------
    density : callable, (n_points, n_dim) -> (n_points,) array
        Logarithm of the density.
    proposal : Proposal
    archives : (n_ensembles, n_archived, n_dim) array
    order : str
        One letter per update, "I" or "D".
    n_walkers : int
        Of each ensemble.
    rngs : sequence of Generator
        One per ensemble.
    n_updates : int
        In each step of emcee's chain; more than one make a walk.
    """

    def __init__(
        self,
        density: LogPosterior,
        proposal: Proposal,
        archives: FloatArray,
        order: str,
        n_walkers: int,
        rngs: Generators,
        n_updates: int = 1,
    ) -> None:
        self.density, self.proposal, self.archives = density, proposal, archives
        self.n_walkers, self.n_updates = n_walkers, n_updates
        n_dim = archives.shape[-1]
        n_of = {kind: order.count(kind) for kind in "ID"}

        points = _beside([proposal.points(n_of["I"] * n_walkers, rng) for rng in rngs], n_walkers)
        pairs = zip(archives, rngs, strict=True)
        jumps = _beside([differences(archive, n_of["D"] * n_walkers, rng) for archive, rng in pairs], n_walkers)
        thresholds = _beside([log_uniform(len(order) * n_walkers, rng) for rng in rngs], n_walkers)
        flat = points.reshape(-1, n_dim)
        shape = points.shape[:-1]
        log_prob = density(flat).reshape(shape) if flat.size else np.empty(shape)
        self._independent = iter(zip(points, log_prob, proposal.log_density(points), strict=True))
        self._differential = iter(jumps)
        self._thresholds = iter(thresholds)
        self._order = iter(order)
        self._seen: FloatArray | None = None
        self._proposed_there = np.empty(0)  # ln of the proposal's density at the coordinates that were seen last

    def walked(self, coords: FloatArray, log_prob: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        """All walkers after the updates of one step: coordinates, log densities, and which have moved."""
        moved = np.zeros(len(coords), dtype=np.bool_)
        for _ in range(self.n_updates):
            coords, log_prob, accepted = self._updated(coords, log_prob)
            moved |= accepted
        return coords, log_prob, moved

    def _updated(self, coords: FloatArray, log_prob: FloatArray) -> tuple[FloatArray, FloatArray, NDArray[np.bool_]]:
        is_independent = next(self._order) == "I"
        if is_independent:
            points, proposed, log_density = next(self._independent)
            here = self._proposed_there if coords is self._seen else self.proposal.log_density(coords)
            with np.errstate(invalid="ignore"):  # both may be minus infinity
                log_ratio = proposed - log_density - (log_prob - here)
        else:
            points = coords + next(self._differential)
            proposed = self.density(points)
            with np.errstate(invalid="ignore"):
                log_ratio = proposed - log_prob
        accepted = next(self._thresholds) < log_ratio
        after = np.where(accepted[:, None], points, coords)
        if is_independent:
            self._seen, self._proposed_there = after, np.where(accepted, log_density, here)
        return after, np.where(accepted, proposed, log_prob), accepted

    def propose(self, _: Any, state: Any) -> tuple[Any, NDArray[np.bool_]]:
        """One step of emcee's chain."""
        state.coords, state.log_prob, moved = self.walked(state.coords, state.log_prob)
        return state, moved


class CorrectedSteps:
    """Walks under a surrogate whose ends are accepted or not under the density itself; an emcee move.

    A walk reads the same backwards and each of its updates is reversible under the surrogate, so its end y is as
    probable after x under the surrogate's density s as x after y. Accepted with the probability

        min(1, [p(y) / s(y)] / [p(x) / s(x)])

    it leaves the density p itself unchanged, however wrong the surrogate is; a wrong one only costs acceptance. The
    costly density is evaluated once for each walk, for all walkers together, and what it finds stays with the walkers.

    Parameters
    ----------
    walks : Steps
        Under the surrogate, in the order of `walk_order`, one walk per step.
    evaluate : callable, (n_points, n_dim) -> (n_points,) and (n_points, n_blobs) arrays
        The density, and what it finds on the way.
    n_steps : int
    rngs : sequence of Generator
        One per ensemble, those of the walks.
    """

    def __init__(self, walks: Steps, evaluate: Evaluate, n_steps: int, rngs: Generators) -> None:
        self.walks, self.evaluate = walks, evaluate
        self._is_direct = iter([step % DIRECT_EVERY == 0 for step in range(n_steps)])
        n_direct = -(-n_steps // DIRECT_EVERY)
        found: list[FloatArray] = []

        def density(points: FloatArray) -> FloatArray:
            log_prob, blobs = evaluate(points)
            found.append(blobs.reshape(n_direct, len(points) // n_direct, blobs.shape[1]))
            return log_prob

        self._direct = Steps(density, walks.proposal, walks.archives, "I" * n_direct, walks.n_walkers, rngs)
        self._found = iter(found[0])
        self._thresholds = iter(_beside([log_uniform(n_steps * walks.n_walkers, rng) for rng in rngs], walks.n_walkers))

    def propose(self, model: Any, state: Any) -> tuple[Any, NDArray[np.bool_]]:
        """One step of emcee's chain."""
        if next(self._is_direct):
            state, moved = self._direct.propose(model, state)
            state.blobs = np.where(moved[:, None], next(self._found), state.blobs)
            return state, moved
        at_start = self.walks.density(state.coords)
        coords, at_end, moved = self.walks.walked(state.coords, at_start)
        log_prob, blobs = state.log_prob.copy(), state.blobs.copy()
        if moved.any():
            log_prob[moved], blobs[moved] = self.evaluate(coords[moved])
        with np.errstate(invalid="ignore"):
            log_ratio = (log_prob - at_end) - (state.log_prob - at_start)
        accepted = moved & (next(self._thresholds) < log_ratio)
        state.coords = np.where(accepted[:, None], coords, state.coords)
        state.log_prob = np.where(accepted, log_prob, state.log_prob)
        state.blobs = np.where(accepted[:, None], blobs, state.blobs)
        return state, accepted
