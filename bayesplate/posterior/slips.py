"""Doubts about readings before anything is sampled: an octave, a decimal place, exchanged labels, much scatter.

A reading is compared with what the others predict for it, a Student distribution: the plate is fitted without it, and
the scatter of the others gives the noise, to which the prior of the noise adds no more than one reading would, because
an effect that the plate lacks looks like noise. A slip is a hypothesis about one reading, or two that stand for each
other; its odds are the predictive density of what would have been read, over that of what was.

References
----------
R. D. Cook and S. Weisberg, Residuals and Influence in Regression, 1982, section 2.2: deleted residuals.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np

from bayesplate.arrays import Floats
from bayesplate.board.board import Board
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.estimates.refit import most_likely, normal_misfit, sensitivities
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.target import Posterior

RARITY = 1000.0
"""A slip is reported where the readings are this many times as probable with it as without."""
FEWEST_TO_SPARE = 2
"""Readings beyond as many as there are constants that it takes to see a slip in one of them."""
LARGE_NOISE, LARGE_NOISE_SDS = 3.0, 3.0
"""Noise of the residuals over the median of its prior, and in standard deviations of its logarithm, beyond which a
remark is made."""

OCTAVES, DECIMALS = (2.0, 0.5), (10.0, 0.1)
_ANYWHERE = np.log(16.0)
"""Width in ln f over which a reading of something else may lie: two octaves either way."""
_READINGS_OF_PRIOR = 1.0
"""Number of readings that the prior of the noise counts for."""
_OPEN = 1e-6
"""Sensitivity of ln f to the logarithm of a constant, in its best combination of readings, below which it is open."""
_STEPS, _NEAR = 15, 0.01
"""Steps of least squares from a start of their own, and what ln of a constant may be off by after them."""
_LOG_MILLION = np.log(1e6)


@dataclass(frozen=True)
class Slip:
    """A slip, and how much better the readings fit with it."""

    readings: tuple[int, ...]  # position of the reading, or of the two that are exchanged
    factor: float = 1.0  # of the reading over its right value; 1 where it is of something else, or two are exchanged
    log_odds: float = 0.0  # ln of the probability of the readings with the slip over that without
    gap: float = 0.0  # ln of the reading over the prediction of the others


class Remarks(NamedTuple):
    """Sentences about the readings that a reader of the constants needs."""

    slips: tuple[str, ...]  # the likeliest slip, if one explains the readings
    others: tuple[str, ...]  # otherwise two readings in the wrong order, if a plate fits; a noise far above its prior


def reading_remarks(posterior: Posterior, centre: Floats) -> Remarks:
    """Remarks on the readings of a posterior, whose models hold the exact law, at its (n_dim,) centre."""
    readings = Readings(posterior, centre)
    is_lost = is_too_wide(posterior.board, readings.log_widening)
    noise = noise_remarks(posterior.board, readings.log_widening)
    slip = readings.likeliest(anywhere=is_lost)
    if slip is not None:
        return Remarks((_exchange(readings, slip) if len(slip.readings) == 2 else _stray(readings, slip),), noise)
    pair = None if is_lost else readings.disordered()
    return Remarks((), noise if pair is None else (_disorder(readings, pair), *noise))


class Readings:
    """The readings of a posterior, and the predictions of some of them for the others."""

    def __init__(self, posterior: Posterior, centre: Floats) -> None:
        self.board, self.is_robust = posterior.board, posterior.robust
        self.target = log_measured(self.board)
        self._parameters = posterior.parameters
        self._medians = np.array([setup.noise.median for setup in self.board.setups])
        self._scales = reading_sd(self.board.setups, self._medians)
        predict = predictor(self.board, posterior.models, "exact", centre)
        self._whole = _Fit(predict, centre[self._parameters.fitted_columns], self.target, self._scales)
        if self.is_robust or not self._whole.is_plate:
            self._whole = self._refitted(self._whole, ())
        self._starts = [self._whole]
        self.log_widening = 0.5 * float(np.log(self._whole.variance(())[0]))
        """ln of the noise of the residuals over the median of its prior."""
        if self.is_robust:  # a reading far off does not widen it
            self.log_widening = self._parameters.log_widening(centre)

    def likeliest(self, anywhere: bool = False) -> Slip | None:
        """The slip that explains the readings best, if it does so far better than noise.

        `anywhere` if the plate may be quite another one than that of all readings: then fits begin as well where least
        squares without each reading lead.
        """
        n = self.target.size
        if n < self._parameters.n_constants + FEWEST_TO_SPARE:
            return None
        if anywhere:
            elsewhere = (self._elsewhere(i) for i in range(n))
            self._starts = [self._whole, *(one for one in elsewhere if one is not None)]
        single = [slip for i in range(n) for slip in self._of_one(i)]
        best = max((*single, *self._of_pairs(self._pairs())), key=lambda one: one.log_odds, default=None)
        return best if best is not None and best.log_odds > np.log(RARITY) else None

    def disordered(self) -> Slip | None:
        """The two readings in the other order than the modes of the fitted plate that are likeliest exchanged."""
        predicted = self.target - self._whole.residuals
        apart = np.subtract.outer(self.target, self.target) * np.subtract.outer(predicted, predicted)
        pairs = [pair for pair in self._pairs() if apart[pair] < 0.0]
        return max(self._of_pairs(pairs), key=lambda one: one.log_odds, default=None)

    def rms_cents(self, exchange: Slip) -> tuple[float, float]:
        """Root mean square of the residuals, before and after two readings exchange their labels."""
        one, other = exchange.readings
        frequencies = [reading.frequency for setup in self.board.setups for reading in setup.readings]
        frequencies[one], frequencies[other] = frequencies[other], frequencies[one]
        rest = iter(frequencies)
        setups = tuple(
            replace(setup, readings=tuple(replace(one, frequency=next(rest)) for one in setup.readings))
            for setup in self.board.setups
        )
        after = weighted_least_squares(replace(self.board, setups=setups)).residuals
        before, after = (np.sqrt(np.mean(residuals**2)) for residuals in (self._whole.residuals, after))
        return float(cents(before)), float(cents(after))

    def _pairs(self) -> list[tuple[int, int]]:
        """Two readings of one setup each."""
        ends = np.cumsum([0, *(len(setup.readings) for setup in self.board.setups)])
        return [pair for first, last in pairwise(ends.tolist()) for pair in combinations(range(first, last), 2)]

    def _of_one(self, i: int) -> list[Slip]:
        """Possible slips of one reading."""
        fit, factors = self._without((i,)), (*OCTAVES, *DECIMALS)
        if fit is None:
            return []
        gap = float(fit.residuals[i])
        as_read, *off = fit.log_predictive((i,), np.array([[gap], *([gap - np.log(factor)] for factor in factors)]))
        stray = Slip((i,), 1.0, -np.log(_ANYWHERE) - as_read, gap)
        return [stray, *(Slip((i,), factor, one - as_read, gap) for factor, one in zip(factors, off, strict=True))]

    def _of_pairs(self, pairs: Sequence[tuple[int, int]]) -> list[Slip]:
        """Exchanges of two readings each."""
        found = []
        for i, j in pairs:
            fit = self._without((i, j))
            if fit is not None:
                apart = self.target[j] - self.target[i]
                gaps = fit.residuals[[i, j]]
                as_read, exchanged = fit.log_predictive((i, j), np.array([gaps, gaps + np.array([apart, -apart])]))
                found.append(Slip((i, j), 1.0, exchanged - as_read))
        return found

    def _without(self, left_out: tuple[int, ...]) -> _Fit | None:
        """The plate fitted without some readings; None if they leave a constant open."""
        start = min(self._starts, key=lambda one: one.variance(left_out)[0])
        fit = self._refitted(start, left_out)
        return fit if fit.tells_constants(left_out) else None

    def _refitted(self, start: _Fit, left_out: tuple[int, ...]) -> _Fit:
        misfit = normal_misfit(self.target, self._scales)
        x = most_likely(start.predict, misfit, start.x, self._parameters.fitted_bounds, left_out)
        return _Fit(start.predict, x, self.target, self._scales)

    def _elsewhere(self, left_out: int) -> _Fit | None:
        """Fit by least squares without a reading, from a start of their own; None if it is no plate."""
        at, setups = 0, []
        for setup in self.board.setups:
            kept = tuple(one for i, one in enumerate(setup.readings, start=at) if i != left_out)
            setups += [replace(setup, readings=kept)] if kept else []
            at += len(setup.readings)
        try:
            values = weighted_least_squares(replace(self.board, setups=tuple(setups)), _STEPS, accepted=_NEAR).values
            models = [setup_model(system_of(self.board, setup), values) for setup in self.board.setups]
        except (ValueError, KeyError):
            return None
        there = self._parameters.theta(values, self._medians)
        predict = predictor(self.board, models, "linear", there)
        return _Fit(predict, there[self._parameters.fitted_columns], self.target, self._scales)


class _Fit:
    """Residuals and slopes of all readings at one plate, in units of ln f."""

    def __init__(self, predict: Predictor, x: Floats, target: Floats, scales: Floats) -> None:
        self.predict, self.x, self.scales = predict, x, scales
        self.residuals = target - predict(x[None, :])[0]
        self.slopes = sensitivities(predict, x)
        self.inputs = x[predict.n_constants :]

    @property
    def is_plate(self) -> bool:
        """Whether it has frequencies, there and nearby."""
        return bool(np.isfinite(self.residuals).all() and np.isfinite(self.slopes).all())

    def tells_constants(self, left_out: tuple[int, ...]) -> bool:
        """Whether the other readings leave no constant open."""
        constants = np.delete(self.slopes, left_out, axis=0)[:, : self.predict.n_constants]
        return self.is_plate and bool(np.linalg.matrix_rank(constants, tol=_OPEN) == constants.shape[1])

    def variance(self, left_out: tuple[int, ...]) -> tuple[float, float]:
        """Of the other readings over the square of their scales, that prior among them; and its degrees of freedom."""
        z = np.delete(self.residuals / self.scales, left_out)
        spare = max(z.size - self.predict.n_constants, 0) + _READINGS_OF_PRIOR
        return float((z @ z + self.inputs @ self.inputs + _READINGS_OF_PRIOR) / spare), spare

    def log_predictive(self, left_out: tuple[int, ...], gaps: Floats) -> Floats:
        """ln of the density of readings so far from what the others predict: (n_sets,) array, of (n_sets, n_left)."""
        from scipy.stats import multivariate_t

        variance, spare = self.variance(left_out)
        weighted = np.delete(self.slopes / self.scales[:, None], left_out, axis=0)
        own = np.diag((np.arange(self.x.size) >= self.predict.n_constants).astype(np.float64))
        covariance = np.linalg.inv(weighted.T @ weighted + own)
        here = list(left_out)
        spread = np.diag(self.scales[here] ** 2) + self.slopes[here] @ covariance @ self.slopes[here].T
        return np.atleast_1d(multivariate_t(np.zeros(len(here)), variance * spread, df=spare).logpdf(gaps))


def noise_remarks(board: Board, log_widening: float) -> tuple[str, ...]:
    """A sentence if the readings scatter far more than the prior of the noise expects.

    `log_widening` is ln of the noise of the residuals over the median of its prior.
    """
    if not is_too_wide(board, log_widening):
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


def is_too_wide(board: Board, log_widening: float) -> bool:
    """Whether a noise of so many times its prior's median, by the logarithm, is far above what is expected."""
    widest = max(setup.noise.log_sd for setup in board.setups)
    return bool(log_widening >= max(np.log(LARGE_NOISE), LARGE_NOISE_SDS * widest))


