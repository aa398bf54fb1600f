"""Leave one reading out, choose again, predict it: what a chosen effect is worth where it has not been fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import log_evidences, odds_against_none, probabilities
from bayesplate.diagnosis.evidence.search import Ground
from bayesplate.diagnosis.evidence.terms import Fold
from bayesplate.modes.threads import in_threads

Floats = NDArray[np.float64]

NEEDED = 0.1
"""Probability of no effect below which one is needed, whatever the null simulations say."""
CERTAINLY_NEEDED = float(np.log((1.0 - NEEDED) / NEEDED))
"""The same as ln odds against no effect."""
ALWAYS = -np.inf
"""Odds from which on an effect is chosen by whoever is made to choose one."""
FEWEST = 5
"""Readings without which a fold has no direction left to choose by."""


@dataclass(frozen=True, eq=False)
class Nested:
    """Errors of predicting readings that were left out, for many data sets.

    Attributes
    ----------
    before : (n_sets, n_modes) array
        ln measured less predicted, without any effect.
    after : (n_sets, n_modes) array
        With the effect that the remaining readings choose, or none; not a number where the reading is no mode then.
    chosen : (n_sets, n_modes) array of int
        Index of the hypothesis that each fold chose.
    """

    before: Floats
    after: Floats
    chosen: NDArray[np.intp]

    @property
    def ratio(self) -> Floats:
        """Rms after over rms before, over the readings that are a mode under both: (n_sets,) array."""
        both = np.isfinite(self.before) & np.isfinite(self.after)
        after, before = (np.where(both, part, 0.0) for part in (self.after, self.before))
        return np.asarray(np.sqrt(np.sum(after**2, axis=1) / np.sum(before**2, axis=1)))


def nested(ground: Ground, residuals: Floats, needed_from: float = CERTAINLY_NEEDED) -> Nested | None:
    """Leave each reading out in turn, search again without it, and predict it by what was chosen.

    Parameters
    ----------
    ground : Ground
    residuals : (n_sets, n_modes) array
    needed_from : float
        ln odds against no effect above which a fold adds the most probable one; `ALWAYS` makes every fold choose.

    Returns
    -------
    Nested or None
        None if there are too few readings.
    """
    n_modes = ground.baseline.n_modes
    if n_modes < FEWEST:
        return None
    none = ground.hypotheses[0]

    def folded(mode: int) -> tuple[Floats, Floats, NDArray[np.intp]]:
        fold = Fold(ground.baseline, mode)
        chosen = choices(ground, fold, residuals, needed_from)
        before = none.seen(ground.baseline, residuals) @ none.terms(fold).fold.misses
        after = before.copy()
        for index in np.unique(chosen[chosen > 0]):
            sets = chosen == index
            hypothesis = ground.hypotheses[index]
            seen = hypothesis.seen(ground.baseline, residuals[sets])
            after[sets] = hypothesis.terms(fold).left_out_errors(seen)
        return before, after, chosen

    before, after, chosen = zip(*in_threads(folded, range(n_modes)), strict=True)
    return Nested(*(np.stack(each, axis=1) for each in (before, after, chosen)))


def choices(ground: Ground, fold: Fold, residuals: Floats, needed_from: float = CERTAINLY_NEEDED) -> NDArray[np.intp]:
    """The most probable effect for each data set, or none where the odds against none are too low: (n_sets,) array."""
    evidences = log_evidences(ground.hypotheses, fold, residuals)
    if len(evidences) == 1:
        return np.zeros(len(residuals), dtype=np.intp)
    best = 1 + np.argmax(probabilities(ground.hypotheses, evidences)[1:], axis=0)
    return np.where(odds_against_none(ground.hypotheses, evidences) > needed_from, best, 0)


def left_out(ground: Ground, index: int, residual: Floats) -> Floats:
    """Errors of predicting each reading from the others under one hypothesis: (n_modes,) array, ln f."""
    hypothesis = ground.hypotheses[index]
    seen = hypothesis.seen(ground.baseline, residual[None, :])
    return np.array(
        [
            hypothesis.terms(Fold(ground.baseline, mode)).left_out_errors(seen)[0]
            for mode in range(ground.baseline.n_modes)
        ]
    )


def log_score(ground: Ground, index: int, residual: Floats) -> float:
    """Sum over the readings of the log density of each given the others, under one hypothesis.

    A ratio of two restricted densities each, noise and sizes averaged.
    """
    return float(sum(_log_score_of(ground, index, residual, mode) for mode in range(ground.baseline.n_modes)))


def log_score_gains(ground: Ground, residual: Floats, chosen: NDArray[np.intp]) -> Floats:
    """What each fold's choice adds to the log density of the reading that it left out: (n_modes,) array.

    Parameters
    ----------
    ground : Ground
    residual : (n_modes,) array
    chosen : (n_modes,) array of int
        Index of the hypothesis that each fold chose.
    """
    gains = np.zeros(len(residual))
    for mode in np.flatnonzero(chosen):
        one, none = (_log_score_of(ground, int(index), residual, int(mode)) for index in (chosen[mode], 0))
        gains[mode] = one - none
    return gains


def _log_score_of(ground: Ground, index: int, residual: Floats, mode: int) -> float:
    """Log density of one reading given the others, under one hypothesis."""
    hypothesis = ground.hypotheses[index]
    seen = hypothesis.seen(ground.baseline, residual[None, :])
    own = ground.baseline if hypothesis.own is None else hypothesis.own
    if not own.is_mode[mode]:
        return own.log_alone(mode)
    fold = Fold(ground.baseline, mode)
    whole, without = (hypothesis.terms(one).log_evidence(seen)[0] for one in (ground.whole, fold))
    return float(whole - without)
