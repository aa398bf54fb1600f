"""From a board to draws: the estimate, the law that serves, and the sampler; one call does it all."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.errors import InputError, NotIdentifiableError
from bayesplate.estimates.coefficients import coefficient_faults
from bayesplate.estimates.identifiability import (
    Identifiability,
    identifiability,
    require_identifiable,
    require_labels,
)
from bayesplate.estimates.labelling import LIKELY, with_labels
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.unusual import unusual
from bayesplate.frequencies.laws import LawName
from bayesplate.frequencies.model import SetupModel
from bayesplate.plate.board import Board
from bayesplate.plate.sessions import with_discrepancies
from bayesplate.posterior.checkpoint import Checkpoint
from bayesplate.posterior.contradictions import require_possible_noise, require_reachable
from bayesplate.posterior.convergence import Convergence
from bayesplate.posterior.doubts import Remarks, is_too_wide, noise_remarks, reading_remarks
from bayesplate.posterior.first_labels import propose_labels
from bayesplate.posterior.laplace import LaplaceApproximation, laplace_approximation, linearisation_errors
from bayesplate.posterior.parameters import Parameters
from bayesplate.posterior.sampling import Chains, Progress, SamplerSettings, sample
from bayesplate.posterior.statistics import effective_share, may_stand, resampled, smoothed
from bayesplate.posterior.surrogate import Surrogate, find_surrogate, with_surrogate
from bayesplate.posterior.tails import TailCoordinates
from bayesplate.posterior.target import Posterior, linear_suffices
from bayesplate.posterior.thinning import thin_walker_major
from bayesplate.posterior.veerings import veering_remarks, with_doubts
from bayesplate.streams import stream

Floats = NDArray[np.float64]

MOST_DRAWS_A_CHAIN, MOST_WEIGHTED_A_CHAIN = 4000, 1000
_N_CHECKS = 256
_N_NAMED = 64
"""Of these checks, on which modes are named."""


@dataclass(frozen=True, eq=False)
class PosedProblem:
    """A board posed as a problem of inference: its estimate, both laws, and where the posterior lies.

    Attributes
    ----------
    board : Board
    prior : PriorCard
    estimate : Estimate
    identifiability : Identifiability
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
        constants = unusual(self.board, self.prior, self.estimate.rigidities)
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


@dataclass(frozen=True, eq=False)
class Inference:
    """Draws of a problem and the verdict of the convergence gate.

    Attributes
    ----------
    problem : PosedProblem
    chains : Chains
        All that was walked: under the law of the problem, or under a surrogate of it.
    convergence : Convergence
    theta : (n_chains, n_draws, n_dim) array
        Draws of the posterior, thinned, chain = ensemble; those of a surrogate are drawn again by their weights.
    log_posterior : (n_chains, n_draws) array
    every_log_frequency : tuple of (n_chains * n_draws, n_every) array or None
        ln f (Hz) of all modes of each setup at these draws, where it is known.
    surrogate : Surrogate or None
        What the walkers walked on in place of the exact law.
    pareto_k : float or None
        k-hat of the weights from the surrogate to the exact law.
    """

    problem: PosedProblem
    chains: Chains
    convergence: Convergence
    theta: Floats
    log_posterior: Floats
    every_log_frequency: tuple[Floats, ...] | None = None
    surrogate: Surrogate | None = None
    pareto_k: float | None = None


def replace_law(posterior: Posterior, law: LawName) -> Posterior:
    """The same posterior under another law."""
    return Posterior(posterior.board, posterior.prior, posterior.models, law, posterior.robust)


