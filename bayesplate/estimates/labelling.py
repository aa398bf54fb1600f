"""Labels proposed for peaks that have none: where the posterior is looked for, and what its tables call the peaks.

The likelihood sums over all assignments of peaks to modes (`bayesplate.frequencies.peaks`), so that a label which is
proposed here says nothing there. But a search for the posterior has to begin somewhere, and a residual needs a mode.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.cards import PriorCard
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.wide_search import Guess, search_widely
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood, takes_part
from bayesplate.frequencies.system import system_of
from bayesplate.labels import Label
from bayesplate.plate.board import Board
from bayesplate.plate.material import RIGIDITIES
from bayesplate.plate.measured import Peak, Reading
from bayesplate.plate.readings import ReadingErrors
from bayesplate.plate.setup import Setup

LIKELY = 0.5
"""Probability from which on a label is proposed: no two peaks can have the same one."""
_N_DRAWS = 64
_STEPS = 2
"""Of least squares that begin where others ended."""
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
    spread : (3, 3) array
        Covariance of ln D between the likely ways to take the peaks; zero where there is but one.
    """

    board: Board
    spread: NDArray[np.float64]


def propose_labels(board: Board, prior: PriorCard, least: float = LIKELY) -> Proposed:
    """The board with a reading for each peak that is likely one certain mode.

    From the constants that the labelled modes give, with their uncertainty, each peak is assigned where it likely
    belongs; the constants are fitted anew to all of them; and again, until no label changes. Where the labels do not
    determine the constants, all of the prior is searched for constants to begin with.

    Parameters
    ----------
    board : Board
    prior : PriorCard
        For the first labels of a board that has too few.
    least : float
        Probability from which on a label is given in the end; on the way there it is one half.

    Returns
    -------
    Proposed
        The same board where every label is sure and no peak lacks one.
    """
    none = np.zeros((len(RIGIDITIES), len(RIGIDITIES)))
    if not any(takes_part(setup) for setup in board.setups):
        return Proposed(board, none)
    tried: list[tuple[Setup, ...]] = []
    every = (_settled(board, guess, least, tried) for guess in _guesses(board, prior))
    found = [one for one in every if one is not None]
    if len(found) < 2:
        return Proposed(found[0][0] if found else board, none)
    judged = [one for one in (_judged(*each) for each in found) if one is not None]
    if not judged:
        return Proposed(found[0][0], none)
    likelihoods, constants = np.array([one[0] for one in judged]), np.array([one[1] for one in judged])
    best = int(np.argmax(likelihoods))
    weights = np.exp(likelihoods - likelihoods[best])
    off = constants - constants[best]
    return Proposed(judged[best][2], (off.T * weights / weights.sum()) @ off)


def _settled(
    board: Board, guess: Guess, least: float, tried: list[tuple[Setup, ...]]
) -> tuple[Board, NDArray[np.float64]] | None:
    """The labels that come out of a first guess of the constants, and the rigidities that go with them.

    None where they came up from another guess.
    """
    before: list[tuple[Setup, ...]] = []
    while True:
        labelled = _labelled(board, guess, LIKELY)
        n_readings = sum(len(setup.readings) for setup in labelled.setups)
        if labelled.setups in before or len(before) == _MOST_ROUNDS or n_readings < len(RIGIDITIES):
            return labelled if least == LIKELY else _labelled(board, guess, least), guess.rigidities
        if labelled.setups in tried:
            return None
        before.append(labelled.setups)
        tried.append(labelled.setups)
        estimate = weighted_least_squares(_of_labelled(labelled), _STEPS, guess.rigidities)
        if identifiability(estimate.sensitivities, estimate.scales).blind():
            return labelled if least == LIKELY else _labelled(board, guess, least), guess.rigidities
        guess = _guess_of(board, estimate)


def _guesses(board: Board, prior: PriorCard) -> list[Guess]:
    """The constants that the labelled modes determine, or those of all the prior where the peaks are likely."""
    if sum(len(setup.readings) for setup in board.setups) >= len(RIGIDITIES):
        estimate = weighted_least_squares(_of_labelled(board))
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


