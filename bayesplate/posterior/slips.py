"""Doubts about readings before anything is sampled: an octave, a decimal place, exchanged labels, large scatter.

A reading is compared with the prediction of the other readings, a Student distribution: the plate is fitted without it,
and the scatter of the others gives the noise; the prior of the noise counts only as much as one reading, because a
missing effect looks like noise. A slip is a hypothesis about one reading, or about two exchanged readings; its odds are
the predictive density of the corrected reading over that of the actual one.

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
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares, without_reading
from bayesplate.estimates.refit import most_likely, normal_misfit, sensitivities
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.predictor import Predictor
from bayesplate.frequencies.reading_errors import reading_sd
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.laplace import predictor
from bayesplate.posterior.target import Posterior

RARITY = 1000.0
"""A slip is reported where the readings are at least so many times as probable with it as without it."""
FEWEST_TO_SPARE = 2
"""Readings in excess of the number of constants that are needed to detect a slip."""
LARGE_NOISE, LARGE_NOISE_SDS = 3.0, 3.0
"""A remark is made where the noise of the residuals exceeds the median of its prior by this factor and by so many
standard deviations of its logarithm."""

OCTAVES, DECIMALS = (2.0, 0.5), (10.0, 0.1)
_STRAY_WIDTH = np.log(16.0)
"""Width in ln f of the density of a stray reading, which is not of this mode: two octaves either way."""
_READINGS_OF_PRIOR = 1.0
"""Weight of the prior of the noise, as a number of readings."""
_OPEN_SENSITIVITY = 1e-6
"""A constant is undetermined if the sensitivity of ln f to its logarithm is smaller in all combinations of readings."""
_STEPS, _TOLERANCE = 15, 0.01
"""Steps of least squares from its own start, and the accepted error of ln of a constant after them."""
_LOG_MILLION = np.log(1e6)


@dataclass(frozen=True)
class Slip:
    """A possible slip, and its odds."""

    readings: tuple[int, ...]  # index of the reading, or of the two exchanged readings
    factor: float = 1.0  # reading over its right value; 1 for a stray reading or an exchange
    log_odds: float = 0.0  # ln of the probability of the readings with the slip over that without it
    gap: float = 0.0  # ln of the reading over the prediction of the other readings


class Remarks(NamedTuple):
    """Sentences with doubts about the readings."""

    slip_remarks: tuple[str, ...]  # the likeliest slip, if a slip explains the readings
    # two readings in the wrong order, if there is no slip but a plate fits; a large noise
    other_remarks: tuple[str, ...]


def reading_remarks(posterior: Posterior, centre: Floats) -> Remarks:
    """Remarks on the readings of a posterior, whose models hold the exact law, at its (n_dim,) centre."""
    search = SlipSearch(posterior, centre)
    is_lost = not np.isfinite(search.log_widening) or is_noise_large(posterior.board, search.log_widening)
    noise = noise_remarks(posterior.board, search.log_widening)
    slip = search.likeliest(anywhere=is_lost)
    if slip is not None:
        return Remarks(
            (_exchange_sentence(search, slip) if len(slip.readings) == 2 else _stray_sentence(search, slip),), noise
        )
    pair = None if is_lost else search.disordered()
    return Remarks((), noise if pair is None else (_disorder_sentence(search, pair), *noise))


class SlipSearch:
    """Search for slips in the readings of a posterior, by the prediction of each from the others."""

    def __init__(self, posterior: Posterior, centre: Floats) -> None:
        self.board, self.is_robust = posterior.board, posterior.robust
        self.target = log_measured(self.board)
        self._parameters = posterior.parameters
        self._medians = np.array([setup.noise.median for setup in self.board.setups])
        self._scales = reading_sd(self.board.setups, self._medians)
        predict = predictor(self.board, posterior.models, "exact", centre)
        self._full_fit = _Fit(predict, centre[self._parameters.fitted_columns], self.target, self._scales)
        if self.is_robust or not self._full_fit.is_plate:
            self._full_fit = self._refit(self._full_fit, ())
        self._starts = [self._full_fit]
        self.log_widening = 0.5 * float(np.log(self._full_fit.variance(())[0]))
        """ln of the noise of the residuals over the median of its prior."""
        if self.is_robust:  # an outlier does not widen the noise
            self.log_widening = self._parameters.log_widening(centre)

    def likeliest(self, anywhere: bool = False) -> Slip | None:
        """The slip that explains the readings best, if it explains them far better than noise.

        `anywhere` if the plate may be very different from the fit of all readings: then fits also start from least
        squares without each reading.
        """
        n = self.target.size
        if n < self._parameters.n_constants + FEWEST_TO_SPARE:
            return None
        if anywhere:
            other_fits = (self._fit_from_own_start(i) for i in range(n))
            fits = [fit for fit in (self._full_fit, *other_fits) if fit is not None and fit.is_plate]
            self._starts = fits or [self._full_fit]
        single = [slip for i in range(n) for slip in self._slips_of(i)]
        best = max((*single, *self._exchanges(self._pairs())), key=lambda slip: slip.log_odds, default=None)
        return best if best is not None and best.log_odds > np.log(RARITY) else None

    def disordered(self) -> Slip | None:
        """Of the pairs of readings whose order contradicts that of the fitted modes, the likeliest exchange."""
        predicted = self.target - self._full_fit.residuals
        agreement = np.subtract.outer(self.target, self.target) * np.subtract.outer(predicted, predicted)
        pairs = [pair for pair in self._pairs() if agreement[pair] < 0.0]
        return max(self._exchanges(pairs), key=lambda slip: slip.log_odds, default=None)

    def rms_cents(self, exchange: Slip) -> tuple[float, float]:
        """Root mean square of the residuals, before and after two readings exchange their labels."""
        first, second = exchange.readings
        frequencies = [reading.frequency for setup in self.board.setups for reading in setup.readings]
        frequencies[first], frequencies[second] = frequencies[second], frequencies[first]
        exchanged = iter(frequencies)
        setups = tuple(
            replace(setup, readings=tuple(replace(reading, frequency=next(exchanged)) for reading in setup.readings))
            for setup in self.board.setups
        )
        after = weighted_least_squares(replace(self.board, setups=setups)).residuals
        before, after = (np.sqrt(np.mean(residuals**2)) for residuals in (self._full_fit.residuals, after))
        return float(cents(before)), float(cents(after))

    def _pairs(self) -> list[tuple[int, int]]:
        """Indices of all pairs of readings of the same setup."""
        ends = np.cumsum([0, *(len(setup.readings) for setup in self.board.setups)])
        return [pair for first, last in pairwise(ends.tolist()) for pair in combinations(range(first, last), 2)]

    def _slips_of(self, i: int) -> list[Slip]:
        """Possible slips of one reading."""
        fit, factors = self._fit_without((i,)), (*OCTAVES, *DECIMALS)
        if fit is None:
            return []
        gap = float(fit.residuals[i])
        as_read, *log_corrected = fit.log_predictive(
            (i,), np.array([[gap], *([gap - np.log(factor)] for factor in factors)])
        )
        stray = Slip((i,), 1.0, -np.log(_STRAY_WIDTH) - as_read, gap)
        return [
            stray,
            *(
                Slip((i,), factor, log_density - as_read, gap)
                for factor, log_density in zip(factors, log_corrected, strict=True)
            ),
        ]

    def _exchanges(self, pairs: Sequence[tuple[int, int]]) -> list[Slip]:
        """Possible exchanges of the labels of two readings."""
        slips = []
        for i, j in pairs:
            fit = self._fit_without((i, j))
            if fit is not None:
                distance = self.target[j] - self.target[i]
                gaps = fit.residuals[[i, j]]
                as_read, exchanged = fit.log_predictive(
                    (i, j), np.array([gaps, gaps + np.array([distance, -distance])])
                )
                slips.append(Slip((i, j), 1.0, exchanged - as_read))
        return slips

    def _fit_without(self, left_out: tuple[int, ...]) -> _Fit | None:
        """The plate fitted without some readings; None if the others do not determine all constants."""
        if self.target.size - len(left_out) < self._starts[0].predict.n_constants:
            return None
        start = min(self._starts, key=lambda fit: fit.variance(left_out)[0])
        fit = self._refit(start, left_out)
        return fit if fit.determines_constants(left_out) else None

    def _refit(self, start: _Fit, left_out: tuple[int, ...]) -> _Fit:
        misfit = normal_misfit(self.target, self._scales)
        x = most_likely(start.predict, misfit, start.x, self._parameters.fitted_bounds, left_out)
        return _Fit(start.predict, x, self.target, self._scales)

    def _fit_from_own_start(self, left_out: int) -> _Fit | None:
        """Fit by least squares without a reading, from its own start; None if it is no plate."""
        try:
            others = without_reading(self.board, left_out)
            values = weighted_least_squares(others, _STEPS, accepted=_TOLERANCE).values
            models = [setup_model(system_of(self.board, setup), values) for setup in self.board.setups]
        except (ValueError, KeyError):
            return None
        theta = self._parameters.theta(values, self._medians)
        predict = predictor(self.board, models, "linear", theta)
        return _Fit(predict, theta[self._parameters.fitted_columns], self.target, self._scales)


class _Fit:
    """Residuals and slopes of all readings at one plate, in ln f."""

    def __init__(self, predict: Predictor, x: Floats, target: Floats, scales: Floats) -> None:
        self.predict, self.x, self.scales = predict, x, scales
        self.residuals = target - predict(x[None, :])[0]
        self.slopes = sensitivities(predict, x)
        self.inputs = x[predict.n_constants :]

    @property
    def is_plate(self) -> bool:
        """Whether the frequencies and their slopes are finite."""
        return bool(np.isfinite(self.residuals).all() and np.isfinite(self.slopes).all())

    def determines_constants(self, left_out: tuple[int, ...]) -> bool:
        """Whether the other readings determine all constants."""
        constants = np.delete(self.slopes, left_out, axis=0)[:, : self.predict.n_constants]
        return self.is_plate and bool(np.linalg.matrix_rank(constants, tol=_OPEN_SENSITIVITY) == constants.shape[1])

    def variance(self, left_out: tuple[int, ...]) -> tuple[float, float]:
        """Variance of the other readings over their squared scales, with the noise's prior; and degrees of freedom."""
        z = np.delete(self.residuals / self.scales, left_out)
        spare = max(z.size - self.predict.n_constants, 0) + _READINGS_OF_PRIOR
        return float((z @ z + self.inputs @ self.inputs + _READINGS_OF_PRIOR) / spare), spare

    def log_predictive(self, left_out: tuple[int, ...], gaps: Floats) -> Floats:
        """ln predictive density, (n_sets,), of (n_sets, n_left) gaps between readings and their prediction."""
        from scipy.special import gammaln

        variance, spare = self.variance(left_out)
        weighted = np.delete(self.slopes / self.scales[:, None], left_out, axis=0)
        prior = np.eye(self.x.size)[self.predict.n_constants :]
        root = np.asarray(np.linalg.qr(np.concatenate([weighted, prior]), mode="r"))
        indices = list(left_out)
        predicted = np.linalg.solve(root.T, self.slopes[indices].T)
        spread = np.diag(self.scales[indices] ** 2) + predicted.T @ predicted
        # not scipy's multivariate_t, which refuses readings that the others leave wide open
        factor, n = np.linalg.cholesky(variance * spread), len(indices)
        squares = np.sum(np.linalg.solve(factor, gaps.T) ** 2, axis=0)
        log_constant = gammaln(0.5 * (spare + n)) - gammaln(0.5 * spare) - 0.5 * n * np.log(np.pi * spare)
        return np.asarray(
            log_constant - np.log(np.diagonal(factor)).sum() - 0.5 * (spare + n) * np.log1p(squares / spare)
        )


