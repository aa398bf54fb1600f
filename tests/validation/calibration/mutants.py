"""Wrong posteriors that calibration has to find out: forgotten data, wrong noise or sign, a mode counted twice."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from validation.calibration.layouts import LABELS, TWICE

from bayesplate.board.board import Board
from bayesplate.board.quantity import Quantity
from bayesplate.board.setup import DEFAULT_NOISE
from bayesplate.posterior.posing import PosedProblem
from bayesplate.posterior.target import Posterior

HALF_NOISE = Quantity.from_median(0.5 * DEFAULT_NOISE.median, 1.02)
NARROWER = {"spread 0.7 of itself": 0.7, "spread 0.8 of itself": 0.8}
"""By the mutant's name, what is left of the distance of each draw from their mean."""


def narrowed(draws: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Draws with so much of their distance from their mean: (n_draws, n_dim) array."""
    middle = draws.mean(axis=0)
    return middle + factor * (draws - middle)


@dataclass(frozen=True, eq=False, kw_only=True)
class CountedTwice(Posterior):
    """The posterior of readings of which one is taken for two."""

    mode: int = 0

    def log_likelihood_of(
        self, mode_log_frequencies: Sequence[NDArray[np.float64]], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        found = super().log_likelihood_of(mode_log_frequencies, theta)
        return np.concatenate([found, found[:, [self.mode]]], axis=1)


def counted_twice(problem: PosedProblem, edges: str) -> PosedProblem:
    """The same problem with the reading of `TWICE` counted twice."""
    one = problem.posterior
    place = LABELS[edges].index(TWICE[edges])
    posterior = CountedTwice(one.board, one.prior, one.models, one.law, one.robust, mode=place)
    return replace(problem, posterior=posterior, is_forced=True)


def half_noise(board: Board) -> Board:
    """The board whose noise is believed to be half of its prior's median."""
    return replace(board, setups=tuple(replace(setup, noise=HALF_NOISE) for setup in board.setups))


def flipped_sign(board: Board) -> Board:
    """The board whose Poisson ratio is believed to have the other sign."""
    (poisson,) = (one.prior for one in board.parameters if one.name == "poisson_xy")
    return board.with_priors({"poisson_xy": replace(poisson, mean=-poisson.mean, lower=-np.inf, upper=np.inf)})


BELIEFS: dict[str, Callable[[Board], Board]] = {
    "noise fixed at half": half_noise,
    "sign of the Poisson ratio flipped": flipped_sign,
}
"""By the mutant's name, the board that the analysis believes in."""
TWICE_COUNTED = "one mode counted twice"
FITTED = (*BELIEFS, TWICE_COUNTED)
"""The mutants that take another fit."""
