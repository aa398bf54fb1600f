"""Readings that stand in another order than the modes they are called after: told, never mended silently."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from bayesplate.diagnosis.evidence.hypotheses import Swap
from bayesplate.diagnosis.evidence.search import Found


def order_notes(found: Found) -> tuple[str, ...]:
    """One sentence for every two readings of one setup in the other order than these modes of the fitted plate.

    Modes of one symmetry class do not cross: at a veering they exchange their figures, and a board that lacks something
    may show the figures the other way round than the ideal one that is fitted to it.
    """
    baseline = found.ground.baseline
    computed, readings = baseline.log_frequency, baseline.residual + baseline.log_frequency
    notes = []
    for first, second in combinations(range(baseline.n_modes), 2):
        is_one_setup = baseline.setup_index[first] == baseline.setup_index[second]
        if is_one_setup and (computed[first] - computed[second]) * (readings[first] - readings[second]) < 0.0:
            swap = Swap(first, second)
            exchanged = replace(found.ground.hypotheses[0], swap=swap)
            seen = exchanged.seen(baseline, found.residual[None, :])
            gained = float(exchanged.terms(found.ground.whole).log_evidence(seen)[0] - found.log_evidence[0])
            notes.append(
                f"the readings {swap.words(baseline)} stand in the other order than these modes of the fitted plate "
                f"({_ratio_words(gained)}): compare their figures again"
            )
    return tuple(notes)


def ratio_words(found: Found, index: int) -> str:
    """How much likelier the readings are under a hypothesis that exchanges two labels than as they are called."""
    return _ratio_words(float(found.log_evidence[index] - found.log_evidence[0]))


def _ratio_words(gained: float) -> str:
    times = "more than a million" if abs(gained) > np.log(1e6) else f"{np.exp(abs(gained)):.3g}"
    return f"with these labels exchanged the readings are {times} times {'likelier' if gained > 0 else 'less likely'}"
