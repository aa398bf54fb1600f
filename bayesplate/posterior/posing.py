"""From a board to a problem of inference, in three steps: the estimate, the law that serves, and the posterior."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.board.material import RIGIDITIES
from bayesplate.board.prior import PriorCard
from bayesplate.board.sessions import with_discrepancies
from bayesplate.errors import InputError, NotIdentifiableError
from bayesplate.estimates.coefficients import coefficient_faults
from bayesplate.estimates.identifiability import (
    Identifiability,
    identifiability,
    require_identifiable,
    require_labels,
)
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.unusual import unusual
from bayesplate.frequencies.laws import LawName
from bayesplate.posterior.contradictions import require_possible_noise, require_reachable
from bayesplate.posterior.first_labels import Proposed, propose_labels
from bayesplate.posterior.laplace import LaplaceApproximation, laplace_approximation, linearisation_errors
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.slips import Remarks, is_too_wide, noise_remarks, reading_remarks
from bayesplate.posterior.target import Posterior, linear_suffices
from bayesplate.posterior.veerings import with_doubts

Floats = NDArray[np.float64]

_N_CHECKS = 256
_N_NAMED = 64
"""Of these checks, on which modes are named."""


@dataclass(frozen=True, eq=False)
class PosedProblem:
    """A board posed as a problem of inference: its estimate, both laws, and where the posterior lies.

    Attributes
    ----------
    posterior : Posterior
        Its models hold both laws.
    centre, covariance : (n_dim,) and (n_dim, n_dim) arrays
        Normal approximation of the posterior, for the starts.
    is_forced : bool
        Whether the law was asked for: then it is sampled itself, and no surrogate of it.
    veerings : tuple of str
        What is in doubt about labels near a veering, a sentence per setup.
    """

    board: Board
    prior: PriorCard
    estimate: Estimate
    identifiability: Identifiability
    posterior: Posterior
    centre: NDArray[np.float64]
    covariance: NDArray[np.float64]
    is_forced: bool = False
    veerings: tuple[str, ...] = ()

    @property
    def parameters(self) -> Parameters:
        """The sampled columns."""
        return self.posterior.parameters

    @cached_property
    def doubts(self) -> tuple[str, ...]:
        """What is unusual about the constants and the readings, before anything is sampled: a sentence each."""
        # where the uncertain inputs have moved: at their nominal sizes a soft core looks like another board
        there = self.parameters.values_at(self.centre)
        constants = unusual(self.board, self.prior, np.array([there[name] for name in RIGIDITIES]))
        return (*constants, *self.slips, *self._readings.others)

    @property
    def slips(self) -> tuple[str, ...]:
        """Those of the doubts that name a reading or two as a slip."""
        return self._readings.slips

    @cached_property
    def _readings(self) -> Remarks:
        if any(self.posterior.peaks):  # whose assignments say what a label may be
            return Remarks((), (*self.veerings, *noise_remarks(self.board, self.log_widening)))
        return reading_remarks(self.posterior, self.centre)

    @property
    def log_widening(self) -> float:
        """ln of the noise at the centre over the median of its prior, of the setup where that is most."""
        medians = np.array([setup.noise.median for setup in self.board.setups])
        return float(np.max(self.parameters.log_noise(self.centre[None])[0] - np.log(medians)))

    def under(self, law: LawName) -> PosedProblem:
        """The same problem under the law of that name."""
        return replace(self, posterior=replace_law(self.posterior, law))


def replace_law(posterior: Posterior, law: LawName) -> Posterior:
    """The same posterior under another law."""
    return Posterior(posterior.board, posterior.prior, posterior.models, law, posterior.robust)


def pose(board: Board, prior: PriorCard, *, law: LawName | None = None, robust: bool = False) -> PosedProblem:
    """Estimate by least squares, check that the constants are identifiable, build both laws and choose one.

    Parameters
    ----------
    law : "linear" or "exact", optional
        By default the linear law where its error over the normal approximation of the posterior, widened because the
        noise is not known, stays below a quarter of the expected noise for every mode.
    robust : bool
        Student's distribution for the noise.

    Returns
    -------
    PosedProblem
        Of the board with labels in doubt that may name another mode near a veering (`bayesplate.posterior.veerings`).

    Raises
    ------
    InputError
        If a published table is not of its setup's edges, aspect ratio and labels.
    NotIdentifiableError
        If the labelled modes leave a constant open, the prior excludes what they tell, or the declared noise does.
    """
    faults = coefficient_faults(board)
    if faults:
        raise InputError(faults)
    problem = _posed(propose_labels(board, prior), prior, law, robust)
    if law == "linear":  # as it was asked for: it follows the shapes, not the ranks
        return problem
    return _with_doubts(problem, law)


def _posed(proposed: Proposed, prior: PriorCard, law: LawName | None, robust: bool) -> PosedProblem:
    """The problem as the labels are."""
    located = _located(proposed, robust)
    approximation, board = located.approximation, located.board
    serving = _law_that_serves(board, approximation) if law is None else law
    posterior = Posterior(board, prior, approximation.models, serving, robust)
    centre, covariance = approximation.centre, approximation.covariance
    require_reachable(posterior, centre, covariance)
    require_possible_noise(posterior, centre)
    return PosedProblem(
        board, prior, located.estimate, located.identifiability, posterior, centre, covariance, law is not None
    )


@dataclass(frozen=True, eq=False)
class _Located:
    """Where the posterior of a board lies."""

    board: Board
    estimate: Estimate
    identifiability: Identifiability
    approximation: LaplaceApproximation


def _located(proposed: Proposed, robust: bool) -> _Located:
    """The estimate, if the labelled modes determine the constants there and where the posterior lies.

    Modes may stand there in another order than at the estimate.
    """
    board = with_discrepancies(proposed.board)
    require_labels(board)
    estimate = weighted_least_squares(board, start=proposed.rigidities)
    found = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    require_identifiable(board, found)
    approximation = laplace_approximation(board, estimate, robust, proposed.spread)
    there = Parameters(board).values_at(approximation.centre)
    sensitivities = np.concatenate([model.sensitivities(there) for model in approximation.models])
    require_identifiable(board, identifiability(sensitivities, estimate.scales, board.symmetry))
    return _Located(board, estimate, found, approximation)


def _law_that_serves(board: Board, approximation: LaplaceApproximation) -> LawName:
    draws = _plausible(board, approximation.centre, approximation.covariance)
    errors = linearisation_errors(board, approximation.models, draws)
    medians = [setup.noise.median for setup in board.setups]
    n_every = [len(model.every_place) for model in approximation.models]
    return "linear" if linear_suffices(n_every, errors, medians) else "exact"


def _with_doubts(problem: PosedProblem, law: LawName | None) -> PosedProblem:
    """The problem posed again with labels in doubt near a veering, where there are such."""
    draws = _plausible(problem.board, problem.centre, problem.covariance)[:_N_NAMED]
    named = problem.parameters.values(np.concatenate([problem.centre[None], draws]))
    doubted, remarks = with_doubts(problem.board, problem.posterior.models, named)
    if doubted is problem.board:
        return problem
    try:
        again = _posed(propose_labels(doubted, problem.prior), problem.prior, law, problem.posterior.robust)
    except NotIdentifiableError:
        return problem
    if all(is_too_wide(one.board, one.log_widening) for one in (problem, again)):
        return problem  # something else is wrong, and makes wrong plates look plausible
    return replace(again, veerings=remarks)


def _plausible(board: Board, centre: Floats, covariance: Floats) -> Floats:
    """Draws of the normal approximation, wider because the noise is not known, within the limits of the inputs."""
    draws = np.random.default_rng(0).multivariate_normal(centre, covariance, _N_CHECKS)
    parameters, columns = Parameters(board), Parameters(board).fitted_columns
    constants = slice(parameters.n_constants)
    draws[:, constants] += (_widening(board) - 1.0) * (draws - centre)[:, constants]
    limits = parameters.fitted_bounds
    draws[:, columns] = np.clip(draws[:, columns], limits.lower, limits.upper)
    return np.asarray(draws)


def _widening(board: Board) -> float:
    """How much wider the constants spread because the noise is not known: root mean square of noise over its median.

    The prior of ln noise and two for each reading to spare add up to its precision.
    """
    spare = max(sum(len(setup.readings) for setup in board.setups) - board.symmetry.n, 0)
    log_sd = max(setup.noise.log_sd for setup in board.setups)
    return float(np.exp(1.0 / (1.0 / log_sd**2 + 2.0 * spare)))