def pose(board: Board, prior: PriorCard, *, law: LawName | None = None, robust: bool = False) -> PosedProblem:
    """Estimate by least squares, check that the constants are identifiable, build both laws and choose one.

    Parameters
    ----------
    board : Board
    prior : PriorCard
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
    problem, draws = _posed(board, prior, law, robust)
    if law == "linear":  # as it was asked for: it follows the shapes, not the ranks
        return problem
    named = problem.parameters.values(np.concatenate([problem.centre[None], draws[:_N_NAMED]]))
    doubted = with_doubts(problem.board, problem.posterior.models, named)
    if doubted is problem.board:
        return problem
    try:
        again, _ = _posed(doubted, prior, law, robust)
    except NotIdentifiableError:
        return problem
    if all(is_too_wide(one.board, one.log_widening) for one in (problem, again)):
        return problem  # something else is wrong, and makes wrong plates look plausible
    return replace(again, veerings=veering_remarks(problem.board, doubted))


def _posed(board: Board, prior: PriorCard, law: LawName | None, robust: bool) -> tuple[PosedProblem, Floats]:
    """The problem as the labels are, and (n_draws, n_dim) plausible plates: of the widened normal approximation."""
    proposed = propose_labels(board, prior)
    board = with_discrepancies(proposed.board)
    require_labels(board)
    estimate = weighted_least_squares(board, start=proposed.rigidities)
    found = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    require_identifiable(board, found)
    approximation = laplace_approximation(board, estimate, robust, proposed.spread)
    require_identifiable(board, _identifiable_at(board, approximation, estimate))
    is_forced = law is not None
    draws = _plausible(board, approximation)
    if law is None:
        errors = linearisation_errors(board, approximation.models, draws)
        medians = [setup.noise.median for setup in board.setups]
        n_every = [len(model.every_place) for model in approximation.models]
        law = "linear" if linear_suffices(n_every, errors, medians) else "exact"
    posterior = Posterior(board, prior, approximation.models, law, robust)
    require_reachable(posterior, approximation.centre, approximation.covariance)
    require_possible_noise(posterior, approximation.centre)
    problem = PosedProblem(
        board, prior, estimate, found, posterior, approximation.centre, approximation.covariance, is_forced
    )
    return problem, draws


def _plausible(board: Board, approximation: LaplaceApproximation) -> Floats:
    """Draws of the normal approximation, wider because the noise is not known, within the limits of the inputs."""
    draws = np.random.default_rng(0).multivariate_normal(approximation.centre, approximation.covariance, _N_CHECKS)
    parameters, columns = Parameters(board), Parameters(board).fitted_columns
    constants = slice(parameters.n_constants)
    draws[:, constants] += (_widening(board) - 1.0) * (draws - approximation.centre)[:, constants]
    limits = parameters.fitted_bounds
    draws[:, columns] = np.clip(draws[:, columns], limits.lower, limits.upper)
    return np.asarray(draws)


def labelled_by(inference: Inference, every_log_frequency: Sequence[Floats], noise: Floats) -> Inference:
    """The same draws where the peaks have the labels that these make likely.

    Labels that are proposed say nothing to the likelihood; they tell which mode a residual is of.

    Parameters
    ----------
    inference : Inference
    every_log_frequency : sequence of (n_draws, n_every) array
        ln f (Hz) of all modes, setup after setup, at draws of the posterior.
    noise : (n_draws, n_setups) array

    Returns
    -------
    Inference
        This one where no label changes.
    """
    problem = inference.problem
    setups = []
    for i, (setup, peaks) in enumerate(zip(problem.board.setups, problem.posterior.peaks, strict=True)):
        if peaks is not None:
            probabilities = peaks.probabilities(every_log_frequency[i], noise[:, i])
            setup = with_labels(setup, peaks, probabilities, LIKELY)
        setups.append(setup)
    board = replace(problem.board, setups=tuple(setups))
    if board.setups == problem.board.setups or sum(len(setup.readings) for setup in setups) < board.symmetry.n:
        return inference
    estimate = weighted_least_squares(board, start=problem.estimate.rigidities)
    before = problem.posterior
    models = tuple(model.labelled_as(setup) for model, setup in zip(before.models, setups, strict=True))
    posterior = Posterior(board, before.prior, models, before.law, before.robust)
    surrogate = inference.surrogate
    if surrogate is not None:
        columns = columns_of_each(before.models, models)
        starts = np.cumsum([0, *(len(model.every_place) for model in before.models)])[:-1]
        every = np.concatenate([start + own for start, own in zip(starts, columns, strict=True)])
        surrogate = replace(surrogate, coefficients=surrogate.coefficients[:, every])
    found = identifiability(estimate.sensitivities, estimate.scales, board.symmetry)
    again = replace(problem, board=board, estimate=estimate, identifiability=found, posterior=posterior)
    return replace(inference, problem=again, surrogate=surrogate)


def columns_of_each(before: Sequence[SetupModel], after: Sequence[SetupModel]) -> list[NDArray[np.intp]]:
    """Where the columns of each setup's model stood before it was labelled anew."""
    return [
        np.array([old.every_place.index(place) for place in new.every_place], dtype=np.intp)
        for old, new in zip(before, after, strict=True)
    ]


def _widening(board: Board) -> float:
    """How much wider the constants spread because the noise is not known: root mean square of noise over its median.

    The prior of ln noise and two for each reading to spare add up to its precision.
    """
    spare = max(sum(len(setup.readings) for setup in board.setups) - board.symmetry.n, 0)
    log_sd = max(setup.noise.log_sd for setup in board.setups)
    return float(np.exp(1.0 / (1.0 / log_sd**2 + 2.0 * spare)))


