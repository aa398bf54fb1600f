"""First labels for peaks that have none, or doubtful ones: from where a search for the posterior begins.

From a guess of the constants follow labels, from these better constants, and so on; where the sure labels do not make a
guess, all of the prior is searched for some (`bayesplate.estimates.wide_search`). Of several answers the likeliest is
taken, and how far the others lie from it is told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY, with_labels
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.wide_search import Guess, search_widely
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood, takes_part
from bayesplate.frequencies.system import system_of
from bayesplate.plate.board import Board
from bayesplate.plate.material import RIGIDITIES
from bayesplate.plate.setup import Setup
from bayesplate.posterior.target import Posterior

_N_DRAWS = 64
_STEPS = 2
"""Of least squares that begin where others ended."""
_NEAR = 1e-4
"""Of ln D, near enough to label peaks."""
_N_LEVELS = 17
_MOST_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Proposed:
    """A board with labels for its peaks, and how far other ways to label them would move the constants.

    Attributes
    ----------
    board : Board
        Readings with a proposed label follow the labelled ones of their setup, with the confidence 0; peaks without a
        likely label stay peaks.
    rigidities : (3,) array or None
        D_x, D_y, D_s near those of its readings, N m; None where there is nothing to propose.
    spread : (3, 3) array
        Covariance of ln D between the likely ways to take the peaks; zero where there is but one.
    """

    board: Board
    rigidities: NDArray[np.float64] | None
    spread: NDArray[np.float64]


def propose_labels(board: Board, prior: PriorCard) -> Proposed:
    """The board with a reading for each peak that is likely one certain mode.

    From the constants that the labelled modes give, with their uncertainty, each peak is assigned where it likely
    belongs; the constants are fitted anew to all of them; and again, until no label changes. Where the labels do not
    determine the constants, all of the prior is searched for constants to begin with.

    Parameters
    ----------
    board : Board
    prior : PriorCard
        For the first labels of a board that has too few.

    Returns
    -------
    Proposed
        The same board where every label is sure and no peak lacks one.
    """
    none = np.zeros((len(RIGIDITIES), len(RIGIDITIES)))
    if not any(takes_part(setup) for setup in board.setups):
        return Proposed(board, None, none)
    tried: list[tuple[Setup, ...]] = []
    every = (_settled(board, guess, tried) for guess in _guesses(board, prior))
    found = [one for one in every if one is not None]
    if len(found) < 2:
        return Proposed(*found[0], none) if found else Proposed(board, None, none)
    judged = [one for one in (_judged(each, prior, start) for each, start in found) if one is not None]
    if not judged:
        return Proposed(*found[0], none)
    likelihoods, constants = np.array([one[0] for one in judged]), np.array([one[1] for one in judged])
    best = int(np.argmax(likelihoods))
    weights = np.exp(likelihoods - likelihoods[best])
    off = constants - constants[best]
    return Proposed(judged[best][2], np.exp(constants[best]), (off.T * weights / weights.sum()) @ off)


def _settled(board: Board, guess: Guess, tried: list[tuple[Setup, ...]]) -> tuple[Board, NDArray[np.float64]] | None:
    """The labels that come out of a first guess of the constants, and the rigidities that go with them.

    None where they came up from another guess.
    """
    before: list[tuple[Setup, ...]] = []
    while True:
        labelled = _labelled(board, guess)
        n_readings = sum(len(setup.readings) for setup in labelled.setups)
        if labelled.setups in before or len(before) == _MOST_ROUNDS or n_readings < len(RIGIDITIES):
            return labelled, guess.rigidities
        if labelled.setups in tried:
            return None
        before.append(labelled.setups)
        tried.append(labelled.setups)
        estimate = weighted_least_squares(_of_labelled(labelled), _STEPS, guess.rigidities)
        if identifiability(estimate.sensitivities, estimate.scales).blind():
            return labelled, guess.rigidities
        guess = _guess_of(board, estimate)


def _guesses(board: Board, prior: PriorCard) -> list[Guess]:
    """The constants that the labelled modes determine, or those of all the prior where the peaks are likely."""
    if sum(len(setup.readings) for setup in board.setups) >= len(RIGIDITIES):
        estimate = weighted_least_squares(_of_labelled(board), accepted=_NEAR)
        if not identifiability(estimate.sensitivities, estimate.scales).blind():
            return [_guess_of(board, estimate)]
    n_peaks = sum(len(setup.readings) + len(setup.peaks) for setup in board.setups)
    return search_widely(board, prior, np.random.default_rng(0)) if n_peaks >= len(RIGIDITIES) else []


def _guess_of(board: Board, estimate: Estimate) -> Guess:
    """An estimate with its uncertainty; residuals beyond the expected noise widen both."""
    spare = max(estimate.residuals.size - len(RIGIDITIES), 1)
    widening = max(float(np.sqrt(np.sum((estimate.residuals / estimate.scales) ** 2) / spare)), 1.0)
    covariance = widening**2 * identifiability(estimate.sensitivities, estimate.scales).covariance
    logs = np.random.default_rng(0).multivariate_normal(np.log(estimate.rigidities), covariance, _N_DRAWS)
    return Guess(estimate.values, logs, widening * max(setup.noise.median for setup in board.setups))


def _of_labelled(board: Board) -> Board:
    """The board with those setups only that have a reading."""
    return replace(board, setups=tuple(setup for setup in board.setups if setup.readings))


def _judged(
    board: Board, prior: PriorCard, start: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64], Board] | None:
    """ln of the likelihood of a labelled board at its own estimate, at the noise that suits it best, and ln D there."""
    if sum(len(setup.readings) for setup in board.setups) < len(RIGIDITIES):
        return None
    estimate = weighted_least_squares(_of_labelled(board), _STEPS, start)
    models = [setup_model(system_of(board, setup), estimate.values) for setup in board.setups]
    models = [with_others(one, estimate.values) if takes_part(one.setup) else one for one in models]
    posterior = Posterior(board, prior, models, "linear")
    medians, log_sds = np.array([(setup.noise.median, setup.noise.log_sd) for setup in board.setups]).T
    noises = medians * np.exp(np.outer(np.linspace(-1.0, 3.0, _N_LEVELS), log_sds))
    theta = np.stack([posterior.parameters.theta(estimate.values, noise) for noise in noises])
    by_level = posterior.log_likelihood(theta).sum(axis=1) + posterior.parameters.log_prior_noise(theta)
    return float(by_level.max()), np.log(estimate.rigidities), board


def _labelled(board: Board, guess: Guess) -> Board:
    """The board with the labels that its peaks likely have at a guess of the constants."""
    return replace(board, setups=tuple(_labelled_setup(board, setup, guess) for setup in board.setups))


def _labelled_setup(board: Board, setup: Setup, guess: Guess) -> Setup:
    if not takes_part(setup):
        return setup
    model = with_others(setup_model(system_of(board, setup), guess.values), guess.values)
    peaks = PeakLikelihood.of(model)
    assert peaks is not None
    # Where a guess is off, few peaks are near a mode: they are taken for one the sooner, and the next guess is better.
    peaks = replace(peaks, log_alone=peaks.log_alone - np.log(peaks.log_alone.size))
    values = {**guess.values, **dict(zip(RIGIDITIES, np.exp(guess.log_rigidities).T, strict=True))}
    every = model.every_log_frequency(values, "linear")
    usable = np.isfinite(every).all(axis=1)
    noise = np.full(int(usable.sum()), guess.noise)
    return with_labels(setup, peaks, peaks.probabilities(every[usable], noise), LIKELY)
