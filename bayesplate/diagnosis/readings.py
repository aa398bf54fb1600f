"""A wrong reading: without it the other readings agree with the model, and no effect explains the misfit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bayesplate.diagnosis.folds import FEWEST_MODES
from bayesplate.diagnosis.search import LEAST_P_VALUE, SearchResult, predictive_p_value
from bayesplate.diagnosis.verdict import CLEAR_FACTOR, p_value_words
from bayesplate.frequencies.laws import cents


@dataclass(frozen=True)
class SuspectReading:
    """A reading without which the others agree with the model."""

    index: int  # among all readings
    p_value: float  # of the other readings
    offset: float  # ln of the reading over its prediction by the others
    log_weight: float  # minus the log density of the reading, given the others


def suspect_readings(result: SearchResult) -> tuple[SuspectReading, ...]:
    """Readings without which, each by itself, the others agree with the model; the least expected first."""
    ground = result.ground
    if ground.baseline.n_modes < FEWEST_MODES or result.p_value(0) >= LEAST_P_VALUE:
        return ()  # too few readings, or all of them agree
    bare_hypothesis = ground.hypotheses[0]
    residuals = result.residual_under_labels(0)
    log_evidence = float(bare_hypothesis.terms.log_evidence(residuals)[0])
    errors = bare_hypothesis.terms.left_out(residuals)[1][:, 0]
    suspects = []
    for index in bare_hypothesis.baseline.mode_readings:
        rows = bare_hypothesis.baseline.rows.copy()
        rows[index] = -1
        hypothesis_without = bare_hypothesis.labelled(bare_hypothesis.baseline, rows)
        p_value = float(predictive_p_value(hypothesis_without, bare_hypothesis.baseline, residuals)[0])
        if p_value >= LEAST_P_VALUE:
            weight = (
                float(
                    hypothesis_without.terms.log_evidence(
                        hypothesis_without.residual_under_labels(bare_hypothesis.baseline, residuals)
                    )[0]
                )
                - log_evidence
            )
            suspects.append(SuspectReading(int(index), p_value, float(errors[index]), weight))
    return tuple(sorted(suspects, key=lambda suspect: -suspect.log_weight))


def wrong_reading(result: SearchResult) -> str:
    """A sentence on the reading to take again, if it alone spoils the fit; empty if none does, or several may."""
    suspects = suspect_readings(result)
    if not suspects or (len(suspects) > 1 and suspects[0].log_weight - suspects[1].log_weight < np.log(CLEAR_FACTOR)):
        return ""
    suspect, baseline = suspects[0], result.ground.baseline
    setup = baseline.board.setups[baseline.setup_index[suspect.index]]
    position = suspect.index - int(np.flatnonzero(baseline.setup_index == baseline.setup_index[suspect.index])[0])
    label, hertz = setup.labels[position], float(setup.measured[position])
    setup_words = f" in setup {setup.name}" if len(baseline.board.setups) > 1 else ""
    return (
        f"Read {label}{setup_words} again: without it the other readings agree with the model "
        f"({p_value_words(suspect.p_value)}). It was read as {hertz:.6g} Hz, "
        f"{abs(float(cents(np.asarray(suspect.offset)))):.0f} cents "
        f"{'above' if suspect.offset > 0 else 'below'} the "
        f"{hertz * np.exp(-suspect.offset):.4g} Hz that the other modes let expect."
    )
