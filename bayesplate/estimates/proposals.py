"""Labels for a bare list of peaks: which modes of the plate they may be, and how probable each answer is.

Peaks and modes keep their order of frequency; a mode may be missed, a peak may be of something else. Rough frequencies
of draws from the prior, each free to move up or down as a whole, propose the assignments; the most promising ones are
then fitted by full solves and weighed against each other with the constants left open and the noise unknown.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bayesplate.board.board import Board
from bayesplate.board.material import moduli
from bayesplate.board.prior import PriorCard
from bayesplate.board.reading import Reading
from bayesplate.board.setup import Setup
from bayesplate.estimates.least_squares import Estimate, weighted_least_squares
from bayesplate.estimates.marginal import log_probability
from bayesplate.estimates.unusual import MOST_ORTHOTROPIC
from bayesplate.frequencies.prior_bands import prior_draws
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.spectrum import spectrum
from bayesplate.frequencies.terms import rayleigh_coefficients, term_weights
from bayesplate.labels import HIGHEST_INDEX, Label
from bayesplate.modes.beams import is_rigid

Floats = NDArray[np.float64]
Assignment = tuple[Label | None, ...]
"""Label of each peak, in their order; None for a peak that is no mode of the plate."""

FEWEST_PEAKS = 4
"""Three fix the constants whatever they are called."""

UNUSUAL = 0.02
"""Probability that a plate is stiffer along y than along x, which cards take along the grain, or that no wood is as
orthotropic."""

_N_DRAWS = 6000
_N_BEAMS = 8
_N_FITTED, _MOST_FITTED, _MOST_STEPS = 10, 18, 8
_WORTH_A_FIT = 15.0
"""ln of how many times less probable, by the rough frequencies, an assignment may be that is fitted."""
_ROUGH_SD = 0.06
"""Relative error of a Rayleigh quotient of beam functions."""
_N_FIRST = 3
_NOISE_SDS = np.linspace(-2.0, 8.0, 21)
_NEVER = 1e6


@dataclass(frozen=True, eq=False)
class Proposal:
    """One way to label the peaks of a setup.

    Attributes
    ----------
    labels : tuple of Label or None
        Of each peak, in the order of frequency.
    probability : float
        Among the ways that were looked at.
    board : Board
        With these labels in place of the bare peaks.
    """

    labels: Assignment
    probability: float
    board: Board


def proposals(board: Board, prior: PriorCard, rng: np.random.Generator) -> list[Proposal]:
    """Ways to label the peaks of a board that has one setup and no label yet, the most probable first.

    Parameters
    ----------
    board : Board
    prior : PriorCard
    rng : numpy.random.Generator

    Returns
    -------
    list of Proposal
        Empty where the peaks are too few to tell, or there is a label already.
    """
    setup = board.setups[0]
    if len(board.setups) > 1 or setup.readings or len(setup.unlabelled) < FEWEST_PEAKS:
        return []
    bare = replace(board, effects=(), chosen=())
    weighed: dict[Assignment, tuple[float, Board]] = {}
    waiting = _rough_assignments(bare, setup, prior, rng)
    while waiting:
        labels = waiting.pop(0)
        if labels in weighed or sum(label is not None for label in labels) < FEWEST_PEAKS:
            continue
        labelled = _labelled(bare, setup, labels)
        estimate = weighted_least_squares(labelled, _MOST_STEPS)
        modes = _modes_at(labelled, estimate, max(setup.unlabelled))
        weighed[labels] = _log_weight(labelled, estimate, labels, modes, prior), _labelled(board, setup, labels)
        better = _assign(setup, modes, np.maximum(2.0 * estimate.scales.max(), 0.01))
        if better not in weighed and len(weighed) + len(waiting) < _MOST_FITTED:
            waiting.append(better)
    if not weighed:
        return []
    total = logsumexp([weight for weight, _ in weighed.values()])
    found = [Proposal(labels, float(np.exp(w - total)), made) for labels, (w, made) in weighed.items()]
    return sorted(found, key=lambda one: -one.probability)


def probabilities(found: Sequence[Proposal], peak: int) -> dict[Label | None, float]:
    """Probability of each label of one peak over all proposals, the highest first."""
    total: dict[Label | None, float] = {}
    for one in found:
        total[one.labels[peak]] = total.get(one.labels[peak], 0.0) + one.probability
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def _labelled(board: Board, setup: Setup, labels: Assignment) -> Board:
    first = setup.first_label
    peaks = sorted(setup.peaks, key=lambda peak: peak.frequency.mean)
    readings = tuple(
        Reading.of((label.m, label.n), peak.frequency, peak.sign, (first.m, first.n))
        for label, peak in zip(labels, peaks, strict=True)
        if label is not None
    )
    rest = tuple(peak for label, peak in zip(labels, peaks, strict=True) if label is None)
    return replace(board, setups=(replace(setup, readings=readings, peaks=rest),))


def _rough_assignments(board: Board, setup: Setup, prior: PriorCard, rng: np.random.Generator) -> list[Assignment]:
    """Assignments by Rayleigh quotients at draws from the prior, the likeliest first."""
    values = prior_draws(board, prior, rng, _N_DRAWS)
    products = rayleigh_coefficients(setup)
    beams = [b for b in np.ndindex(_N_BEAMS, _N_BEAMS) if not is_rigid(b, setup.ends_x, setup.ends_y)]
    squared = term_weights(values, setup).stiffness @ np.stack([products[:, i, j] for i, j in beams], axis=1)
    possible = np.all(np.isfinite(squared) & (squared > 0), axis=1)
    log_hertz = 0.5 * np.log(squared[possible]) - np.log(2.0 * np.pi)
    peaks = np.log(np.sort(setup.unlabelled))
    order = np.argsort(log_hertz, axis=1)[:, : 2 * peaks.size + 4]
    modes = np.take_along_axis(log_hertz, order, axis=1)
    # A plate as stiff as its lowest peak wants: that peak is one of the lowest modes.
    shifts = np.concatenate([peaks[0] - modes[:, first] for first in range(_N_FIRST)])
    rows = np.tile(np.arange(len(modes)), _N_FIRST)
    for _ in range(2):  # the second time about the mean of what the first assigned
        cost, picked = _align(setup, peaks, modes[rows] + shifts[:, None], _ROUGH_SD)
        gaps = np.where(picked >= 0, peaks - np.take_along_axis(modes[rows], np.maximum(picked, 0), axis=1), np.nan)
        shifts = np.nansum(gaps, axis=1) / np.maximum(np.sum(picked >= 0, axis=1), 1)
    cost += _prior_cost(prior, {name: v[possible][rows] for name, v in values.items() if np.ndim(v)}, shifts)
    names = [Label(i + setup.first_label.m, j + setup.first_label.n) for i, j in beams]
    best: dict[Assignment, float] = {}
    for k in np.argsort(cost)[: 40 * _N_FITTED]:
        labels = tuple(names[order[rows[k], j]] if j >= 0 else None for j in picked[k])
        best.setdefault(labels, float(cost[k]))
    nearest = min(best.values(), default=0.0)
    return [labels for labels, one in best.items() if one < nearest + _WORTH_A_FIT][:_N_FITTED]


def _prior_cost(prior: PriorCard, values: dict[str, Floats], shifts: Floats) -> Floats:
    """-ln of the prior's density at constants moved so that all frequencies move as a whole, over that where drawn."""
    return np.sum(
        [
            one.log_density_of_log(np.log(values[name])) - one.log_density_of_log(np.log(values[name]) + 2.0 * shifts)
            for name, one in prior.constants.items()
        ],
        axis=0,
    )