def _stray(readings: Readings, slip: Slip) -> str:
    (i,) = slip.readings
    apart = f"{abs(1200.0 * slip.gap / np.log(2.0)):.0f} cents {'above' if slip.gap > 0 else 'below'}"
    measured = float(np.exp(readings.target[i]))
    kind = "an octave" if slip.factor in OCTAVES else "a decimal place" if slip.factor in DECIMALS else "misread"
    advice = "" if readings.is_robust else " --robust gives it less say"
    return (
        f"{readings.board.short_reading_names[i]} at {measured:.5g} Hz is {apart} what the other modes expect, "
        f"{measured * np.exp(-slip.gap):.4g} Hz: {kind}, or another mode?{advice}"
    )


def _exchange(readings: Readings, slip: Slip) -> str:
    before, after = readings.rms_cents(slip)
    return (
        f"{_pair(readings, slip)} fit far better exchanged, {after:.1f} cents rms in place of {before:.1f} "
        f"({times(slip.log_odds)} as probable): have they each other's label?"
    )


def _disorder(readings: Readings, slip: Slip) -> str:
    likelier = "exchanged" if slip.log_odds > 0 else "as they are"
    return (
        f"{_pair(readings, slip)} stand in the other order than the modes of the fitted plate; {likelier} they are "
        f"{times(abs(slip.log_odds))} as probable: their figures tell which is which"
    )


def times(log_odds: float) -> str:
    """A ratio of probabilities in words, from its logarithm."""
    if log_odds > _LOG_MILLION:
        return "more than a million times"
    odds = float(np.exp(log_odds))
    return f"{odds:.2g} times" if odds < 100 else f"{float(f'{odds:.1g}'):,.0f} times"


def _pair(readings: Readings, slip: Slip) -> str:
    names, hertz = readings.board.short_reading_names, np.exp(readings.target)
    return " and ".join(f"{names[i]} at {hertz[i]:.5g} Hz" for i in slip.readings)
