"""First labels for peaks that have none, or doubtful ones: the start of a search for the posterior.

From a guess of the constants follow labels, from these better constants, and so on; where the sure labels do not make a
guess, all of the prior is searched for some (`bayesplate.estimates.wide_search`). Of several answers the most probable
is taken, with the spread of the others about it; answers too far apart for one walk between them are refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.board.material import MODULI, RIGIDITIES, Moduli, moduli
from bayesplate.board.prior import PriorCard
from bayesplate.board.setup import Setup
from bayesplate.errors import NotIdentifiableError
from bayesplate.estimates.identifiability import identifiability
from bayesplate.estimates.labelling import LIKELY, with_labels
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.unusual import MOST_ORTHOTROPIC
from bayesplate.estimates.wide_search import Guess, are_far_apart, search_widely
from bayesplate.frequencies.model import setup_model, with_others
from bayesplate.frequencies.peaks import PeakLikelihood, takes_part
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import with_peaks
from bayesplate.posterior.target import Posterior

_N_DRAWS = 64
_STEPS = 2
"""Of least squares that begin where others ended."""
_NEAR = 1e-4
"""Of ln D, near enough to label peaks."""
_N_LEVELS = 17
_MOST_ROUNDS = 8
FEWEST_PEAKS = 4
"""Three fix the constants whatever they are called."""
_UNUSUAL = 0.02
"""Probability that a plate is stiffer along y than along x, or that no wood is as orthotropic."""
POSSIBLE = 0.02
"""Probability of another answer from which on it is an error to choose one."""
UNLIKE = 0.01
"""Relative error of a plate's own modes for an effect it lacks; answers are compared at no smaller noise."""


@dataclass(frozen=True, eq=False)
class Way:
    """One way to take the peaks of a board for modes."""

    board: Board  # with the labels of the peaks that are likely one certain mode
    log_rigidities: Floats  # (n_constants,), ln of the free rigidities (N m) near those of its readings
    log_density: float  # ln of the posterior density there, at the noise that suits it best
    log_density_unlike: float  # the same where the plate may be as unlike the board as `UNLIKE`

    @property
    def moduli(self) -> Moduli:
        """E_x, E_y, G_xy, Pa, at the nominal inputs."""
        nominal = self.board.nominal()
        found = self.board.symmetry.rigidities(np.exp(self.log_rigidities), nominal["poisson_xy"])
        return moduli(found["D_x"], found["D_y"], found["D_s"], nominal["thickness"], nominal["poisson_xy"])

    @property
    def is_usual(self) -> bool:
        """Whether the plate is stiffer along x, and no more than any wood is."""
        return bool(1.0 <= self.moduli.E_x / self.moduli.E_y <= MOST_ORTHOTROPIC)

    def is_far_from(self, other: Way) -> bool:
        """Whether no walk leads from these constants to the others."""
        return are_far_apart(self.log_rigidities, other.log_rigidities)


@dataclass(frozen=True, eq=False)
class Proposed:
    """A board with labels for its peaks, and how far other ways to label them would move the constants.

    Readings with a proposed label follow the labelled ones of their setup, with the confidence 0; peaks without a
    likely label stay peaks.
    """

    board: Board
    rigidities: Floats | None = None  # D_x, D_y, D_s near those of its readings, N m; None if nothing is proposed
    spread: Floats | None = None  # (n_constants, n_constants), covariance of ln D between the likely ways, if several


def propose_labels(board: Board, prior: PriorCard) -> Proposed:
    """The board with a reading for each peak that is likely one certain mode.

    From the constants that the labelled modes give, with their uncertainty, each peak is assigned where it likely
    belongs; the constants are fitted anew to all of them; and again, until no label changes. Where the labels do not
    determine the constants, all of the prior is searched for constants to begin with. NotIdentifiableError if the peaks
    may as well be taken another way, with constants that lie far off.
    """
    if not any(takes_part(setup) for setup in board.setups):
        return Proposed(board)
    found = _every_way(board, _guesses(board, prior))
    judged = _judged(found, prior) if len(found) > 1 else []
    if not judged:
        return Proposed(*found[0]) if found else Proposed(board)
    leading = only_way(judged)
    near = [one for one in judged if not one.is_far_from(leading)]
    best = max(near, key=lambda one: one.log_density)
    off = np.array([one.log_rigidities for one in near]) - best.log_rigidities
    shares = softmax([one.log_density for one in near])
    rigidities = board.symmetry.rigidities(np.exp(best.log_rigidities), board.nominal()["poisson_xy"])
    return Proposed(best.board, np.array([float(rigidities[name]) for name in RIGIDITIES]), (off.T * shares) @ off)


