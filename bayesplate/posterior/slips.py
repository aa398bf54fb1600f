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

from bayesplate.estimates.least_squares import log_measured
from bayesplate.estimates.marginal import log_probability
from bayesplate.estimates.refit import N_CONSTANTS, most_likely, normal_misfit, sensitivities
from bayesplate.plate.readings import reading_sd
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.target import Posterior

Floats = NDArray[np.float64]

RARITY = 1000.0
"""A slip is told where the readings are this many times as probable with it as without."""

FEWEST_TO_SPARE = 2
"""Readings beyond the three constants that it takes to see a slip in one of them."""

_LEAST_LOG_SD = 0.7
"""What is left of ln noise at least: an effect that the plate lacks adds to the noise, however well that is known."""

OCTAVES, DECIMALS = (2.0, 0.5), (10.0, 0.1)
_ANYWHERE = np.log(16.0)
"""Width in ln f over which a reading of something else may lie: two octaves either way."""
_OPEN = 1e-6
"""Sensitivity of ln f to the logarithm of a constant, in its best combination of readings, below which it is open."""
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


AS_READ = Slip(())
"""None at all."""


@dataclass(frozen=True, eq=False)
class _Fit:
    """Residuals and sensitivities of all readings at one point of the fitted columns."""

    residuals: Floats
    slopes: Floats
    inputs: Floats


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
        self._bounds = posterior.parameters.fitted_bounds
        self._predict = predictor(self.board, posterior.models, "exact", centre)
        self._start = centre[posterior.parameters.fitted_columns]
        self._medians = np.array([setup.noise.median for setup in self.board.setups])
        self._log_sd = max(_LEAST_LOG_SD, *(setup.noise.log_sd for setup in self.board.setups))
        self._variances = np.stack(
            [reading_sd(self.board.setups, self._medians * np.exp(self._log_sd * z)) ** 2 for z in _NOISE_SDS]
        )
        self.as_read = self._at(self._start, self.target)
        self.log_widening = self._log_sd * self._wanted_noise(posterior)
        if self.is_robust:  # there the centre is not where normal errors would have it
            self.as_read = self.refitted(AS_READ)

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

    def likeliest(self) -> Slip | None:
        """The slip that explains the readings best, if it does so far better than noise and after a refit.

        Returns
        -------
        Slip or None
        """
        n_modes = self.target.size
        if n_modes < N_CONSTANTS + FEWEST_TO_SPARE:
            return None
        strays = [Slip((i,)) for i in range(n_modes)]
        off = [Slip((i,), factor) for i in range(n_modes) for factor in (*OCTAVES, *DECIMALS)]
        best = self._refitted_best([*strays, *off, *self._pairs()])
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

    def _refitted_best(self, slips: Sequence[Slip]) -> Slip | None:
        """The likeliest of some slips to first order, with its odds after a refit; None if it cannot be weighed."""
        if not slips:
            return None
        keeping = [slip for slip in slips if not slip.left_out]
        shifts = np.array([slip.mended(self.target) for slip in keeping]).reshape(-1, self.target.size) - self.target
        log_evidence = dict(zip(keeping, self._log_evidence(self.as_read, (), shifts), strict=True))
        log_evidence |= {s: float(self._log_evidence(self.as_read, s.left_out)) for s in slips if s.left_out}
        best = max(log_evidence, key=lambda slip: log_evidence[slip])
        odds = self._log_evidence(self.refitted(best), best.left_out) - self._log_evidence(self.as_read, ())
        return replace(best, log_odds=float(odds)) if np.isfinite(odds) else None

    def refitted(self, slip: Slip) -> _Fit:
        """Residuals of the most likely constants where a slip is mended."""
        target = slip.mended(self.target)
        scales = reading_sd(self.board.setups, self._medians * np.exp(self.log_widening))
        x = most_likely(self._predict, normal_misfit(target, scales), self._start, self._bounds, slip.left_out)
        return self._at(x, target)

    def _at(self, x: Floats, target: Floats) -> _Fit:
        return _Fit(target - self._predict(x[None, :])[0], sensitivities(self._predict, x), x[N_CONSTANTS:])

    def _log_evidence(self, fit: _Fit, left_out: tuple[int, ...], shifts: Floats | float = 0.0) -> Floats:
        """ln of the probability of the readings over all noise levels; one per row of shifts of the residuals.

        Minus infinity where they leave a constant open: then a slip cannot be weighed.
        """
        kept = np.setdiff1d(np.arange(self.target.size), left_out)
        if np.linalg.matrix_rank(fit.slopes[kept, :N_CONSTANTS], tol=_OPEN) < N_CONSTANTS:
            return np.full(np.shape(shifts)[:-1], -np.inf)
        return np.asarray(logsumexp(self._by_noise(fit, left_out, shifts), axis=0) - len(left_out) * np.log(_ANYWHERE))

    def _by_noise(self, fit: _Fit, left_out: tuple[int, ...], shifts: Floats | float = 0.0) -> Floats:
        """ln of the same at each noise level, times its prior: (n_levels, ...) array."""
        kept = np.setdiff1d(np.arange(self.target.size), left_out)
        inputs = fit.slopes[kept, N_CONSTANTS:]
        # measured from the middle of the inputs' priors, so that their own departure counts
        residuals = (fit.residuals + shifts)[..., kept] + inputs @ fit.inputs
        found = log_probability(residuals, fit.slopes[kept, :N_CONSTANTS], self._variances[:, kept], inputs)
        return found - 0.5 * (_NOISE_SDS**2).reshape(-1, *[1] * (found.ndim - 1))
