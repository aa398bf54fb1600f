"""A diagnosis as one result, typed: the fields of diagnosis.json under their names and in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from bayesplate.diagnosis.decision.verdict import Word
from bayesplate.diagnosis.evidence.hypotheses import RELABELLING
from bayesplate.results.contract import NOT_IN_JSON, Spread, as_json

FORMAT = 1

Fate = Literal["in the verdict", "below sight", "not needed", "not established", "does not fit", "less probable"]
"""What became of a candidate, in two words."""


@dataclass(frozen=True, kw_only=True)
class Errors:
    """The errors of a model; None for what these readings are too few to tell.

    Attributes
    ----------
    in_sample_rms_cents : float
        Of the modes that the fit has seen.
    leave_one_out_rms_cents : float or None
        Of each mode, predicted by a fit that has not seen it.
    nested_leave_one_out_rms_cents : float or None
        The same, the effect chosen anew without that mode.
    log_score : float or None
        Sum of the log densities of the readings, each predicted from the others.
    hits_90 : float
        Share of the readings inside their 90 % intervals.
    """

    in_sample_rms_cents: float
    leave_one_out_rms_cents: float | None
    nested_leave_one_out_rms_cents: float | None
    log_score: float | None
    hits_90: float


@dataclass(frozen=True, kw_only=True)
class Gates:
    """Prior predictive probability of a misfit as large as that of each model; None where no misfit is possible."""

    before: float | None
    after: float | None


@dataclass(frozen=True, kw_only=True)
class NullControlSummary:
    """What the same search makes of simulated readings without any effect.

    Attributes
    ----------
    n_sets : int
    flagged_percent : float
        Share of the sets in which no effect at all had a probability below one tenth.
    nested_ratio, nested_ratio_to_beat : float or None
        Nested error after over before of these readings, and what chance alone stays above in 95 of 100 sets.
    """

    n_sets: int
    flagged_percent: float
    nested_ratio: float | None
    nested_ratio_to_beat: float | None


@dataclass(frozen=True, kw_only=True)
class ElasticShift:
    """One modulus before and after, Pa, and the change in standard deviations of the first fit."""

    before: float
    after: float
    shift_in_sd: float


@dataclass(frozen=True, kw_only=True)
class Finalist:
    """An explanation that was fitted again: its errors, its constants (Pa) and its sizes, by the sampler.

    Attributes
    ----------
    effects : tuple of str
    probability : float
    in_sample_rms_cents : float
    leave_one_out_rms_cents : float or None
    elastic : dict of Spread
        By modulus.
    sizes : dict
        "board" or setup -> effect -> parameter -> Spread.
    """

    effects: tuple[str, ...]
    probability: float
    in_sample_rms_cents: float
    leave_one_out_rms_cents: float | None
    elastic: Mapping[str, Spread]
    sizes: Mapping[str, Mapping[str, Mapping[str, Spread]]]


@dataclass(frozen=True, kw_only=True)
class Explanation:
    """One way to explain the residual, an effect or a pair, with its probability."""

    effects: tuple[str, ...]
    probability: float


@dataclass(frozen=True, kw_only=True)
class Amplitude:
    """Posterior quantiles of an effect's first parameter, given that the effect is there.

    Attributes
    ----------
    parameter : str
    form : str
        Which form of the effect, empty if it has one.
    q05, q50, q95 : float
        In `unit`.
    unit : str
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
        Shift of the modes at the nominal size, and what is left of it after the constants are fitted again; None where
        there is no frequency, or nothing is left because there are as many constants as modes.
    visible_cents : tuple of (float or None)
        The same mode by mode.
    below_sight : bool
        Whether these readings could not show it even if it were there.
    bias_percent : dict of float
        What ignoring it does to each modulus.
    inclusion_probability, inclusion_probability_with_doubled_priors : float
    log_bayes_factor, ockham_log_factor : float
        Against no effect, and the part of it that the width of the prior costs.
    gate : float or None
    amplitude : Amplitude or None
        None if its size is fixed.
    look_alikes : tuple of str
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
    below_sight: bool
    bias_percent: Mapping[str, float]
    inclusion_probability: float
    inclusion_probability_with_doubled_priors: float
    log_bayes_factor: float
    ockham_log_factor: float
    gate: float | None
    amplitude: Amplitude | None
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


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """What a diagnosis found: the verdict, the errors before and after, every candidate, what to measure next.

    Attributes
    ----------
    format : int
    name : str
        Of the board.
    seed : int
    card_sha256 : str
    verdict : str
        "none needed", "named", "indistinguishable group", "unexplained" or "undetectable".
    claim : bool
        Whether it may be said that the error is reduced.
    effects : tuple of str
        Named: all of them are present. Group: each is an alternative.
    refitted : tuple of str
        What the model after holds beyond the one before.
    reason : str
    sentences : tuple of str
        What each of `effects` is.
    declared : tuple of str
        Effects that were part of the model from the beginning.
    probability_of_none, probability_of_none_with_doubled_priors : float
    gate : Gates
    before, after : Errors
        The same where nothing was added.
    gain_null_percentile : float or None
        Share of simulated boards without any effect on which the search gains less, percent; None where no readings
        are left to gain by.
    null_control : NullControlSummary
    elastic_shift : dict of ElasticShift
        By modulus.
    finalists : tuple of Finalist
        Best first.
    elastic_averaged : dict of Spread
        The moduli averaged over everything that may be the case, Pa.
    answers : tuple of Explanation
        The most probable ones, best first.
    candidates : tuple of EffectEntry and ExchangeEntry
    recommendation : str
    notes : tuple of str
    """

    format: int = FORMAT
    name: str
    seed: int
    card_sha256: str
    verdict: Word
    claim: bool
    effects: tuple[str, ...]
    refitted: tuple[str, ...]
    reason: str
    sentences: tuple[str, ...]
    declared: tuple[str, ...]
    probability_of_none: float
    probability_of_none_with_doubled_priors: float
    gate: Gates
    before: Errors
    after: Errors
    gain_null_percentile: float | None
    null_control: NullControlSummary
    elastic_shift: Mapping[str, ElasticShift]
    finalists: tuple[Finalist, ...]
    elastic_averaged: Mapping[str, Spread]
    answers: tuple[Explanation, ...]
    candidates: tuple[CandidateEntry, ...]
    recommendation: str
    notes: tuple[str, ...]

    @property
    def is_refitted(self) -> bool:
        """Whether something was added to the model, so that there is an after."""
        return bool(self.refitted)

    def __repr__(self) -> str:
        named = f": {', '.join(self.effects)}" if self.effects else ""
        claim = ", error reduced" if self.claim else ""
        return f"<Diagnosis of {self.name}, {self.verdict}{named}{claim}>"

    def _repr_html_(self) -> str:
        from bayesplate.diagnosis.wording.notebook import html

        return html(self)


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content of diagnosis.json."""
    return dict(as_json(diagnosis))