def _judged(board: Board, start: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], Board] | None:
    """ln of the likelihood of a labelled board at its own estimate, at the noise that suits it best, and ln D there."""
    if sum(len(setup.readings) for setup in board.setups) < len(RIGIDITIES):
        return None
    estimate = weighted_least_squares(_of_labelled(board), _STEPS, start)
    levels = np.exp(np.linspace(-1.0, 3.0, _N_LEVELS))
    total = np.zeros(_N_LEVELS)
    for setup in board.setups:
        log_sd = setup.noise.log_sd
        noise = setup.noise.median * levels**log_sd
        model = setup_model(system_of(board, setup), estimate.values)
        model = with_others(model, estimate.values) if takes_part(setup) else model
        every = np.repeat(model.every_log_frequency(estimate.values, "linear"), _N_LEVELS, axis=0)
        sure = np.array([reading.is_sure for reading in setup.readings], dtype=bool)
        errors = ReadingErrors.of(setup).at(sure)
        by_level = errors.log_likelihood(every[:, : sure.size][:, sure], noise).sum(axis=1)
        peaks = PeakLikelihood.of(model)
        by_level = by_level if peaks is None else by_level + peaks.log_likelihood(every, noise)
        total += by_level - 0.5 * np.log(levels) ** 2
    return float(total.max()), np.log(estimate.rigidities), board


def _labelled(board: Board, guess: Guess, least: float) -> Board:
    """The board with the labels that its peaks likely have at a guess of the constants."""
    return replace(board, setups=tuple(_labelled_setup(board, setup, guess, least) for setup in board.setups))


def _labelled_setup(board: Board, setup: Setup, guess: Guess, least: float) -> Setup:
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
    return with_labels(setup, peaks, peaks.probabilities(every[usable], noise), least)


def with_labels(setup: Setup, peaks: PeakLikelihood, probabilities: NDArray[np.float64], least: float) -> Setup:
    """A setup with labels for the peaks that are one mode with a probability above the least one.

    Parameters
    ----------
    setup : Setup
        Labels that were proposed for it before are forgotten.
    peaks : PeakLikelihood
        Of this setup.
    probabilities : (n_peaks, n_modes) array
        Of each peak to be each mode.
    least : float
        At least one half, so that no two peaks have the same label.

    Returns
    -------
    Setup
    """
    likely = [_likely(peaks.labels, row, least) for row in probabilities]
    of_reading = {int(at): label for at, label in zip(peaks.readings, likely, strict=True) if at >= 0}
    of_bare = {int(at): label for at, label in zip(peaks.bare, likely, strict=True) if at >= 0}
    stated = {at: reading for at, reading in enumerate(setup.readings) if reading.confidence > 0}
    taken = {one.stated or one.label for at, one in stated.items() if of_reading.get(at) is None}
    readings, bare, rest = [], [], []
    for at, reading in enumerate(setup.readings):
        peak = Peak(reading.frequency, reading.sign, reading.amplitude, reading.damping)
        bare += [] if at in stated else [(peak, of_reading[at])]
    bare += [(peak, of_bare[i]) for i, peak in enumerate(setup.peaks)]
    for at, reading in stated.items():
        given = reading.stated or reading.label
        found = of_reading.get(at)
        used = given if found is None or found in taken else found
        readings.append(replace(_at(setup, reading, used), stated=None if used == given else given))
    for peak, found in sorted(bare, key=lambda one: one[0].frequency.mean):
        if found is None or found in taken:
            rest.append(peak)
        else:
            reading = Reading(found, (0, 0), peak.frequency, peak.sign, 0.0, None, peak.amplitude, peak.damping)
            readings.append(_at(setup, reading, found))
    return replace(setup, readings=tuple(readings), peaks=tuple(rest))


def _at(setup: Setup, reading: Reading, label: Label) -> Reading:
    """A reading with another label."""
    return replace(reading, label=label, beams=(label.m - setup.first_label.m, label.n - setup.first_label.n))


def _likely(labels: Sequence[Label | None], probabilities: NDArray[np.float64], least: float) -> Label | None:
    best = int(np.argmax(probabilities))
    return labels[best] if probabilities[best] > least else None
