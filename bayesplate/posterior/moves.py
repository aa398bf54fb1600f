"""A move of emcee whose proposals depend on no walker: drawn from a mixture that was fitted to the posterior before.

Such a proposal is accepted more often than not and then forgets everything, where stretch and differential moves take
tens of steps. Those stay beside it, for what the mixture does not know: curvature and tails.

References
----------
L. Tierney, Markov chains for exploring posterior distributions, Annals of Statistics 22 (1994): independent proposals.
J. Goodman and J. Weare, Ensemble samplers with affine invariance, Comm. Appl. Math. Comp. Sci. 5 (2010): stretch moves.
C. J. F. ter Braak, A Markov chain Monte Carlo version of the genetic algorithm differential evolution, Statistics and
Computing 16 (2006).
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.posterior.mixture import Mixture

_INDEPENDENT, _DIFFERENTIAL, _STRETCH = 0.76, 0.18, 0.06
"""Shares of the steps."""
_AHEAD = 16
"""Steps whose proposals are evaluated in one call, for they depend on no walker."""


class IndependentMove:
    """A Metropolis update of every walker by itself, with a proposal from a mixture of Student distributions."""

    def __init__(self, mixture: Mixture) -> None:
        self.mixture = mixture
        self._ahead: Iterator[tuple[Floats, Floats, Floats]] = iter(())

    def propose(self, model: Any, state: Any) -> tuple[Any, Bools]:
        """One step of emcee's chain."""
        points, log_prob, log_ratio = next(self._ahead, None) or self._drawn(model, len(state.coords))
        before = state.log_prob - self.mixture.log_density(state.coords)
        with np.errstate(divide="ignore"):  # zero is among the random numbers
            threshold = np.log(model.random.random_sample(len(points)))
        accepted = threshold < log_ratio - before
        state.coords = np.where(accepted[:, None], points, state.coords)
        state.log_prob = np.where(accepted, log_prob, state.log_prob)
        return state, accepted

    def _drawn(self, model: Any, n_walkers: int) -> tuple[Floats, Floats, Floats]:
        """Proposals of the next steps, their log densities, and these less those of the mixture; the first is given."""
        points = self.mixture.points(_AHEAD * n_walkers, model.random)
        log_prob = model.log_prob_fn(points)
        log_ratio = log_prob - self.mixture.log_density(points)
        by_step = (part.reshape(_AHEAD, n_walkers, *part.shape[1:]) for part in (points, log_prob, log_ratio))
        self._ahead = zip(*by_step, strict=True)
        return next(self._ahead)


def moves(mixture: Mixture) -> list[tuple[Any, float]]:
    """Independent proposals, and emcee's differential and stretch moves beside them, with their shares of the steps."""
    import emcee

    return [
        (IndependentMove(mixture), _INDEPENDENT),
        (emcee.moves.DEMove(), _DIFFERENTIAL),
        (emcee.moves.StretchMove(), _STRETCH),
    ]
