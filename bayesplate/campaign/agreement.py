"""Whether a board wants what the others teach: each against the rest, so that a value that one refuses is noticed."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from bayesplate.campaign.together import Together

_SAYS = 0.25
"""Precision, in units of the prior's, above which a board says something of a direction: its posterior is then
narrower by a tenth at least. A likelihood with a slope and no curvature moves a posterior and leaves it as wide; the
variance of its slope would be taken for zero, and a lean of one standard deviation for a refusal."""
REFUSED = 0.05
"""p-value, multiplied by the number of boards, below which a board refuses what the others teach."""


@dataclass(frozen=True)
class LeftOut:
    """A board when the others teach it the shared parameters."""

    log_score: float  # ln of the probability of its readings, the shared parameters learned from the others
    p_value: float  # how often a board that shares the others' parameters would want to leave them at least as much
    refuses: bool  # whether it does not want what they teach, as many boards as were asked being allowed for


def left_out(together: Together) -> dict[str, LeftOut]:
    """Every board left out in turn."""
    everything, refused = together.log_evidence(), refusing(together)
    return {
        name: LeftOut(everything - together.log_evidence((i,)), p_value(together, i), name in refused)
        for i, name in enumerate(together.names)
    }


def refusing(together: Together) -> tuple[str, ...]:
    """Names of the boards that refuse what the others teach, as many as were asked being allowed for.

    The one that refuses most is left out before the others are asked again: it had taught them too. Where two are left
    that do not agree, both are named: nothing tells which of them is the odd one.
    """
    out: list[int] = []
    n = len(together.names)
    while len(out) < n - 1:
        values = {i: p_value(together, i, out) for i in range(n) if i not in out}
        worst = min(values, key=lambda i: values[i])
        if values[worst] * len(values) >= REFUSED:
            break
        out += [worst] if len(values) > 2 else list(values)
    return tuple(together.names[i] for i in sorted(out))


def p_value(together: Together, board: int, without: Collection[int] = ()) -> float:
    """Of one board against the others, or those of them that are not left out: the score test of its likelihood.

    The board's own posterior, its prior divided out, amounts to a normal likelihood exp(h'z - z'Pz / 2). If the board
    is one of the others' kind, who teach its numbers with the mean m and the covariance C, its slope h - P m there is
    normal about zero with the covariance P + P C P. Only directions count of which the board says something.

    References
    ----------
    E. C. Marshall and D. J. Spiegelhalter, Identifying outliers in Bayesian hierarchical models: a simulation-based
    approach, Bayesian Analysis 2 (2007). [each unit against the rest]
    """
    from scipy.stats import chi2

    mean, covariance = together.taught((board, *without))
    pull = together.pulls[board]
    sizes, directions = np.linalg.eigh(pull.precision)
    told = directions[:, sizes > _SAYS]
    if not told.size:
        return 1.0
    slope = told.T @ (pull.lean - pull.precision @ mean)
    spread = told.T @ (pull.precision + pull.precision @ covariance @ pull.precision) @ told
    return float(chi2.sf(slope @ np.linalg.solve(spread, slope), told.shape[1]))