def noise_remarks(board: Board, log_widening: float | Floats) -> tuple[str, ...]:
    """A sentence if the readings scatter far more than the prior of the noise expects.

    `log_widening` is ln of the noise of the residuals over the median of its prior, of all setups or of each.
    """
    log_widenings = np.broadcast_to(log_widening, len(board.setups))
    if not is_noise_large(board, float(np.max(log_widenings))):
        return ()
    levels = ", ".join(
        f"{100.0 * setup.noise.median * np.exp(own_widening):.2g} % where about {100.0 * setup.noise.median:.2g} % is "
        "expected" + (f" in setup {setup.name}" if len(board.setups) > 1 else "")
        for setup, own_widening in zip(board.setups, log_widenings, strict=True)
    )
    return (
        f"the readings scatter about the fitted plate by {levels}: no plate of these sizes and edges fits them, so do "
        "not trust the constants before a label, a size or an edge is corrected, or an effect explains them "
        "(bayesplate diagnose looks for one)",
    )


def is_noise_large(board: Board, log_widening: float) -> bool:
    """Whether a noise is far above its prior, from ln of the noise over the prior's median."""
    widest = max(setup.noise.log_sd for setup in board.setups)
    return bool(log_widening >= max(np.log(LARGE_NOISE), LARGE_NOISE_SDS * widest))


