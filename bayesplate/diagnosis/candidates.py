"""The candidates of a diagnosis, typed: an effect, or two labels that may have been exchanged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from bayesplate.diagnosis.hypotheses import RELABELLING
from bayesplate.results.contract import NOT_IN_JSON

Fate = Literal["in the verdict", "not detectable", "not needed", "not established", "does not fit", "less probable"]
"""What became of a candidate, in two words."""


@dataclass(frozen=True, kw_only=True)
class Amplitude:
    """Posterior quantiles of an effect's first parameter, given that it is there; all alike if the card fixes it."""

    parameter: str
    form: str  # empty if the effect has one only
    q05: float  # quantiles in `unit`
    q50: float
    q95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class EffectEntry:
    """A candidate effect: what it would do, how probable it is, and why it was rejected."""

    name: str
    setup: str  # "board" for an effect of the whole board
    raw_rms_cents: float | None  # shift of the modes at the nominal size; None where there is no frequency
    # what refitted constants leave of it, by the same weights; None where nothing is left
    visible_rms_cents: float | None
    visible_cents: tuple[float | None, ...]  # mode by mode
    below_detection_limit: bool  # these readings could not show it even if it were there
    bias_percent: Mapping[str, float]  # what ignoring it does to each modulus
    inclusion_probability: float
    inclusion_probability_with_doubled_priors: float
    log_bayes_factor: float  # against no effect
    ockham_log_factor: float  # the part of it that the width of the prior costs
    p_value: float | None
    amplitude: Amplitude | None  # None if it has no size
    learnt_bits: Mapping[str, float]  # how far the posterior of each size left its prior, by parameter
    look_alikes: tuple[str, ...]
    rejected_because: str | None  # None if it is part of the verdict
    fate: Fate = field(metadata=NOT_IN_JSON)


@dataclass(frozen=True, kw_only=True)
class ExchangeEntry:
    """Two labels that may have been exchanged, as a candidate beside the effects; fields as of `EffectEntry`."""

    name: str = RELABELLING
    setup: str
    labels: tuple[str, str]
    raw_rms_cents: None = None
    visible_rms_cents: None = None
    bias_percent: None = None
    inclusion_probability: float
    log_bayes_factor: float
    amplitude: None = None
    look_alikes: tuple[()] = ()
    rejected_because: str | None
    fate: Fate = field(metadata=NOT_IN_JSON)


CandidateEntry = EffectEntry | ExchangeEntry
