"""The null control: the same search on readings simulated without any effect."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bayesplate.arrays import Floats
from bayesplate.diagnosis.folds import (
    ANY_LOG_ODDS,
    NEEDED_LOG_ODDS,
    NOT_NEEDED_LOG_ODDS,
    NestedErrors,
    nested_leave_one_out,
)
from bayesplate.diagnosis.hypotheses import log_evidences, odds_against_none
from bayesplate.diagnosis.search import SearchGround, simulate_noise

N_SETS = 500
"""Largest number of simulated boards; they are simulated in batches until the result is certain."""
_BATCH, _CONFIDENCE = 100, 0.99
FALSE_ALARMS = 0.02
"""Share of boards without any effect on which an effect is called needed."""
CHANCE_SHARE = 0.05
"""Share of such boards, each made to choose an effect, whose leave-one-out error falls further than a claim needs."""


@dataclass(frozen=True, eq=False)
class NullControl:
    """The odds and the errors of the search on simulated readings without any effect."""

    log_odds: Floats  # (n_sets,) array: ln odds that something is lacking against that nothing is
    # (n,) array: nested leave-one-out rms after over before of the first n sets, every fold forced to choose its most
    # probable effect; None with too few readings, or where no effect is claimed
    ratio: Floats | None = None
    residuals: Floats | None = None  # (n_sets, n_modes) array: the sets themselves, ln f
    nested_errors: NestedErrors | None = None  # the errors that the ratios are of

    def without(self, carrying_readings: Sequence[int]) -> NullControl:
        """The same sets without some readings in the ratios, because their modes alone carry a constant or a size."""
        if self.nested_errors is None or not carrying_readings:
            return self
        nested_errors = self.nested_errors.without(carrying_readings)
        return replace(self, ratio=nested_errors.ratio, nested_errors=nested_errors)

    @property
    def needed_from(self) -> float:
        """ln odds against no effect above which an effect is needed: the quantile that allows the share of false
        alarms, between `NOT_NEEDED_LOG_ODDS` and `NEEDED_LOG_ODDS`.

        `NEEDED_LOG_ODDS` where no effect can act, so that there are no odds.
        """
        if not np.isfinite(self.log_odds).all():
            return NEEDED_LOG_ODDS
        quantile = float(np.quantile(self.log_odds, 1.0 - FALSE_ALARMS))
        return min(max(quantile, NOT_NEEDED_LOG_ODDS), NEEDED_LOG_ODDS)

    @property
    def flagged_share(self) -> float:
        """Share of the sets in which an effect would be called needed."""
        return float(np.mean(self.log_odds > self.needed_from))

    @property
    def ratio_to_beat(self) -> float | None:
        """The nested ratio above which an effect chosen by chance stays in 95 of 100 null sets."""
        return None if self.ratio is None else float(np.quantile(self.ratio, CHANCE_SHARE))

    def log_odds_percentile(self, log_odds: float) -> float:
        """Share of null sets with smaller odds against no effect, percent."""
        return 100.0 * float(np.mean(self.log_odds < log_odds))

    def ratio_percentile(self, ratio: float) -> float | None:
        """Share of null sets with a larger nested ratio, percent."""
        return None if self.ratio is None else 100.0 * float(np.mean(self.ratio > ratio))


def null_control(
    ground: SearchGround, rng: np.random.Generator, n_sets: int = N_SETS, log_odds: float = np.inf
) -> NullControl:
    """Simulate at most `n_sets` sets of readings of this board without any effect, and search each for its odds.

    Fewer sets are simulated where the ln odds `log_odds` no effect of the board at hand are clearly within chance.
    The ratios, which take as many searches as there are readings, come from `force_choices`.
    """
    sets: list[Floats] = []
    odds: list[Floats] = []
    for n_done in range(0, n_sets, _BATCH):
        sets.append(simulate_noise(ground.baseline, rng, min(_BATCH, n_sets - n_done)))
        odds.append(odds_against_none(ground.hypotheses, log_evidences(ground.hypotheses, ground.baseline, sets[-1])))
        if _share_bounds(np.concatenate(odds) > log_odds)[0] > FALSE_ALARMS:
            break
    return NullControl(np.concatenate(odds), residuals=np.concatenate(sets))


def force_choices(
    ground: SearchGround, control: NullControl, ratio: float = np.nan, carrying_readings: Sequence[int] = ()
) -> NullControl:
    """The same sets with their nested errors, every fold forced to choose an effect.

    Fewer sets are searched where it is clear on which side of the threshold the nested `ratio` of the board at hand
    lies. Without ratios where there are too few readings.
    """
    assert control.residuals is not None
    batches: list[NestedErrors] = []
    for first in range(0, len(control.residuals), _BATCH):
        errors = nested_leave_one_out(ground, control.residuals[first : first + _BATCH], ANY_LOG_ODDS)
        if errors is None:
            return control
        batches.append(errors.without(carrying_readings))
        low, high = _share_bounds(np.concatenate([batch.ratio for batch in batches]) <= ratio)
        if not np.isnan(ratio) and (low > CHANCE_SHARE or high < CHANCE_SHARE):
            break
    before, after, choices = (
        np.concatenate([getattr(batch, name) for batch in batches]) for name in ("before", "after", "choices")
    )
    all_errors = NestedErrors(before, after, choices).without(carrying_readings)
    return replace(control, ratio=all_errors.ratio, nested_errors=all_errors)


def _share_bounds(flags: NDArray[np.bool_]) -> tuple[float, float]:
    """Bounds of Clopper and Pearson on a share, each with the confidence `_CONFIDENCE`."""
    from scipy.special import betaincinv

    n, k = flags.size, int(flags.sum())
    low = float(betaincinv(k, n - k + 1, 1.0 - _CONFIDENCE)) if k else 0.0
    high = float(betaincinv(k + 1, n - k, _CONFIDENCE)) if k < n else 1.0
    return low, high