def _align(setup: Setup, peaks: Floats, modes: Floats, sd: float) -> tuple[Floats, NDArray[np.intp]]:
    """Cheapest assignment of peaks to modes that keeps their order: cost and the mode of each peak, -1 for none.

    Parameters
    ----------
    setup : Setup
        With the probabilities of a missed mode and of a peak that is none.
    peaks : (n_peaks,) array
        ln f, ascending.
    modes : (n_draws, n_modes) array
        The same of the modes of each draw.
    sd : float
        Of a peak about its mode.

    Returns
    -------
    cost : (n_draws,) array
        -ln of the probability.
    picked : (n_draws, n_peaks) array of int
    """
    n_draws, n_modes = modes.shape
    miss, seen, stray = -np.log(setup.missed), -np.log(1.0 - setup.missed), -np.log(setup.spurious)
    seen += np.log(sd * np.sqrt(2.0 * np.pi))
    cost = np.full((peaks.size + 1, n_modes + 1, n_draws), _NEVER)
    came = np.zeros((peaks.size + 1, n_modes + 1, n_draws), dtype=np.int8)
    cost[0] = miss * np.arange(n_modes + 1)[:, None]
    for i in range(peaks.size + 1):
        for j in range(n_modes + 1):
            if i == 0:
                came[i, j] = 1
                continue
            ways = [cost[i - 1, j] + stray]
            if j:
                gap = (peaks[i - 1] - modes[:, j - 1]) / sd
                ways += [cost[i, j - 1] + miss, cost[i - 1, j - 1] + seen + 0.5 * gap**2]
            came[i, j] = np.argmin(ways, axis=0)
            cost[i, j] = np.min(ways, axis=0)
    last = np.argmin(cost[-1], axis=0)  # modes above the highest peak were not missed
    picked = np.full((n_draws, peaks.size), -1)
    at = np.stack([np.full(n_draws, peaks.size), last])
    draws = np.arange(n_draws)
    for _ in range(peaks.size + n_modes):
        way = came[at[0], at[1], draws]
        open_ = at[0] > 0
        matched = open_ & (way == 2)
        picked[draws[matched], at[0][matched] - 1] = at[1][matched] - 1
        at = at - np.stack([open_ & (way != 1), open_ & (way != 0)])
    return cost[-1, last, draws], picked


