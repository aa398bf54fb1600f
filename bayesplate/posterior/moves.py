"""A move of emcee with proposals independent of the walkers, drawn from a mixture that was fitted to the posterior.

Such a proposal is accepted more often than not, and an accepted one is independent of the walker's past, where stretch
and differential moves take tens of steps. Those moves are used as well, for curvature and tails that the mixture lacks.

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
"""Shares of the steps with each kind of move."""
_STEPS_AHEAD = 16
"""Number of steps whose proposals are evaluated in one call: they do not depend on the walkers."""


class IndependentMove:
    """A Metropolis update of each walker alone, with a proposal from a mixture of Student distributions."""

    def __init__(self, mixture: Mixture) -> None:
        self.mixture = mixture
        self._proposals: Iterator[tuple[Floats, Floats, Floats]] = iter(())

    def propose(self, model: Any, state: Any) -> tuple[Any, Bools]:
        """One step of emcee's chain."""
        points, log_prob, log_ratio = next(self._proposals, None) or self._draw_proposals(model, len(state.coords))
        current_log_ratio = state.log_prob - self.mixture.log_density(state.coords)
        with np.errstate(divide="ignore"):  # zero is among the random numbers
            threshold = np.log(model.random.random_sample(len(points)))
        accepted = threshold < log_ratio - current_log_ratio
        state.coords = np.where(accepted[:, None], points, state.coords)
        state.log_prob = np.where(accepted, log_prob, state.log_prob)
        return state, accepted

    def _draw_proposals(self, model: Any, n_walkers: int) -> tuple[Floats, Floats, Floats]:
        """Draw the next proposals, with their log densities and ln of posterior over mixture; return the first step."""
        points = self.mixture.points(_STEPS_AHEAD * n_walkers, model.random)
        log_prob = model.log_prob_fn(points)
        log_ratio = log_prob - self.mixture.log_density(points)
        by_step = (array.reshape(_STEPS_AHEAD, n_walkers, *array.shape[1:]) for array in (points, log_prob, log_ratio))
        self._proposals = zip(*by_step, strict=True)
        return next(self._proposals)


def moves(mixture: Mixture) -> list[tuple[Any, float]]:
    """The independent move and emcee's differential and stretch moves, with their shares of the steps."""
    import emcee

    return [
        (IndependentMove(mixture), _INDEPENDENT),
        (emcee.moves.DEMove(), _DIFFERENTIAL),
        (emcee.moves.StretchMove(), _STRETCH),
    ]
