"""What to doubt about readings before anything is sampled, in a sentence each: slips, order, too large a noise."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bayesplate.board.board import Board
from bayesplate.estimates.least_squares import log_measured, weighted_least_squares
from bayesplate.frequencies.laws import cents
from bayesplate.frequencies.model import setup_model
from bayesplate.frequencies.system import system_of
from bayesplate.posterior.slips import DECIMALS, OCTAVES, Slip, SlipSearch
from bayesplate.posterior.target import Posterior

LARGE_NOISE, LARGE_NOISE_SDS = 3.0, 3.0
"""Noise that the residuals want, over the median of its prior, and in standard deviations of its logarithm, beyond
which the reader is told."""

_LOG_MILLION = np.log(1e6)


class Remarks(NamedTuple):
    """What a reader of the constants must know of the readings, a sentence each.

    Attributes
    ----------
    slips : tuple of str
        The likeliest slip, if one explains the readings.
    others : tuple of str
        Otherwise the two readings whose order is least like the plate's, unless no plate fits; and whether the noise
        that the residuals want is far above its prior.
    """

    slips: tuple[str, ...]
    others: tuple[str, ...]


def reading_remarks(posterior: Posterior, centre: NDArray[np.float64]) -> Remarks:
    """What is to be said of the readings of a posterior.

    Parameters
    ----------
    posterior : Posterior
        Its models hold the exact law.
    centre : (n_dim,) array
        Where the readings are most likely.

    Returns
    -------
    Remarks
    """
    search = SlipSearch(posterior, centre)
    is_lost = is_too_wide(posterior.board, search.log_widening)
    noise = noise_remarks(posterior.board, search.log_widening)
    slip = search.likeliest(anywhere=is_lost)
    if slip is not None:
        return Remarks((_exchange(search.board, slip) if slip.is_exchange else _stray(search, slip),), noise)
    pair = None if is_lost else search.disordered()
    return Remarks((), noise if pair is None else (_disorder(search.board, pair), *noise))


def noise_remarks(board: Board, log_widening: float) -> tuple[str, ...]:
    """That the readings scatter far more than the prior of the noise lets expect, if they do; a sentence.

    Parameters
    ----------
    board : Board
    log_widening : float
        ln of the noise that the residuals want, over the median of its prior.
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


def _stray(search: SlipSearch, slip: Slip) -> str:
    (i,) = slip.readings
    gap = _above_the_others(search.board, i)
    apart = f"{abs(1200.0 * gap / np.log(2.0)):.0f} cents {'above' if gap > 0 else 'below'}"
    measured = float(np.exp(search.target[i]))
    kind = "an octave" if slip.factor in OCTAVES else "a decimal place" if slip.factor in DECIMALS else "misread"
    advice = "" if search.is_robust else " --robust gives it less say"
    return (
        f"{search.board.short_reading_names[i]} at {measured:.5g} Hz is {apart} what the other modes expect, "
        f"{measured * np.exp(-gap):.4g} Hz: {kind}, or another mode?{advice}"
    )


def _exchange(board: Board, slip: Slip) -> str:
    residuals = (weighted_least_squares(each).residuals for each in (board, slip.mended_board(board)))
    before, after = (cents(np.sqrt(np.mean(each**2))) for each in residuals)
    return (
        f"{_pair(board, slip)} fit far better exchanged, {after:.1f} cents rms in place of {before:.1f} "
        f"({times(slip.log_odds)} as probable): have they each other's label?"
    )


def _disorder(board: Board, slip: Slip) -> str:
    likelier = "exchanged" if slip.log_odds > 0 else "as they are"
    return (
        f"{_pair(board, slip)} stand in the other order than the modes of the fitted plate; {likelier} they are "
        f"{times(abs(slip.log_odds))} as probable: their figures tell which is which"
    )


def times(log_odds: float) -> str:
    """How many times as probable, in words; from the logarithm."""
    if log_odds > _LOG_MILLION:
        return "more than a million times"
    odds = float(np.exp(log_odds))
    return f"{odds:.2g} times" if odds < 100 else f"{float(f'{odds:.1g}'):,.0f} times"


def _pair(board: Board, slip: Slip) -> str:
    hertz = np.exp(log_measured(board))
    return " and ".join(f"{board.short_reading_names[i]} at {hertz[i]:.5g} Hz" for i in slip.readings)


def _above_the_others(board: Board, reading: int) -> float:
    """How far a reading lies above what the others expect: ln measured - ln predicted, by least squares without it."""
    values = weighted_least_squares(Slip((reading,)).mended_board(board)).values
    models = (setup_model(system_of(board, setup), values) for setup in board.setups)
    predicted = np.concatenate([model.log_frequencies(values, "linear")[0] for model in models])
    return float(log_measured(board)[reading] - predicted[reading])