def _identifiable_at(board: Board, approximation: LaplaceApproximation, estimate: Estimate) -> Identifiability:
    """What the readings tell where the posterior lies; modes may stand there in another order than at the estimate."""
    there = Parameters(board).values_at(approximation.centre)
    sensitivities = np.concatenate([m.sensitivities(there) for m in approximation.models])
    return identifiability(sensitivities, estimate.scales, board.symmetry)


def infer(
    problem: PosedProblem,
    settings: SamplerSettings,
    *,
    checkpoint: Checkpoint | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Inference:
    """Sample the posterior of a problem in coordinates that shorten its tails.

    Under the exact law the walkers walk on a surrogate of it, unless the law was asked for, and the draws are weighted
    to the law by Pareto-smoothed importance sampling; where too few count, the law itself is sampled.

    Parameters
    ----------
    problem : PosedProblem
    settings : SamplerSettings
    checkpoint, progress
        See `bayesplate.posterior.sampling.sample`.

    Returns
    -------
    Inference
        Its chains are theta, the columns of `Parameters`, and the log density of theta under what was walked on.

    References
    ----------
    A. Vehtari, D. Simpson, A. Gelman, Y. Yao and J. Gabry, Pareto smoothed importance sampling, Journal of Machine
    Learning Research 25 (2024).
    """
    coordinates = TailCoordinates.around(
        problem.centre, problem.covariance, range(problem.parameters.n_constants), problem.parameters.effect_columns
    )
    posterior = problem.posterior

    def walked(density: Posterior, saved: Checkpoint | None) -> tuple[Chains, Convergence]:
        chains, convergence = sample(
            coordinates.density(density),
            coordinates.start,
            coordinates.start_covariance(problem.covariance),
            settings,
            names=problem.parameters.names,
            checkpoint=saved,
            progress=progress,
        )
        log_density = chains.log_prob - coordinates.log_jacobian(chains.draws)
        return Chains(coordinates.theta(chains.draws), log_density, chains.burn_in), convergence

    surrogate = None
    if posterior.law == "exact" and not problem.is_forced:
        surrogate = find_surrogate(posterior, problem.centre, problem.covariance, coordinates)
    if surrogate is not None:
        quick = with_surrogate(posterior, surrogate)
        found = walked(quick, None if checkpoint is None else checkpoint.part("surrogate"))
        weighted = _weighted(problem, surrogate, *found, stream(settings.seed, "weights"))
        if weighted is not None and (weighted.convergence.ess_min >= settings.gate.ess_min or not found[1].passed):
            return weighted
    chains, convergence = walked(posterior, checkpoint)
    theta, log_posterior = (
        thin_walker_major(part, chains.burn_in, convergence.tau_max, n_draws_max=MOST_DRAWS_A_CHAIN)
        for part in (chains.draws, chains.log_prob)
    )
    return Inference(problem, chains, convergence, theta, log_posterior)


def _weighted(
    problem: PosedProblem, surrogate: Surrogate, chains: Chains, convergence: Convergence, rng: np.random.Generator
) -> Inference | None:
    """Draws of a surrogate's posterior, drawn again by their weights under the law; None where too few count."""
    posterior = problem.posterior
    thinned, log_walked = (
        thin_walker_major(part, chains.burn_in, convergence.tau_max, n_draws_max=MOST_WEIGHTED_A_CHAIN)
        for part in (chains.draws, chains.log_prob)
    )
    n_chains, n_draws, n_dim = thinned.shape
    log_posterior, log_frequency = posterior.evaluate(thinned.reshape(-1, n_dim))
    weights, pareto_k = smoothed(log_posterior - log_walked.ravel())
    if not may_stand(weights, pareto_k):
        return None
    picked = np.concatenate(
        [i * n_draws + resampled(part, n_draws, rng) for i, part in enumerate(weights.reshape(n_chains, -1))]
    )
    share = effective_share(weights)
    ess = np.minimum(convergence.ess, thinned[..., 0].size) * share
    return Inference(
        problem,
        chains,
        replace(convergence, ess=ess, ess_min=float(ess.min())),
        thinned.reshape(-1, n_dim)[picked].reshape(thinned.shape),
        log_posterior[picked].reshape(n_chains, n_draws),
        tuple(posterior.by_setup(log_frequency[picked])),
        surrogate,
        pareto_k,
    )