def probable_ways(board: Board, prior: PriorCard) -> list[tuple[Way, float]]:
    """Ways to take the peaks of a board without a label for modes, with their probabilities, the most probable first.

    A plate may be as unlike the board as `UNLIKE`, and is hardly stiffer along y than along x, which cards take along
    the grain. Empty where there is a label already, or the peaks are too few.
    """
    if any(setup.readings for setup in board.setups) or sum(len(one.peaks) for one in board.setups) < FEWEST_PEAKS:
        return []
    ways = _judged(_every_way(board, search_widely(board, prior, np.random.default_rng(0))), prior)
    ways = [one for one in ways if sum(len(setup.readings) for setup in one.board.setups) >= FEWEST_PEAKS]
    log_shares = [one.log_density_unlike + (0.0 if one.is_usual else np.log(_UNUSUAL)) for one in ways]
    return sorted(zip(ways, softmax(log_shares).tolist(), strict=True), key=lambda one: -one[1]) if ways else []


def only_way(ways: Sequence[Way]) -> Way:
    """The most probable way, others that lie far from it being improbable: no walk leads from one to the other.

    A free plate has nearly the same frequencies with its grain along the other side, and few peaks fit several plates.
    What any board has that a plate lacks would decide between them, if the noise could be as small as it likes.
    NotIdentifiableError if another is possible as well, with the constants of each and the label that would decide.
    """
    apart: list[Way] = []
    for one in sorted(ways, key=lambda one: -one.log_density_unlike):
        if all(one.is_far_from(other) for other in apart):
            apart.append(one)
    shares = softmax([one.log_density_unlike for one in apart])
    possible = [(one, share) for one, share in zip(apart, shares, strict=True) if share >= POSSIBLE]
    if len(possible) < 2:
        return apart[0]
    each = [
        ", ".join(f"{name} {1e-9 * float(value):.3g}" for name, value in zip(MODULI, one.moduli, strict=True))
        + f" GPa ({100.0 * share:.0f} %)"
        for one, share in possible
    ]
    (first, _), (second, _), *_ = possible
    raise NotIdentifiableError(
        f"{first.board.name}: its peaks are modes of plates that lie far apart, {' or '.join(each)}; "
        f"{_deciding_label(first, second)}give the label of a mode, or a prior that tells the material better"
    )


def _deciding_label(first: Way, second: Way) -> str:
    """The peak with one label in the first way and another in the second; empty if there is none."""
    labels = [
        {(setup.name, one.frequency.mean): one.label for setup in way.board.setups for one in setup.readings}
        for way in (first, second)
    ]
    for place in sorted(labels[0].keys() & labels[1].keys(), key=lambda place: place[1]):
        one, other = (each[place] for each in labels)
        if one != other:
            return f"the peak at {place[1]:g} Hz is {one} in the first and {other} in the second: "
    return ""


def _every_way(board: Board, guesses: Sequence[Guess]) -> list[tuple[Board, Floats]]:
    """Labelled boards that guesses of the constants lead to, each once, with their rigidities."""
    tried: list[tuple[Setup, ...]] = []
    every = (_settled(board, guess, tried) for guess in guesses)
    return [one for one in every if one is not None]


