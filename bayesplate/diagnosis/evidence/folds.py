"""Leave one reading out, choose again, predict it: what a chosen effect is worth where it has not been fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.evidence.hypotheses import log_evidences, probabilities
from bayesplate.diagnosis.evidence.search import Ground
from bayesplate.diagnosis.evidence.terms import Fold

Floats = NDArray[np.float64]

NEEDED = 0.1
"""Probability of no effect from which on none is added."""
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
        With the effect that the remaining readings choose, or none.
    chosen : (n_sets, n_modes) array of int
        Index of the hypothesis that each fold chose.
    """

    before: Floats
    after: Floats
    chosen: NDArray[np.intp]

    @property
    def ratio(self) -> Floats:
        """Rms after over rms before: (n_sets,) array."""
        return np.asarray(np.sqrt(np.mean(self.after**2, axis=1) / np.mean(self.before**2, axis=1)))


def nested(ground: Ground, residuals: Floats) -> Nested | None:
    """Leave each reading out in turn, search again without it, and predict it by what was chosen.

    Parameters
    ----------
    ground : Ground
    residuals : (n_sets, n_modes) array

    Returns
    -------
    Nested or None
        None if there are too few readings.
    """
    n_modes = ground.baseline.n_modes
    if n_modes < FEWEST:
        return None
    before, after = np.empty(residuals.shape), np.empty(residuals.shape)
    chosen = np.empty(residuals.shape, dtype=np.intp)
    for mode in range(n_modes):
        fold = Fold(ground.baseline, mode)
        picked = choices(ground, fold, residuals)
        chosen[:, mode] = picked
        before[:, mode] = residuals @ fold.misses
        after[:, mode] = before[:, mode]
        for index in np.unique(picked[picked > 0]):
            sets = picked == index
            hypothesis = ground.hypotheses[index]
            seen = hypothesis.seen(ground.baseline, residuals[sets])
            after[sets, mode] = hypothesis.terms(fold).left_out_errors(seen)
    return Nested(before, after, chosen)


def choices(ground: Ground, fold: Fold, residuals: Floats) -> NDArray[np.intp]:
    """The most probable hypothesis for each data set, or none where none is probable enough: (n_sets,) array."""
    shares = probabilities(ground.hypotheses, log_evidences(ground.hypotheses, fold, residuals))
    best = 1 + np.argmax(shares[1:], axis=0) if len(shares) > 1 else np.zeros(shares.shape[1], dtype=np.intp)
    return np.where(shares[0] >= NEEDED, 0, best)


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
    hypothesis = ground.hypotheses[index]
    seen = hypothesis.seen(ground.baseline, residual[None, :])
    whole = hypothesis.terms(ground.whole).log_evidence(seen)[0]
    folds = (Fold(ground.baseline, mode) for mode in range(ground.baseline.n_modes))
    return float(sum(whole - hypothesis.terms(fold).log_evidence(seen)[0] for fold in folds))
