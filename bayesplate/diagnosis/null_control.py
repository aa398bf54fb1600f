"""The null control: the same search on readings simulated without any effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.diagnosis.folds import ALWAYS, CERTAINLY_NEEDED, Nested, nested
from bayesplate.diagnosis.hypotheses import log_evidences, odds_against_none
from bayesplate.diagnosis.search import Ground, noise_of_board

N_SETS = 500
"""Simulated boards at most, a batch at a time until the answer is certain."""
_BATCH, _CERTAIN = 100, 0.99
FALSE_ALARMS = 0.02
"""Share of boards without any effect on which one is called needed."""
BY_CHANCE = 0.05
"""Share of such boards, each made to choose an effect, whose left-out error falls further than a claim needs."""


@dataclass(frozen=True, eq=False)
class NullControl:
    """What the search makes of readings that contain nothing."""

    against: Floats  # (n_sets,) array: ln odds that something is lacking against that nothing is
    # (n,) array: nested leave-one-out rms after over before of the first n sets, every fold made to choose its most
    # probable effect; None with too few readings, or where nothing is claimed that chance might have chosen
    ratio: Floats | None = None
    residuals: Floats | None = None  # (n_sets, n_modes) array: the sets themselves, ln f
    folded: Nested | None = None  # the errors that the ratios are of

    def without(self, carried: Sequence[int]) -> NullControl:
        """The same sets, some readings not counted in the ratios, for their modes alone carry something."""
        if self.folded is None or not carried:
            return self
        folded = self.folded.without(carried)
        return replace(self, ratio=folded.ratio, folded=folded)

    @property
    def needed_from(self) -> float:
        """ln odds against no effect above which one is needed: those of the false alarms, or of certainty if less.

        Of certainty too where there is nothing that could be lacking, and so no odds.
        """
        if not np.isfinite(self.against).all():
            return CERTAINLY_NEEDED
        return min(float(np.quantile(self.against, 1.0 - FALSE_ALARMS)), CERTAINLY_NEEDED)

    @property
    def flagged(self) -> float:
        """Share of the sets in which an effect would be called needed."""
        return float(np.mean(self.against > self.needed_from))

    @property
    def ratio_to_beat(self) -> float | None:
        """The nested ratio that an effect chosen by chance stays above in 95 of 100 null sets."""
        return None if self.ratio is None else float(np.quantile(self.ratio, BY_CHANCE))

    def percentile_of(self, against: float) -> float:
        """Share of null sets with smaller odds against no effect, percent."""
        return 100.0 * float(np.mean(self.against < against))

    def place_of(self, ratio: float) -> float | None:
        """Share of null sets with a larger nested ratio, percent."""
        return None if self.ratio is None else 100.0 * float(np.mean(self.ratio > ratio))


def null_control(
    ground: Ground, rng: np.random.Generator, n_sets: int = N_SETS, against: float = np.inf
) -> NullControl:
    """Readings of boards like this one without any effect, at most `n_sets`, and the odds that a search gives each of
    them.

    Where the ln odds `against` no effect of the board at hand are clearly within chance, fewer sets say so as well.
    Without ratios, which take as many searches as there are readings: see `made_to_choose`.
    """
    sets: list[Floats] = []
    odds: list[Floats] = []
    for n_done in range(0, n_sets, _BATCH):
        sets.append(noise_of_board(ground.baseline, rng, min(_BATCH, n_sets - n_done)))
        odds.append(odds_against_none(ground.hypotheses, log_evidences(ground.hypotheses, ground.baseline, sets[-1])))
        if _share(np.concatenate(odds) > against)[0] > FALSE_ALARMS:
            break
    return NullControl(np.concatenate(odds), residuals=np.concatenate(sets))


def made_to_choose(
    ground: Ground, control: NullControl, ratio: float = np.nan, carried: Sequence[int] = ()
) -> NullControl:
    """The same boards with the errors of their readings left out, every fold made to choose an effect.

    Where it is clear on which side of the threshold the nested `ratio` of the board at hand lies, fewer sets say so as
    well. Without ratios where there are too few readings.
    """
    assert control.residuals is not None
    parts: list[Nested] = []
    for first in range(0, len(control.residuals), _BATCH):
        folded = nested(ground, control.residuals[first : first + _BATCH], ALWAYS)
        if folded is None:
            return control
        parts.append(folded.without(carried))
        low, high = _share(np.concatenate([one.ratio for one in parts]) <= ratio)
        if not np.isnan(ratio) and (low > BY_CHANCE or high < BY_CHANCE):
            break
    before, after, chosen = (
        np.concatenate([getattr(one, name) for one in parts]) for name in ("before", "after", "chosen")
    )
    every = Nested(before, after, chosen).without(carried)
    return replace(control, ratio=every.ratio, folded=every)


def _share(is_so: NDArray[np.bool_]) -> tuple[float, float]:
    """Bounds of Clopper and Pearson on a share, each certain to `_CERTAIN`."""
    from scipy.special import betaincinv

    n, k = is_so.size, int(is_so.sum())
    low = float(betaincinv(k, n - k + 1, 1.0 - _CERTAIN)) if k else 0.0
    high = float(betaincinv(k + 1, n - k, _CERTAIN)) if k < n else 1.0
    return low, high
