"""First labels for peaks that have none, or doubtful ones: the start of a search for the posterior.

A guess of the constants gives labels, these give better constants, and so on; where the sure labels do not determine
the constants, guesses are searched for in all of the prior (`bayesplate.estimates.wide_search`). Of several labellings
the most probable is taken, with the spread of the others about it; labellings too far apart for a sampler to walk
between them are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES, Moduli, moduli_of
from bayesplate.board.prior import PriorCard
from bayesplate.board.setup import Setup
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY_LABEL, label_likely_peaks
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares, with_read_setups
from bayesplate.estimates.unusual import MOST_ORTHOTROPIC
from bayesplate.estimates.wide_search import Guess, are_far_apart, search_widely
from bayesplate.frequencies.model import setup_model, with_other_modes
from bayesplate.frequencies.peaks import PeakLikelihood, needs_assignment
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import with_peak_modes
from bayesplate.posterior.target import Posterior

_N_DRAWS = 64
_STEPS = 2
"""Steps of least squares that start from an earlier estimate."""
_TOLERANCE = 1e-4
"""Accepted error of ln D: accurate enough to label peaks."""
_N_LEVELS = 17
_MOST_ROUNDS = 8
FEWEST_PEAKS = 4
"""Three peaks determine three constants whatever their labels."""
_UNUSUAL_PROBABILITY = 0.02
"""Prior probability that a plate is stiffer along y than along x, or more orthotropic than any wood."""
POSSIBLE_PROBABILITY = 0.02
"""Probability at which a second, distant labelling is possible, so that none may be chosen."""
MODEL_ERROR = 0.01
"""Relative error of a plate's modes due to missing effects: labellings are compared at no smaller noise."""


@dataclass(frozen=True, eq=False)
class Labelling:
    """A labelling of the peaks of a board, with its constants and probability."""

    board: Board  # with labels for the peaks that are likely one certain mode
    log_rigidities: Floats  # (n_constants,), ln of the free rigidities (N m), close to the estimate from its readings
    log_density: float  # ln of the posterior density there, at the most probable noise
    log_density_at_model_error: float  # the same at a noise of at least `MODEL_ERROR`

    @property
    def moduli(self) -> Moduli:
        """E_x, E_y, G_xy, Pa, at the nominal inputs."""
        nominal = self.board.nominal()
        rigidities = self.board.symmetry.rigidities(np.exp(self.log_rigidities), nominal["poisson_xy"])
        return moduli_of({**nominal, **rigidities})

    @property
    def is_usual(self) -> bool:
        """Whether the plate is stiffer along x, and not more orthotropic than any wood."""
        return bool(1.0 <= self.moduli.E_x / self.moduli.E_y <= MOST_ORTHOTROPIC)

    def is_far_from(self, other: Labelling) -> bool:
        """Whether the constants are too far from the other ones for a sampler to walk between them."""
        return are_far_apart(self.log_rigidities, other.log_rigidities)


@dataclass(frozen=True, eq=False)
class ProposedLabels:
    """A board with labels for its peaks, and the spread of the constants between likely labellings.

    Readings with a proposed label follow the labelled ones of their setup, with the confidence 0; peaks without a
    likely label stay peaks.
    """

    board: Board
    rigidities: Floats | None = None  # D_x, D_y, D_s, N m, close to the estimate; None without proposed labels
    spread: Floats | None = None  # (n_constants, n_constants), covariance of ln D between likely labellings


def propose_labels(board: Board, prior: PriorCard) -> ProposedLabels:
    """The board with a reading for each peak that is likely one certain mode.

    Each peak is assigned to its likely mode by the constants from the labelled modes, with their uncertainty; the
    constants are fitted again to all labelled peaks, and so on until no label changes. Where the labels do not
    determine the constants, all of the prior is searched for starting constants. NotIdentifiableError if another
    labelling is possible, with constants far away.
    """
    if not any(needs_assignment(setup) for setup in board.setups):
        return ProposedLabels(board)
    candidates = _find_labellings(board, _first_guesses(board, prior))
    labellings = _assess_labellings(candidates, prior) if len(candidates) > 1 else []
    if not labellings:
        return ProposedLabels(*candidates[0]) if candidates else ProposedLabels(board)
    leading = choose_labelling(labellings)
    nearby = [labelling for labelling in labellings if not labelling.is_far_from(leading)]
    best = max(nearby, key=lambda labelling: labelling.log_density)
    deviations = np.array([labelling.log_rigidities for labelling in nearby]) - best.log_rigidities
    shares = softmax([labelling.log_density for labelling in nearby])
    rigidities = board.symmetry.rigidities(np.exp(best.log_rigidities), board.nominal()["poisson_xy"])
    return ProposedLabels(
        best.board, np.array([float(rigidities[name]) for name in RIGIDITIES]), (deviations.T * shares) @ deviations
    )


