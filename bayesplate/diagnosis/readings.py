"""A reading that is simply wrong: without it the others agree with the model, and nothing else explains the misfit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.diagnosis.folds import FEWEST
from bayesplate.diagnosis.search import PASSES, SearchResult, predictive_p_value
from bayesplate.diagnosis.verdict import CLEARLY, p_words
from bayesplate.frequencies.laws import cents


@dataclass(frozen=True)
class Suspect:
    """A reading without which the others agree."""

    index: int  # among all readings
    p_value: float  # of the others
    off: float  # ln of the reading over what the others let expect
    log_weight: float  # how little the others expect it: minus the log density of the reading, given them


def suspects(found: SearchResult) -> tuple[Suspect, ...]:
    """Readings without any one of which the others agree with the model, the least expected first."""
    ground = found.ground
    if ground.baseline.n_modes < FEWEST or found.p_value(0) >= PASSES:
        return ()  # too few to tell, or all of them agree
    bare = ground.hypotheses[0]
    seen = found.seen(0)
    whole = float(bare.terms.log_evidence(seen)[0])
    errors = bare.terms.left_out(seen)[1][:, 0]
    told = []
    for index in bare.own.used:
        rows = bare.own.rows.copy()
        rows[index] = -1
        others = bare.labelled(bare.own, rows)
        p_value = float(predictive_p_value(others, bare.own, seen)[0])
        if p_value >= PASSES:
            weight = float(others.terms.log_evidence(others.seen(bare.own, seen))[0]) - whole
            told.append(Suspect(int(index), p_value, float(errors[index]), weight))
    return tuple(sorted(told, key=lambda one: -one.log_weight))


def wrong_reading(found: SearchResult) -> str:
    """Which reading to take again, if it alone spoils the fit; empty if none does, or more than one may."""
    told = suspects(found)
    if not told or (len(told) > 1 and told[0].log_weight - told[1].log_weight < np.log(CLEARLY)):
        return ""
    one, baseline = told[0], found.ground.baseline
    setup = baseline.board.setups[baseline.setup_index[one.index]]
    place = one.index - int(np.flatnonzero(baseline.setup_index == baseline.setup_index[one.index])[0])
    label, hertz = setup.labels[place], float(setup.measured[place])
    where = f" in setup {setup.name}" if len(baseline.board.setups) > 1 else ""
    return (
        f"Read {label}{where} again: without it the other readings agree with the model ({p_words(one.p_value)}). It "
        f"was read as {hertz:.6g} Hz, {abs(float(cents(np.asarray(one.off)))):.0f} cents "
        f"{'above' if one.off > 0 else 'below'} the {hertz * np.exp(-one.off):.4g} Hz that they let expect."
    )
