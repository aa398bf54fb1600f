"""Readings that stand in another order than the modes they are called after: told, never mended silently."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from bayesplate.diagnosis.evidence.hypotheses import Swap, order_conflicts
from bayesplate.diagnosis.evidence.search import Found


def order_notes(found: Found) -> tuple[str, ...]:
    """One sentence for every two readings of one setup in the other order than these modes of the fitted plate.

    Of two that may have been exchanged it gives the likelihood ratio.
    """
    baseline = found.ground.baseline
    readings = baseline.residual + baseline.log_frequency
    notes = list(order_conflicts(baseline))
    for first, second in combinations(range(baseline.n_modes), 2):
        if baseline.setup_index[first] != baseline.setup_index[second]:
            continue
        if baseline.places[first].parity == baseline.places[second].parity:
            continue  # told already: modes of one class do not cross
        computed = baseline.log_frequency[first] - baseline.log_frequency[second]
        if computed * (readings[first] - readings[second]) < 0.0:
            words = Swap(first, second).words(baseline)
            notes.append(
                f"the readings {words} stand in the other order than these modes of the fitted plate"
                f"{_with_ratio(found, first, second)}: compare their figures again"
            )
    return tuple(notes)


def ratio_words(found: Found, index: int) -> str:
    """How much likelier the readings are under a hypothesis that exchanges two labels than as they are called."""
    gained = float(found.log_evidence[index] - found.log_evidence[0])
    times = "more than a million" if abs(gained) > np.log(1e6) else f"{np.exp(abs(gained)):.3g}"
    return f"with these labels exchanged the readings are {times} times {'likelier' if gained > 0 else 'less likely'}"


def _with_ratio(found: Found, first: int, second: int) -> str:
    for index, one in enumerate(found.ground.hypotheses):
        if one.swap is not None and {one.swap.first, one.swap.second} == {first, second}:
            return f" ({ratio_words(found, index)})"
    return ""