def _settled(board: Board, guess: Guess, tried: list[tuple[Setup, ...]]) -> tuple[Board, Floats] | None:
    """Labels that a first guess of the constants leads to, with the rigidities; None where another guess led there."""
    before: list[tuple[Setup, ...]] = []
    while True:
        labelled = _labelled(board, guess)
        n_readings = sum(len(setup.readings) for setup in labelled.setups)
        if labelled.setups in before or len(before) == _MOST_ROUNDS or n_readings < board.symmetry.n:
            return labelled, guess.rigidities
        if labelled.setups in tried:
            return None
        before.append(labelled.setups)
        tried.append(labelled.setups)
        estimate = weighted_least_squares(_of_labelled(labelled), _STEPS, guess.rigidities)
        if identifiability(estimate.sensitivities, estimate.scales, board.symmetry).blind():
            return labelled, guess.rigidities
        guess = guess_of(board, estimate)


def _guesses(board: Board, prior: PriorCard) -> list[Guess]:
    """The constants that the labelled modes determine, or those of all the prior where the peaks are likely."""
    if sum(len(setup.readings) for setup in board.setups) >= board.symmetry.n:
        estimate = weighted_least_squares(_of_labelled(board), accepted=_NEAR)
        if not identifiability(estimate.sensitivities, estimate.scales, board.symmetry).blind():
            return [guess_of(board, estimate)]
    n_peaks = sum(len(setup.readings) + len(setup.peaks) for setup in board.setups)
    if board.isotropic or n_peaks < len(RIGIDITIES):  # one label fixes all of an isotropic plate
        return []
    return search_widely(board, prior, np.random.default_rng(0))


def guess_of(board: Board, estimate: Estimate) -> Guess:
    """An estimate with its uncertainty; residuals beyond the expected noise widen both."""
    symmetry = board.symmetry
    spare = max(estimate.residuals.size - symmetry.n, 1)
    widening = max(float(np.sqrt(np.sum((estimate.residuals / estimate.scales) ** 2) / spare)), 1.0)
    covariance = widening**2 * identifiability(estimate.sensitivities, estimate.scales, symmetry).covariance
    middle = np.log(symmetry.free_of(estimate.values))
    logs = np.random.default_rng(0).multivariate_normal(middle, covariance, _N_DRAWS)
    return Guess(estimate.values, logs, widening * max(setup.noise.median for setup in board.setups))


def _of_labelled(board: Board) -> Board:
    """The board with those setups only that have a reading."""
    return replace(board, setups=tuple(setup for setup in board.setups if setup.readings))


def _judged(found: Sequence[tuple[Board, Floats]], prior: PriorCard) -> list[Way]:
    """Labelled boards at their own estimates; without those that have too few labels for one."""
    enough = (one for one in found if sum(len(setup.readings) for setup in one[0].setups) >= one[0].symmetry.n)
    return [_way(board, prior, start) for board, start in enough]


def _way(board: Board, prior: PriorCard, start: Floats) -> Way:
    """A labelled board at its own estimate."""
    estimate = weighted_least_squares(_of_labelled(board), _STEPS, start)
    bare = [setup_model(system_of(board, setup), estimate.values) for setup in board.setups]
    models = with_peaks(bare, estimate.values)
    posterior = Posterior(board, prior, models, "linear")
    medians, log_sds = np.array([(setup.noise.median, setup.noise.log_sd) for setup in board.setups]).T
    noises = medians * np.exp(np.outer(np.linspace(-1.0, 3.0, _N_LEVELS), log_sds))
    theta = np.stack([posterior.parameters.theta(estimate.values, noise) for noise in noises])
    theta = np.concatenate([theta, [posterior.parameters.theta(estimate.values, np.maximum(medians, UNLIKE))]])
    *by_level, unlike = (posterior.log_likelihood(theta).sum(axis=1) + posterior.log_prior(theta)).tolist()
    return Way(board, np.log(board.symmetry.free_of(estimate.values)), max(by_level), unlike)


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
    free = np.exp(guess.log_rigidities).T
    values = {**guess.values, **board.symmetry.rigidities(free, guess.values["poisson_xy"])}
    every = model.every_log_frequency(values, "linear")
    usable = np.isfinite(every).all(axis=1)
    noise = np.full(int(usable.sum()), guess.noise)
    return with_labels(setup, peaks, peaks.probabilities(every[usable], noise), LIKELY)
