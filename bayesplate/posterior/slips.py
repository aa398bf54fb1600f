"""One reading or two that a slip explains far better than noise: an octave, a decimal place, exchanged labels.

Each slip is a hypothesis about the readings: one was taken of something else, or is off by a known factor, or two stand
for each other. The constants are left open, uncertain inputs keep their priors, and the noise is averaged over its own
prior, so that a slip has to explain what a larger noise would not.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from bayesplate.board.board import Board
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.marginal import log_probability
from bayesplate.estimates.refit import Bounds, most_likely, normal_misfit, sensitivities
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

RARITY = 1000.0
"""A slip is told where the readings are this many times as probable with it as without."""

FEWEST_TO_SPARE = 2
"""Readings beyond as many as there are constants that it takes to see a slip in one of them."""

_LEAST_LOG_SD = 0.7
"""What is left of ln noise at least: an effect that the plate lacks adds to the noise, however well that is known."""

OCTAVES, DECIMALS = (2.0, 0.5), (10.0, 0.1)
_ANYWHERE = np.log(16.0)
"""Width in ln f over which a reading of something else may lie: two octaves either way."""
_OPEN = 1e-6
"""Sensitivity of ln f to the logarithm of a constant, in its best combination of readings, below which it is open."""
_REACH = np.log(1000.0)
"""How far a refit may take ln of a constant: much farther than any slip, and numbers still."""
_STEPS, _NEAR = 15, 0.01
"""Steps of least squares, and what ln of a constant may be off by, where slips are weighed to first order and refits
begin. Where a wrong reading is still among those that are fitted, steps may never settle."""
_N_REFITTED = 3
"""Slips, the likeliest to first order, whose odds after a refit are compared."""
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

    def mended_board(self, board: Board) -> Board:
        """The board with its readings as they would have been read; without those that say nothing of the plate."""
        frequencies = [reading.frequency for setup in board.setups for reading in setup.readings]
        if self.is_exchange:
            one, other = self.readings
            frequencies[one], frequencies[other] = frequencies[other], frequencies[one]
        elif self.readings:
            frequencies[self.readings[0]] = frequencies[self.readings[0]].scaled(1.0 / self.factor)
        at, setups = 0, []
        for setup in board.setups:
            rows = range(at, at + len(setup.readings))
            read = [replace(one, frequency=frequencies[i]) for i, one in zip(rows, setup.readings, strict=True)]
            kept = tuple(one for i, one in zip(rows, read, strict=True) if i not in self.left_out)
            setups += [replace(setup, readings=kept)] if kept else []
            at = rows.stop
        return replace(board, setups=tuple(setups))


AS_READ = Slip(())
"""None at all."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """Residuals and sensitivities of all readings at one point of the fitted columns, under a law that serves there."""

    predict: Predictor
    x: Floats
    residuals: Floats
    slopes: Floats

    @classmethod
    def at(cls, predict: Predictor, x: Floats, target: Floats) -> _Fit:
        """Beside readings, (n_modes,) array of ln f."""
        return cls(predict, x, target - predict(x[None, :])[0], sensitivities(predict, x))

    @property
    def inputs(self) -> Floats:
        """Standard coordinates of the uncertain inputs."""
        return self.x[self.predict.n_constants :]


class SlipSearch:
    """The readings of a posterior beside its exact law, and how probable they are with each slip.

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
        self._parameters = posterior.parameters
        self._n = posterior.parameters.n_constants
        self._medians = np.array([setup.noise.median for setup in self.board.setups])
        self._log_sd = max(_LEAST_LOG_SD, *(setup.noise.log_sd for setup in self.board.setups))
        self._variances = np.stack(
            [reading_sd(self.board.setups, self._medians * np.exp(self._log_sd * z)) ** 2 for z in _NOISE_SDS]
        )
        predict = predictor(self.board, posterior.models, "exact", centre)
        self.as_read = _Fit.at(predict, centre[self._parameters.fitted_columns], self.target)
        if not np.isfinite(self.as_read.slopes).all():  # so far off that the exact law made there is of no plate
            self.as_read = self._elsewhere(AS_READ) or self.as_read
        self.log_widening = self._log_sd * self._wanted_noise(posterior)
        if self.is_robust:  # there the centre is not where normal errors would have it
            self.as_read = self.refitted(AS_READ, self.as_read)

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

    def likeliest(self, anywhere: bool = False) -> Slip | None:
        """The slip that explains the readings best, if it does so far better than noise and after a refit.

        Parameters
        ----------
        anywhere : bool
            Whether the plate may be quite another one than the readings as they are lead to. Each reading is left out
            then in turn, and slips are weighed at what least squares finds without it, too.

        Returns
        -------
        Slip or None
        """
        n_modes = self.target.size
        if n_modes < self._n + FEWEST_TO_SPARE:
            return None
        strays = [Slip((i,)) for i in range(n_modes)]
        off = [Slip((i,), factor) for i in range(n_modes) for factor in (*OCTAVES, *DECIMALS)]
        best = self._refitted_best([*strays, *off, *self._pairs()], anywhere)
        return best if best is not None and best.log_odds > np.log(RARITY) else None

    def disordered(self) -> Slip | None:
        """The two readings in the other order than the modes of the fitted plate that are likeliest exchanged."""
        predicted = self.target - self.as_read.residuals
        pairs = [
            slip
            for slip in self._pairs()
            if np.prod([values[slip.readings[0]] - values[slip.readings[1]] for values in (self.target, predicted)]) < 0
        ]
        return self._refitted_best(pairs)

    def _pairs(self) -> list[Slip]:
        """Exchanges of two readings of one setup."""
        ends = np.cumsum([0, *(len(setup.readings) for setup in self.board.setups)])
        return [Slip(pair) for first, last in pairwise(ends.tolist()) for pair in combinations(range(first, last), 2)]

    def _refitted_best(self, slips: Sequence[Slip], anywhere: bool = False) -> Slip | None:
        """The likeliest of some slips, with its odds after a refit; None if none can be weighed."""
        places = [self.as_read, *(self._elsewhere(Slip((i,))) for i in range(self.target.size) if anywhere)]
        to_first_order = np.max([self._first_order(slips, place) for place in places if place is not None], axis=0)
        tried = [slips[i] for i in np.argsort(-to_first_order, kind="stable")[: _N_REFITTED if anywhere else 1]]
        weighed = [self._weighed(slip, anywhere) for slip in tried]
        return max((slip for slip in weighed if np.isfinite(slip.log_odds)), key=lambda one: one.log_odds, default=None)

    def _first_order(self, slips: Sequence[Slip], place: _Fit) -> Floats:
        """ln of the probability of the readings with each slip, a fit to them moved by its slopes: (n_slips,) array."""
        found = np.empty(len(slips))
        keeping = [i for i, slip in enumerate(slips) if not slip.left_out]
        shifts = np.array([slips[i].mended(self.target) for i in keeping]).reshape(-1, self.target.size) - self.target
        found[keeping] = self._log_evidence(place, (), shifts)
        for i, slip in enumerate(slips):
            if slip.left_out:
                found[i] = self._log_evidence(place, slip.left_out)
        return found

    def _weighed(self, slip: Slip, anywhere: bool) -> Slip:
        """A slip with its odds after a refit."""
        starts = [self.as_read, *([self._elsewhere(slip)] if anywhere else [])]
        fits = [self.refitted(slip, one) for one in starts if one is not None]
        evidence = max(float(self._log_evidence(fit, slip.left_out)) for fit in fits)
        return replace(slip, log_odds=evidence - float(self._log_evidence(self.as_read, ())))

    def refitted(self, slip: Slip, start: _Fit) -> _Fit:
        """Residuals of the most likely constants where a slip is mended."""
        target = slip.mended(self.target)
        scales = reading_sd(self.board.setups, self._medians * np.exp(self.log_widening))
        x = most_likely(start.predict, normal_misfit(target, scales), start.x, self._within(start.x), slip.left_out)
        return _Fit.at(start.predict, x, target)

    def _within(self, x: Floats) -> Bounds:
        """Limits of the fitted columns: constants stay within reach, for a slip may leave one of them open."""
        bounds = self._parameters.fitted_bounds
        reach = np.full(x.size, np.inf)
        reach[: self._n] = _REACH
        return Bounds(np.maximum(bounds.lower, x - reach), np.minimum(bounds.upper, x + reach))

    def _elsewhere(self, slip: Slip) -> _Fit | None:
        """The readings beside the plate that least squares finds where a slip is mended, from a start of its own.

        None where the readings lead to no plate at all.
        """
        try:
            values = weighted_least_squares(slip.mended_board(self.board), _STEPS, accepted=_NEAR).values
            models = [setup_model(system_of(self.board, setup), values) for setup in self.board.setups]
        except (ValueError, KeyError):
            return None
        there = self._parameters.theta(values, self._medians)
        return _Fit.at(
            predictor(self.board, models, "linear", there), there[self._parameters.fitted_columns], self.target
        )

    def _log_evidence(self, fit: _Fit, left_out: tuple[int, ...], shifts: Floats | float = 0.0) -> Floats:
        """ln of the probability of the readings over all noise levels; one per row of shifts of the residuals.

        Minus infinity where they leave a constant open, or lead to no plate: then a slip cannot be weighed.
        """
        kept = np.setdiff1d(np.arange(self.target.size), left_out)
        is_plate = np.isfinite(fit.residuals).all() and np.isfinite(fit.slopes).all()
        if not is_plate or np.linalg.matrix_rank(fit.slopes[kept, : self._n], tol=_OPEN) < self._n:
            return np.full(np.shape(shifts)[:-1], -np.inf)
        return np.asarray(logsumexp(self._by_noise(fit, left_out, shifts), axis=0) - len(left_out) * np.log(_ANYWHERE))

    def _by_noise(self, fit: _Fit, left_out: tuple[int, ...], shifts: Floats | float = 0.0) -> Floats:
        """ln of the same at each noise level, times its prior: (n_levels, ...) array."""
        kept = np.setdiff1d(np.arange(self.target.size), left_out)
        inputs = fit.slopes[kept, self._n :]
        # measured from the middle of the inputs' priors, so that their own departure counts
        residuals = (fit.residuals + shifts)[..., kept] + inputs @ fit.inputs
        found = log_probability(residuals, fit.slopes[kept, : self._n], self._variances[:, kept], inputs)
        return found - 0.5 * (_NOISE_SDS**2).reshape(-1, *[1] * (found.ndim - 1))