def probable_labellings(board: Board, prior: PriorCard) -> list[tuple[Labelling, float]]:
    """Labellings of the peaks of a board without labels, with their probabilities, the most probable first.

    A plate may differ from the board by `MODEL_ERROR`, and is rarely stiffer along y than along x, which is along the
    grain on cards. Empty where the board has a label already, or too few peaks.
    """
    if any(setup.readings for setup in board.setups) or sum(len(setup.peaks) for setup in board.setups) < FEWEST_PEAKS:
        return []
    labellings = _assess_labellings(
        _find_labellings(board, search_widely(board, prior, np.random.default_rng(0))), prior
    )
    labellings = [
        labelling
        for labelling in labellings
        if sum(len(setup.readings) for setup in labelling.board.setups) >= FEWEST_PEAKS
    ]
    log_shares = [
        labelling.log_density_at_model_error + (0.0 if labelling.is_usual else np.log(_UNUSUAL_PROBABILITY))
        for labelling in labellings
    ]
    return (
        sorted(zip(labellings, softmax(log_shares).tolist(), strict=True), key=lambda pair: -pair[1])
        if labellings
        else []
    )


def choose_labelling(labellings: Sequence[Labelling]) -> Labelling:
    """The most probable labelling, if all labellings with distant constants are improbable.

    A free plate has nearly the same frequencies with its grain along the other side, and few peaks fit several plates.
    With an arbitrarily small noise, effects that the plate lacks would decide between them. NotIdentifiableError if a
    distant labelling is possible as well, with the constants of each and the label that would decide.
    """
    distinct: list[Labelling] = []
    for labelling in sorted(labellings, key=lambda labelling: -labelling.log_density_at_model_error):
        if all(labelling.is_far_from(other) for other in distinct):
            distinct.append(labelling)
    shares = softmax([labelling.log_density_at_model_error for labelling in distinct])
    possible = [
        (labelling, share) for labelling, share in zip(distinct, shares, strict=True) if share >= POSSIBLE_PROBABILITY
    ]
    if len(possible) < 2:
        return distinct[0]
    descriptions = [
        ", ".join(f"{name} {1e-9 * float(value):.3g}" for name, value in zip(MODULI, labelling.moduli, strict=True))
        + f" GPa ({100.0 * share:.0f} %)"
        for labelling, share in possible
    ]
    (first, _), (second, _), *_ = possible
    raise NotIdentifiableError(
        f"{first.board.name}: its peaks are modes of plates that lie far apart, {' or '.join(descriptions)}; "
        f"{_deciding_label(first, second)}give the label of a mode, or a prior that tells the material better"
    )


def _deciding_label(first: Labelling, second: Labelling) -> str:
    """Words on the first peak with different labels in two labellings; empty if there is none."""
    labels = [
        {
            (setup.name, reading.frequency.mean): reading.label
            for setup in labelling.board.setups
            for reading in setup.readings
        }
        for labelling in (first, second)
    ]
    for peak in sorted(labels[0].keys() & labels[1].keys(), key=lambda peak: peak[1]):
        first_label, second_label = (labels_by_peak[peak] for labels_by_peak in labels)
        if first_label != second_label:
            return f"the peak at {peak[1]:g} Hz is {first_label} in the first and {second_label} in the second: "
    return ""


def _find_labellings(board: Board, guesses: Sequence[Guess]) -> list[tuple[Board, Floats]]:
    """Distinct labelled boards that guesses of the constants lead to, with their rigidities."""
    visited: list[tuple[Setup, ...]] = []
    candidates = (_settle_labels(board, guess, visited) for guess in guesses)
    return [candidate for candidate in candidates if candidate is not None]


def _settle_labels(board: Board, guess: Guess, visited: list[tuple[Setup, ...]]) -> tuple[Board, Floats] | None:
    """Labels that a first guess of the constants leads to, with the rigidities; None where `visited` has them."""
    path: list[tuple[Setup, ...]] = []
    while True:
        labelled = _label_board(board, guess)
        n_readings = sum(len(setup.readings) for setup in labelled.setups)
        if labelled.setups in path or len(path) == _MOST_ROUNDS or n_readings < board.symmetry.n:
            return labelled, guess.rigidities
        if labelled.setups in visited:
            return None
        path.append(labelled.setups)
        visited.append(labelled.setups)
        estimate = weighted_least_squares(with_read_setups(labelled), _STEPS, guess.rigidities)
        if identifiability(estimate.sensitivities, estimate.scales, board.symmetry).undetermined_constants():
            return labelled, guess.rigidities
        guess = guess_of(board, estimate)