def _stray_sentence(search: SlipSearch, slip: Slip) -> str:
    (i,) = slip.readings
    distance = f"{abs(1200.0 * slip.gap / np.log(2.0)):.0f} cents {'above' if slip.gap > 0 else 'below'}"
    measured = float(np.exp(search.target[i]))
    kind = "an octave" if slip.factor in OCTAVES else "a decimal place" if slip.factor in DECIMALS else "misread"
    advice = "" if search.is_robust else " --robust gives it less say"
    return (
        f"{search.board.short_reading_names[i]} at {measured:.5g} Hz is {distance} what the other modes expect, "
        f"{measured * np.exp(-slip.gap):.4g} Hz: {kind}, or another mode?{advice}"
    )


def _exchange_sentence(search: SlipSearch, slip: Slip) -> str:
    before, after = search.rms_cents(slip)
    return (
        f"{_pair_in_words(search, slip)} fit far better exchanged, {after:.1f} cents rms in place of {before:.1f} "
        f"({odds_in_words(slip.log_odds)} as probable): have they each other's label?"
    )


def _disorder_sentence(search: SlipSearch, slip: Slip) -> str:
    likelier = "exchanged" if slip.log_odds > 0 else "as they are"
    return (
        f"{_pair_in_words(search, slip)} stand in the other order than the modes of the fitted plate; {likelier} "
        f"they are {odds_in_words(abs(slip.log_odds))} as probable: their figures tell which is which"
    )


def odds_in_words(log_odds: float) -> str:
    """A ratio of probabilities in words, from its logarithm."""
    if log_odds > _LOG_MILLION:
        return "more than a million times"
    odds = float(np.exp(log_odds))
    return f"{odds:.2g} times" if odds < 100 else f"{float(f'{odds:.1g}'):,.0f} times"


def _pair_in_words(search: SlipSearch, slip: Slip) -> str:
    names, hertz = search.board.short_reading_names, np.exp(search.target)
    return " and ".join(f"{names[i]} at {hertz[i]:.5g} Hz" for i in slip.readings)
