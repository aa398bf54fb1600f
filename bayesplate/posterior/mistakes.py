"""One reading or two that a slip explains far better than noise: an octave, a decimal place, exchanged labels.

Each slip is a hypothesis about the readings: one was taken of something else, or is off by a known factor, or two stand
for each other. The constants are left open, uncertain inputs keep their priors, and the noise is averaged over its own
prior, so that a slip has to explain what a larger noise would not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.marginal import log_probability
from bayesplate.estimates.refit import N_CONSTANTS, most_likely, normal_misfit, sensitivities
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.plate.board import Board
from bayesplate.plate.readings import reading_sd
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

RARITY = 1000.0
"""A slip is told where the readings are this many times as probable with it as without."""

FEWEST_TO_SPARE = 2
"""Readings beyond the three constants that it takes to see a slip in one of them."""

LARGE_NOISE, LARGE_NOISE_SDS = 3.0, 3.0
"""Noise that the residuals want, over the median of its prior, and in standard deviations of its logarithm, beyond
which the reader is told."""

_LEAST_LOG_SD = 0.7
"""What is left of ln noise at least: an effect that the plate lacks adds to the noise, however well that is known."""

_OCTAVES, _DECIMALS = (2.0, 0.5), (10.0, 0.1)
_ANYWHERE = np.log(16.0)
"""Width in ln f over which a reading of something else may lie: two octaves either way."""
_LOG_MILLION = np.log(1e6)
_NOISE_SDS = np.linspace(-3.0, 14.0, 69)


@dataclass(frozen=True)
class Slip:
    """A slip, and how much better the readings fit with it.

    Attributes
    ----------
    readings : tuple of int
        Position of the reading, or of the two that are exchanged; none where all is as it was read.
    factor : float
        What the reading is, over what it should be; 1 where it belongs to another mode, or two are exchanged.
    log_odds : float
        ln of how many times as probable the readings are with it.
    """

    readings: tuple[int, ...]
    factor: float = 1.0
    log_odds: float = 0.0

    @property
    def is_exchange(self) -> bool:
        """Whether two readings stand for each other."""
        return len(self.readings) == 2

    @property
    def left_out(self) -> tuple[int, ...]:
        """Readings that say nothing of the plate."""
        return self.readings if not self.is_exchange and self.factor == 1.0 else ()

    def mended(self, target: Floats) -> Floats:
        """ln of the frequencies as they would have been read: (n_modes,) array."""
        found = target.copy()
        if self.is_exchange:
            found[list(self.readings)] = target[list(reversed(self.readings))]
        elif self.readings:
            found[self.readings[0]] -= np.log(self.factor)
        return found


@dataclass(frozen=True, eq=False)
class _Fit:
    """Residuals and sensitivities of all readings at one point of the fitted columns."""

    residuals: Floats
    slopes: Floats
    inputs: Floats


class Readings:
    """The readings of a posterior beside its exact law, at the most likely constants.

    Parameters
    ----------
    posterior : Posterior
        Its models hold the exact law.
    centre : (n_dim,) array
        Where they are most likely.
    """

    def __init__(self, posterior: Posterior, centre: Floats) -> None:
        self.board = posterior.board
        self.is_robust = posterior.robust
        self.target = log_measured(self.board)
        self.names = [f"{r.label}" for s in self.board.setups for r in s.readings]
        if len(self.board.setups) > 1:
            self.names = list(self.board.reading_names)
        self._columns = posterior.parameters.fitted_columns
        self._bounds = posterior.parameters.fitted_bounds
        self._predict = predictor(self.board, posterior.models, "exact", centre)
        self._start = centre[self._columns]
        self._medians = np.array([setup.noise.median for setup in self.board.setups])
        self._log_sd = max(_LEAST_LOG_SD, *(setup.noise.log_sd for setup in self.board.setups))
        self._variances = np.stack(
            [reading_sd(self.board.setups, self._medians * np.exp(self._log_sd * z)) ** 2 for z in _NOISE_SDS]
        )
        self.as_read = self._at(self._start, self.target)
        self.log_widening = self._log_sd * self._wanted_noise(posterior)
        if self.is_robust:  # there the centre is not where normal errors would have it
            self.as_read = self.refitted(Slip(()))

    def _wanted_noise(self, posterior: Posterior) -> float:
        """How far above the middle of its prior the noise lies that the residuals want, in steps of `_log_sd`."""
        if not self.is_robust:
            return float(_NOISE_SDS[np.argmax(self._by_noise(self.as_read, ()))])
        ends = np.cumsum([len(setup.readings) for setup in self.board.setups])[:-1]
        parts = np.split(self.target - self.as_read.residuals, ends)
        log_density = -0.5 * _NOISE_SDS**2
        for errors, predicted, median in zip(posterior.readings, parts, self._medians, strict=True):
            levels = median * np.exp(self._log_sd * _NOISE_SDS)
            log_density += errors.log_likelihood(np.tile(predicted, (levels.size, 1)), levels).sum(axis=1)
        return float(_NOISE_SDS[np.argmax(log_density)])

    def slips(self) -> Iterator[Slip]:
        """Every slip that is looked for."""
        positions = range(self.target.size)
        yield from (Slip((i,)) for i in positions)
        yield from (Slip((i,), factor) for i in positions for factor in (*_OCTAVES, *_DECIMALS))
        first = 0
        for setup in self.board.setups:
            yield from (Slip(pair) for pair in combinations(range(first, first + len(setup.readings)), 2))
            first += len(setup.readings)

    def likeliest(self) -> Slip | None:
        """The slip that explains the readings best, if it does so far better than noise; by refits, not to first order.

        Returns
        -------
        Slip or None
        """
        if self.target.size < N_CONSTANTS + FEWEST_TO_SPARE:
            return None
        as_read = self._log_evidence(self.as_read, ())
        shifted = {
            slip: _Fit(
                self.as_read.residuals + slip.mended(self.target) - self.target,
                self.as_read.slopes,
                self.as_read.inputs,
            )
            for slip in self.slips()
        }
        best = max(shifted, key=lambda slip: self._log_evidence(shifted[slip], slip.left_out))
        if self._log_evidence(shifted[best], best.left_out) - as_read < np.log(RARITY):
            return None
        odds = self._log_evidence(self.refitted(best), best.left_out) - as_read
        return Slip(best.readings, best.factor, float(odds)) if odds > np.log(RARITY) else None

    def exchanged(self) -> list[Slip]:
        """Pairs of readings that stand in the other order than the modes of the fitted plate, and their odds."""
        predicted = self.target - self.as_read.residuals
        as_read = self._log_evidence(self.as_read, ())
        found = []
        for slip in self.slips():
            if slip.is_exchange:
                one, other = slip.readings
                if (self.target[one] - self.target[other]) * (predicted[one] - predicted[other]) < 0:
                    odds = self._log_evidence(self.refitted(slip), ()) - as_read
                    found.append(Slip(slip.readings, 1.0, float(odds)))
        return found

    def refitted(self, slip: Slip) -> _Fit:
        """Residuals of the most likely constants where a slip is mended."""
        target = slip.mended(self.target)
        noise = self._medians * np.exp(self.log_widening)
        scales = reading_sd(self.board.setups, noise)
        left_out = slip.left_out[0] if slip.left_out else None
        x = most_likely(self._predict, normal_misfit(target, scales), self._start, self._bounds, left_out)
        return self._at(x, target)

    def _at(self, x: Floats, target: Floats) -> _Fit:
        return _Fit(target - self._predict(x[None, :])[0], sensitivities(self._predict, x), x[N_CONSTANTS:])

    def _log_evidence(self, fit: _Fit, left_out: tuple[int, ...]) -> float:
        """ln of the probability of the readings, to first order in the constants, over all noise levels."""
        return float(logsumexp(self._by_noise(fit, left_out)) - len(left_out) * np.log(_ANYWHERE))

    def _by_noise(self, fit: _Fit, left_out: tuple[int, ...]) -> Floats:
        """ln of the same at each noise level, times its prior: (n_levels,) array."""
        kept = np.setdiff1d(np.arange(self.target.size), left_out)
        inputs = fit.slopes[kept, N_CONSTANTS:]
        # measured from the middle of the inputs' priors, so that their own departure counts
        residuals = fit.residuals[kept] + inputs @ fit.inputs
        found = log_probability(residuals, fit.slopes[kept, :N_CONSTANTS], self._variances[:, kept], inputs)
        return found - 0.5 * _NOISE_SDS**2


def slip_remarks(posterior: Posterior, centre: Floats) -> tuple[str, ...]:
    """What a reader of the constants must know of the readings, a sentence each, the worst first.

    Parameters
    ----------
    posterior : Posterior
        Its models hold the exact law.
    centre : (n_dim,) array
        Where the readings are most likely.

    Returns
    -------
    tuple of str
        The likeliest slip, or else the two readings whose order is least like the plate's; and whether the noise that
        the residuals want is far above its prior.
    """
    readings = Readings(posterior, centre)
    found, slip = [], readings.likeliest()
    if slip is not None:
        found.append(_exchange(readings, slip) if slip.is_exchange else _stray(readings, slip))
    elif disordered := readings.exchanged():
        found.append(_disorder(readings, max(disordered, key=lambda one: one.log_odds)))
    return (*found, *noise_remarks(posterior.board, readings.log_widening))


def noise_remarks(board: Board, log_widening: float) -> tuple[str, ...]:
    """That the readings scatter far more than the prior of the noise lets expect, if they do; a sentence.

    Parameters
    ----------
    board : Board
    log_widening : float
        ln of the noise that the residuals want, over the median of its prior.
    """
    widest = max(setup.noise.log_sd for setup in board.setups)
    if not log_widening >= max(np.log(LARGE_NOISE), LARGE_NOISE_SDS * widest):
        return ()
    levels = ", ".join(
        f"{100.0 * setup.noise.median * np.exp(log_widening):.2g} % where about {100.0 * setup.noise.median:.2g} % is "
        "expected" + (f" in setup {setup.name}" if len(board.setups) > 1 else "")
        for setup in board.setups
    )
    return (
        f"the readings scatter about the fitted plate by {levels}: no plate of these sizes and edges fits them, so do "
        "not trust the constants before a label, a size or an edge is corrected, or an effect is found (bayesplate "
        "diagnose)",
    )


def _stray(readings: Readings, slip: Slip) -> str:
    (i,) = slip.readings
    gap = _apart(readings.board, i)
    apart = f"{abs(1200.0 * gap / np.log(2.0)):.0f} cents {'above' if gap > 0 else 'below'}"
    measured = float(np.exp(readings.target[i]))
    factor = "an octave" if slip.factor in _OCTAVES else "a decimal place" if slip.factor in _DECIMALS else "misread"
    advice = "" if readings.is_robust else " --robust gives it less say"
    return (
        f"{readings.names[i]} at {measured:.5g} Hz is {apart} what the other modes expect, "
        f"{measured * np.exp(-gap):.4g} Hz: {factor}, or another mode?{advice}"
    )


def _exchange(readings: Readings, slip: Slip) -> str:
    boards = readings.board, _with_exchanged(readings.board, slip.readings)
    before, after = (cents(np.sqrt(np.mean(weighted_least_squares(board).residuals ** 2))) for board in boards)
    return (
        f"{_pair(readings, slip)} fit far better exchanged, {after:.1f} cents rms in place of {before:.1f} "
        f"({_times(slip.log_odds)} as probable): have they each other's label?"
    )


def _disorder(readings: Readings, slip: Slip) -> str:
    likelier = "exchanged" if slip.log_odds > 0 else "as they are"
    return (
        f"{_pair(readings, slip)} stand in the other order than the modes of the fitted plate; {likelier} they are "
        f"{_times(abs(slip.log_odds))} as probable: their figures tell which is which"
    )


def _pair(readings: Readings, slip: Slip) -> str:
    return " and ".join(f"{readings.names[i]} at {np.exp(readings.target[i]):.5g} Hz" for i in slip.readings)


def _times(log_odds: float) -> str:
    if log_odds > _LOG_MILLION:
        return "more than a million times"
    odds = float(np.exp(log_odds))
    return f"{odds:.2g} times" if odds < 100 else f"{float(f'{odds:.1g}'):,.0f} times"


def _apart(board: Board, reading: int) -> float:
    """How far a reading lies above what the others expect: ln measured - ln predicted, by least squares without it."""
    first, setups = 0, []
    for setup in board.setups:
        kept = tuple(r for i, r in enumerate(setup.readings, start=first) if i != reading)
        first += len(setup.readings)
        setups.append(replace(setup, readings=kept))
    values = weighted_least_squares(replace(board, setups=tuple(s for s in setups if s.readings))).values
    models = (setup_model(system_of(board, setup), values) for setup in board.setups)
    predicted = np.concatenate([model.log_frequencies(values, "linear")[0] for model in models])
    return float(log_measured(board)[reading] - predicted[reading])


def _with_exchanged(board: Board, pair: tuple[int, ...]) -> Board:
    """The board with the frequencies of two readings exchanged."""
    rows = [reading for setup in board.setups for reading in setup.readings]
    one, other = (rows[i] for i in pair)
    other_way = {id(one): other.frequency, id(other): one.frequency}
    setups = tuple(
        replace(s, readings=tuple(replace(r, frequency=other_way.get(id(r), r.frequency)) for r in s.readings))
        for s in board.setups
    )
    return replace(board, setups=setups)
