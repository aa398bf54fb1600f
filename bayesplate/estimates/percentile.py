"""The paper's percentile method: many least-squares estimates from subsets of the modes, trimmed, averaged.

Read so that it reproduces the printed table within 1 %: all subsets of three modes or more, least squares in psi, one
Poisson factor for all of them, and for each constant on its own: negative estimates dropped, then the values between
the 20th and the 80th percentile kept (midpoint definition), their mean and sample standard deviation reported. The
trimming makes the spread. The paper takes the Poisson factor from a table; here it is that of the fit of all modes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from bayesplate.arrays import Bools, Floats
from bayesplate.board.material import MODULI
from bayesplate.estimates.paper import PaperSystem

LOW_PERCENTILE, HIGH_PERCENTILE = 20.0, 80.0
MOST_MODES = 16
"""Beyond this number the subsets (65 399 at 16 modes) are too many to enumerate."""


@dataclass(frozen=True, eq=False)
class PercentileEstimate:
    """Mean and spread of the trimmed estimates of each modulus, Pa."""

    estimates: Floats  # (n_subsets, 3) E_x, E_y, G_xy, before trimming
    is_kept: Bools  # (n_subsets, 3)
    mean: Mapping[str, float]
    sd: Mapping[str, float]

    @property
    def n_subsets(self) -> int:
        return int(self.estimates.shape[0])


def percentile_estimate(system: PaperSystem) -> PercentileEstimate | None:
    """E_x, E_y, G_xy from all subsets of the modes; None for fewer modes than constants, or more than `MOST_MODES`.

    Ducceschi et al., section 5 and the table of results.
    """
    n_modes = system.psi.size
    if not len(MODULI) <= n_modes <= MOST_MODES:
        return None
    subsets = (np.array(list(combinations(range(n_modes), size))) for size in range(3, n_modes + 1))
    constants = np.concatenate([system.solve(rows) for rows in subsets])
    D_x, D_y, _ = system.solve()
    nu_yx = float(system.values["poisson_xy"]) * D_y / D_x
    estimates = np.stack(system.moduli(constants, nu_yx=nu_yx), axis=-1)
    is_kept = np.stack([_trim_mask(column) for column in estimates.T], axis=-1)
    means, sds = {}, {}
    for name, column, inside in zip(MODULI, estimates.T, is_kept.T, strict=True):
        values = column[inside]
        means[name] = float(values.mean()) if values.size else float("nan")
        sds[name] = float(values.std(ddof=1)) if values.size > 1 else float("nan")
    return PercentileEstimate(estimates, is_kept, means, sds)


def _trim_mask(values: Floats) -> Bools:
    """Which values are positive and lie between the two percentiles of the positive ones."""
    positive = values > 0
    if not positive.any():
        return positive
    low, high = np.percentile(values[positive], [LOW_PERCENTILE, HIGH_PERCENTILE], method="hazen")
    return np.asarray(positive & (values >= low) & (values <= high))