Named = list[tuple[float, Label | None]]


def _modes_at(board: Board, estimate: Estimate, highest: float) -> Named:
    """ln f and label of every mode up to some way above the highest peak, at an estimate."""
    n_modes = 12
    while True:
        _, named = spectrum(estimate.models[0].system, estimate.values, n_modes, estimate.models[0].plate)
        if named[-1].frequency > 1.1 * highest or n_modes > 64:
            return [(float(np.log(mode.frequency)), _on_card(mode.label)) for mode in named]
        n_modes *= 2


def _on_card(label: Label | None) -> Label | None:
    """A label that a card may state: modes of higher orders have none."""
    return label if label is not None and max(label) <= HIGHEST_INDEX else None


def _assign(setup: Setup, modes: Named, sd: float) -> Assignment:
    """Labels of the peaks by the modes at an estimate."""
    _, picked = _align(setup, np.log(np.sort(setup.unlabelled)), np.array([[log for log, _ in modes]]), sd)
    return tuple(modes[j][1] if j >= 0 else None for j in picked[0])


def _log_weight(board: Board, estimate: Estimate, labels: Assignment, modes: Named, prior: PriorCard) -> float:
    """ln of the probability of the peaks with these labels, but for what all assignments share."""
    setup = board.setups[0]
    levels = setup.noise.median * np.exp(np.maximum(setup.noise.log_sd, 0.5) * _NOISE_SDS)
    variances = np.stack([reading_sd(board.setups, [level]) ** 2 for level in levels])
    slopes = board.symmetry.along(estimate.sensitivities)
    by_noise = log_probability(estimate.residuals, slopes, variances) - 0.5 * _NOISE_SDS**2
    highest = max(np.log(setup.measured))
    below = {label for log, label in modes if log < highest}
    n_missed = len(below - set(labels))
    n_seen = sum(label is not None for label in labels)
    n_stray = len(labels) - n_seen
    values = estimate.values
    elastic = moduli(values["D_x"], values["D_y"], values["D_s"], values["thickness"], values["poisson_xy"])
    by_name = dict(values) | elastic._asdict()
    density = sum(float(one.log_density_of_log(np.log(by_name[name]))) for name, one in prior.constants.items())
    seen = n_missed * np.log(setup.missed) + n_seen * np.log(1.0 - setup.missed) + n_stray * np.log(setup.spurious)
    usual = 0.0 if 1.0 <= elastic.E_x / elastic.E_y <= MOST_ORTHOTROPIC else np.log(UNUSUAL)
    return float(logsumexp(by_noise) + density + seen + usual)
