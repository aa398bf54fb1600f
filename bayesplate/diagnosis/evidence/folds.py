"""Leave one mode out, choose again, predict it: what a chosen effect is worth where it has not been fitted.

A mode is one reading; of several sessions of one setup it is its readings in all of them, for each tells of the others.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import log_evidences, odds_against_none, probabilities
from bayesplate.diagnosis.evidence.search import Ground
from bayesplate.diagnosis.evidence.terms import Fold
from bayesplate.diagnosis.shifts.baseline import Baseline

Floats = NDArray[np.float64]

NEEDED = 0.1
"""Probability of no effect below which one is needed, whatever the null simulations say."""
CERTAINLY_NEEDED = float(np.log((1.0 - NEEDED) / NEEDED))
"""The same as ln odds against no effect."""
ALWAYS = -np.inf
"""Odds from which on an effect is chosen by whoever is made to choose one."""
FEWEST = 5
"""Modes without which a fold has no direction left to choose by."""


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
        Index of the hypothesis that the fold of each reading chose.
    carried : tuple of int
        Readings that count neither before nor after, for their mode alone carries a constant or a size.
    """

    before: Floats
    after: Floats
    chosen: NDArray[np.intp]
    carried: tuple[int, ...] = ()

    def without(self, carried: Sequence[int]) -> Nested:
        """The same errors, some readings not counted."""
        return replace(self, carried=tuple(sorted({*self.carried, *carried})))

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Which errors count: of readings that are a mode before and after, and that others foretell.

        (n_sets, n_modes) array.
        """
        counted = np.isfinite(self.before) & np.isfinite(self.after)
        counted[:, list(self.carried)] = False
        return counted

    @property
    def ratio(self) -> Floats:
        """Rms after over rms before, over the readings that count: (n_sets,) array, not a number where none does."""
        after, before = (np.where(self.counted, part, 0.0) for part in (self.after, self.before))
        with np.errstate(invalid="ignore"):
            return np.asarray(np.sqrt(np.sum(after**2, axis=1) / np.sum(before**2, axis=1)))


def nested(ground: Ground, residuals: Floats, needed_from: float = CERTAINLY_NEEDED) -> Nested | None:
    """Leave each mode out in turn, search again without it, and predict its readings by what was chosen.

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
    modes = ground.baseline.same_modes
    if len(modes) < FEWEST:
        return None
    none = ground.hypotheses[0]

    def folded(mode: tuple[int, ...]) -> NDArray[np.float64]:
        chosen = choices(ground, _without(ground.baseline, mode[0], mode), residuals, needed_from)
        return np.stack([predicted(_without(ground.baseline, reading, mode), chosen) for reading in mode])

    def predicted(fold: Fold, chosen: NDArray[np.intp]) -> Floats:
        before = none.terms(fold).left_out_errors(none.seen(ground.baseline, residuals))
        after = before.copy()
        for index in np.unique(chosen[chosen > 0]):
            sets = chosen == index
            hypothesis = ground.hypotheses[index]
            seen = hypothesis.seen(ground.baseline, residuals[sets])
            after[sets] = hypothesis.terms(fold).left_out_errors(seen)
        return np.stack([before, after, chosen])

    found = np.concatenate([folded(mode) for mode in modes])[np.argsort(np.concatenate(modes))]
    before, after, chosen = np.moveaxis(found, 0, 2)
    return Nested(before, after, chosen.astype(np.intp))


def _without(baseline: Baseline, reading: int, mode: tuple[int, ...]) -> Fold:
    """The fold in which a reading is to be predicted, every reading of its mode left out."""
    return Fold(baseline, reading, tuple(other for other in mode if other != reading))


def choices(ground: Ground, fold: Fold, residuals: Floats, needed_from: float = CERTAINLY_NEEDED) -> NDArray[np.intp]:
    """The most probable effect for each data set, or none where the odds against none are too low: (n_sets,) array."""
    evidences = log_evidences(ground.hypotheses, fold, residuals)
    if len(evidences) == 1:
        return np.zeros(len(residuals), dtype=np.intp)
    best = 1 + np.argmax(probabilities(ground.hypotheses, evidences)[1:], axis=0)
    return np.where(odds_against_none(ground.hypotheses, evidences) > needed_from, best, 0)


def left_out(ground: Ground, index: int, residual: Floats) -> Floats:
    """Errors of predicting each reading from the other modes under one hypothesis: (n_modes,) array, ln f."""
    hypothesis = ground.hypotheses[index]
    seen = hypothesis.seen(ground.baseline, residual[None, :])
    errors = np.zeros(len(residual))
    for mode in ground.baseline.same_modes:
        for reading in mode:
            terms = hypothesis.terms(_without(ground.baseline, reading, mode))
            errors[reading] = terms.left_out_errors(seen)[0]
    return errors


def log_score(ground: Ground, index: int, residual: Floats, carried: Collection[int] = ()) -> float:
    """Sum over the modes of the log density of the readings of each given the others, under one hypothesis.

    A ratio of two restricted densities each, noise and sizes averaged; without the modes of readings that are carried.
    """
    return float(sum(_log_score_of(ground, index, residual, mode) for mode in _foretold(ground, carried)))


def _foretold(ground: Ground, carried: Collection[int]) -> list[tuple[int, ...]]:
    """Readings of each mode, but of those that alone carry a constant or a size."""
    return [mode for mode in ground.baseline.same_modes if not set(mode) & set(carried)]


def log_score_gains(
    ground: Ground, residual: Floats, chosen: NDArray[np.intp], carried: Collection[int] = ()
) -> Floats:
    """What each fold's choice adds to the log density of the readings that it left out: one per mode, in their order.

    Parameters
    ----------
    ground : Ground
    residual : (n_modes,) array
    chosen : (n_modes,) array of int
        Index of the hypothesis that the fold of each reading chose.
    carried : collection of int
        Readings whose modes are not counted.
    """
    modes = _foretold(ground, carried)
    gains = np.zeros(len(modes))
    for place, mode in enumerate(modes):
        index = int(chosen[mode[0]])
        if index:
            one, none = (_log_score_of(ground, each, residual, mode) for each in (index, 0))
            gains[place] = one - none
    return gains


def _log_score_of(ground: Ground, index: int, residual: Floats, mode: tuple[int, ...]) -> float:
    """Log density of the readings of a mode given the others, under one hypothesis."""
    hypothesis = ground.hypotheses[index]
    seen = hypothesis.seen(ground.baseline, residual[None, :])
    own = ground.baseline if hypothesis.own is None else hypothesis.own
    alone = sum(own.log_alone(reading) for reading in mode if not own.is_mode[reading])
    if not any(own.is_mode[reading] for reading in mode):
        return float(alone)
    fold = _without(ground.baseline, mode[0], mode)
    whole, without = (hypothesis.terms(one).log_evidence(seen)[0] for one in (ground.whole, fold))
    return float(alone + whole - without)
