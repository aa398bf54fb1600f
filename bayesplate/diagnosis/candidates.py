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
    """Posterior quantiles of an effect's first parameter, given that it is there; all alike if the card fixes it.

    Attributes
    ----------
    form : str
        Which form of the effect, empty if it has one.
    q05, q50, q95 : float
        In `unit`.
    """

    parameter: str
    form: str
    q05: float
    q50: float
    q95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class EffectEntry:
    """A candidate effect: what it would do, how probable it is, and why it was rejected.

    Attributes
    ----------
    name, setup : str
        `setup` is "board" for an effect of the whole board.
    raw_rms_cents, visible_rms_cents : float or None
        Shift of the modes at the nominal size, and what is left of it after the constants are fitted again, both with
        the weights of that fit, so that the second is never the larger; None where there is no frequency, or nothing
        is left because there are as many constants as modes.
    visible_cents : tuple of (float or None)
        The same mode by mode.
    below_detection_limit : bool
        Whether these readings could not show it even if it were there.
    bias_percent : dict of float
        What ignoring it does to each modulus.
    log_bayes_factor, ockham_log_factor : float
        Against no effect, and the part of it that the width of the prior costs.
    amplitude : Amplitude or None
        None if it has no size.
    learnt_bits : dict of float
        How far the posterior of each of its sizes left the prior, by parameter.
    rejected_because : str or None
        None if it is part of the verdict.
    fate : str
        The same in two words; not written to JSON.
    """

    name: str
    setup: str
    raw_rms_cents: float | None
    visible_rms_cents: float | None
    visible_cents: tuple[float | None, ...]
    below_detection_limit: bool
    bias_percent: Mapping[str, float]
    inclusion_probability: float
    inclusion_probability_with_doubled_priors: float
    log_bayes_factor: float
    ockham_log_factor: float
    p_value: float | None
    amplitude: Amplitude | None
    learnt_bits: Mapping[str, float]
    look_alikes: tuple[str, ...]
    rejected_because: str | None
    fate: Fate = field(metadata=NOT_IN_JSON)


@dataclass(frozen=True, kw_only=True)
class ExchangeEntry:
    """Two labels that may have been exchanged, as a candidate beside the effects; fields as of `EffectEntry`.

    Attributes
    ----------
    labels : tuple of str
        The two.
    """

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