def _first_guesses(board: Board, prior: PriorCard) -> list[Guess]:
    """The constants that the labelled modes determine, or else guesses from all of the prior that explain the peaks."""
    if sum(len(setup.readings) for setup in board.setups) >= board.symmetry.n:
        estimate = weighted_least_squares(with_read_setups(board), accepted=_TOLERANCE)
        if not identifiability(estimate.sensitivities, estimate.scales, board.symmetry).undetermined_constants():
            return [guess_of(board, estimate)]
    n_peaks = sum(len(setup.readings) + len(setup.peaks) for setup in board.setups)
    if board.isotropic or n_peaks < len(RIGIDITIES):  # one label fixes all of an isotropic plate
        return []
    return search_widely(board, prior, np.random.default_rng(0))


def guess_of(board: Board, estimate: Estimate) -> Guess:
    """An estimate as a guess with its uncertainty; residuals beyond the expected noise widen covariance and noise."""
    symmetry = board.symmetry
    spare = max(estimate.residuals.size - symmetry.n, 1)
    widening = max(float(np.sqrt(np.sum((estimate.residuals / estimate.scales) ** 2) / spare)), 1.0)
    covariance = widening**2 * identifiability(estimate.sensitivities, estimate.scales, symmetry).covariance
    centre = np.log(symmetry.free_of(estimate.values))
    log_rigidities = np.random.default_rng(0).multivariate_normal(centre, covariance, _N_DRAWS)
    return Guess(estimate.values, log_rigidities, widening * max(setup.noise.median for setup in board.setups))


def _assess_labellings(candidates: Sequence[tuple[Board, Floats]], prior: PriorCard) -> list[Labelling]:
    """Labellings from labelled boards, each at its own estimate; boards with too few labels for one are left out."""
    determined = (
        candidate
        for candidate in candidates
        if sum(len(setup.readings) for setup in candidate[0].setups) >= candidate[0].symmetry.n
    )
    return [_assess_labelling(board, prior, start) for board, start in determined]


def _assess_labelling(board: Board, prior: PriorCard, start: Floats) -> Labelling:
    """The labelling of a labelled board, at its own estimate."""
    estimate = weighted_least_squares(with_read_setups(board), _STEPS, start)
    bare_models = [setup_model(system_of(board, setup), estimate.values) for setup in board.setups]
    models = with_peak_modes(bare_models, estimate.values)
    posterior = Posterior(board, prior, models, "linear")
    medians, log_sds = np.array([(setup.noise.median, setup.noise.log_sd) for setup in board.setups]).T
    noises = medians * np.exp(np.outer(np.linspace(-1.0, 3.0, _N_LEVELS), log_sds))
    theta = np.stack([posterior.parameters.theta(estimate.values, noise) for noise in noises])
    theta = np.concatenate([theta, [posterior.parameters.theta(estimate.values, np.maximum(medians, MODEL_ERROR))]])
    *by_level, at_model_error = (posterior.log_likelihood(theta).sum(axis=1) + posterior.log_prior(theta)).tolist()
    return Labelling(board, np.log(board.symmetry.free_of(estimate.values)), max(by_level), at_model_error)


def _label_board(board: Board, guess: Guess) -> Board:
    """The board with the likely labels of its peaks at a guess of the constants."""
    return replace(board, setups=tuple(_label_setup(board, setup, guess) for setup in board.setups))


def _label_setup(board: Board, setup: Setup, guess: Guess) -> Setup:
    if not needs_assignment(setup):
        return setup
    model = with_other_modes(setup_model(system_of(board, setup), guess.values), guess.values)
    peaks = PeakLikelihood.of(model)
    assert peaks is not None
    # At a wrong guess few peaks are near a mode: a smaller chance of being spurious assigns them for a better guess.
    peaks = replace(peaks, log_spurious=peaks.log_spurious - np.log(peaks.log_spurious.size))
    free = np.exp(guess.log_rigidities).T
    values = {**guess.values, **board.symmetry.rigidities(free, guess.values["poisson_xy"])}
    log_frequency = model.mode_log_frequencies(values, "linear")
    usable = np.isfinite(log_frequency).all(axis=1)
    noise = np.full(int(usable.sum()), guess.noise)
    return label_likely_peaks(setup, peaks, peaks.probabilities(log_frequency[usable], noise), LIKELY_LABEL)
