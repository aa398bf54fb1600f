"""A diagnosis as one result, typed: the fields of diagnosis.json under their names and in their order."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from bayesplate.diagnosis.claim import Condition
from bayesplate.diagnosis.hypotheses import RELABELLING
from bayesplate.diagnosis.known_words import KnownModel
from bayesplate.diagnosis.stated import StatedClaim
from bayesplate.diagnosis.verdict import VerdictWord
from bayesplate.estimates.leave_one_out import CarryingMode
from bayesplate.results.contract import NOT_IN_JSON, Spread, as_json

FORMAT = 1


@dataclass(frozen=True, kw_only=True)
class ModelErrors:
    """The errors of a model; None for what these readings are too few to tell."""

    in_sample_rms_cents: float  # of the modes that the fit has seen
    leave_one_out_rms_cents: float | None  # of each mode, predicted by a fit that has not seen it
    nested_leave_one_out_rms_cents: float | None  # the same, the effect chosen anew without that mode
    log_score: float | None  # sum of the log densities of the readings, each predicted from the others
    hits_90: float  # share of the readings inside their 90 % intervals


@dataclass(frozen=True, kw_only=True)
class PValues:
    """Prior predictive probability of a misfit as large as that of each model; None where no misfit is possible."""

    before: float | None
    after: float | None


@dataclass(frozen=True, kw_only=True)
class Histogram:
    """Numbers of simulated sets by a value."""

    edges: tuple[float, ...]
    counts: tuple[int, ...]


@dataclass(frozen=True, kw_only=True)
class NullControlSummary:
    """What the same search makes of simulated readings without any effect."""

    n_sets: int
    flagged_percent: float  # share of the sets in which an effect would be called needed
    log_odds: float | None  # ln odds of these readings that something is lacking; None where nothing could be
    log_odds_needed: float  # those above which an effect is needed
    log_odds_of_sets: Histogram | None  # None where nothing could be lacking
    # nested error after over before of these readings; None of too few
    nested_ratio: float | None
    # what 95 of 100 sets stay above that are made to choose their most probable effect
    nested_ratio_to_beat: float | None
    nested_ratio_percentile: float | None  # share of the sets with a larger ratio than these readings, percent
    # of as many sets as were needed to tell; this, its limit and the percentile None where nothing is claimed
    nested_ratio_of_sets: Histogram | None


@dataclass(frozen=True, kw_only=True)
class ElasticShift:
    """One modulus before and after, Pa, and the change in standard deviations of the first fit."""

    before: float
    after: float
    shift_in_sd: float


@dataclass(frozen=True, kw_only=True)
class Finalist:
    """An explanation that was fitted again: its errors, its constants (Pa) and its sizes, by the sampler."""

    effects: tuple[str, ...]
    forms: Mapping[str, str]  # of effects that were tried in several: the most probable place, direction or sign
    probability: float
    in_sample_rms_cents: float
    leave_one_out_rms_cents: float | None
    elastic: Mapping[str, Spread]
    sizes: Mapping[str, Mapping[str, Mapping[str, Spread]]]  # "board" or setup -> effect -> parameter -> Spread


@dataclass(frozen=True, kw_only=True)
class ExplanationSummary:
    """One way to explain the residual, an effect, a pair or an exchange of labels, with its probability."""

    effects: tuple[str, ...]
    probability: float
    words: str = field(metadata=NOT_IN_JSON)  # as people read it
    # whether it is of known effects of which the card states one; not written to JSON
    is_stated: bool = field(default=False, metadata=NOT_IN_JSON)


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
    conditions : tuple of Condition
        What that rests on; empty where nothing was added.
    effects : tuple of str
        Named: all of them are present. Group: each is an alternative.
    words : str
        The same as people read them, with the labels of an exchange; not written to JSON.
    refitted : tuple of str
        What the model after holds beyond the one before.
    refitted_words : str
        The same as people read it; not written to JSON.
    reason : str
    sentences : tuple of str
        What each of `effects` is, which labels may have been exchanged, what comes nearest where nothing is enough,
        and stated pairs that would explain the readings.
    declared : tuple of str
        Effects that were part of the model from the beginning.
    known : tuple of KnownModel
        What physics knows, not fitted and not chosen by the search: the board as it stands first, then with its
        known effects in every combination of up to three, whether the card declares them or not.
    stated_claims : tuple of StatedClaim
        Whether it may be said that what the card states reduces the error; empty where it states no known effect.
    probability_of_none : float
    probability_of_none_with_halved_priors, probability_of_none_with_doubled_priors : float
    p_value : PValues
    before, after : ModelErrors
        The same where nothing was added.
    gain_null_percentile : float or None
        Share of simulated boards without any effect with smaller odds against no effect, percent; None where no
        readings are left to judge by, or every effect is declared.
    null_control : NullControlSummary
    elastic_shift : dict of ElasticShift
        By modulus.
    finalists : tuple of Finalist
        Best first; the one that comes nearest where none is enough.
    elastic_averaged, rigidity_averaged : dict of Spread
        The constants to quote, Pa and N m: averaged over everything that may be the case, each by its probability; if
        nothing explains the readings, those of the model named in part, or else of the first fit. The rigidities are
        not written to JSON.
    explanations : tuple of ExplanationSummary
        Best first; with the probability of none they sum to one.
    candidates : tuple of EffectEntry and ExchangeEntry
    recommendation : str
    notes : tuple of str
    named_in_part : tuple of str
        Effects that explain the readings in part, where the verdict is "unexplained" and something else remains: the
        model after has them, nothing is claimed, and the constants are not to be trusted.
    in_part_words : str
        The same as people read it; not written to JSON.
    carrying_modes : tuple of CarryingMode
        Modes that alone carry a constant or a size, before or after: they count in no leave-one-out error and no score.
    """

    format: int = FORMAT
    name: str
    seed: int
    card_sha256: str
    verdict: VerdictWord
    claim: bool
    conditions: tuple[Condition, ...]
    effects: tuple[str, ...]
    words: str = field(metadata=NOT_IN_JSON)
    refitted: tuple[str, ...]
    refitted_words: str = field(metadata=NOT_IN_JSON)
    reason: str
    sentences: tuple[str, ...]
    declared: tuple[str, ...]
    known: tuple[KnownModel, ...]
    stated_claims: tuple[StatedClaim, ...]
    probability_of_none: float
    probability_of_none_with_halved_priors: float
    probability_of_none_with_doubled_priors: float
    p_value: PValues
    before: ModelErrors
    after: ModelErrors
    gain_null_percentile: float | None
    null_control: NullControlSummary
    elastic_shift: Mapping[str, ElasticShift]
    finalists: tuple[Finalist, ...]
    elastic_averaged: Mapping[str, Spread]
    rigidity_averaged: Mapping[str, Spread] = field(metadata=NOT_IN_JSON)
    explanations: tuple[ExplanationSummary, ...]
    candidates: tuple[CandidateEntry, ...]
    recommendation: str
    notes: tuple[str, ...]
    named_in_part: tuple[str, ...] = ()
    in_part_words: str = field(default="", metadata=NOT_IN_JSON)
    carrying_modes: tuple[CarryingMode, ...] = ()

    @property
    def is_refitted(self) -> bool:
        """Whether something was added to the model, so that there is an after."""
        return bool(self.refitted)

    def __repr__(self) -> str:
        effects = f": {', '.join(self.effects)}" if self.effects else ""
        claim = ", error reduced" if self.claim else ""
        return f"<Diagnosis of {self.name}, {self.verdict}{effects}{claim}>"

    def _repr_html_(self) -> str:
        from bayesplate.diagnosis.tables import diagnosis_html

        return diagnosis_html(self)


def diagnosis_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """The content of diagnosis.json."""
    return dict(as_json(diagnosis))


Fate = Literal["in the verdict", "not detectable", "not needed", "not established", "does not fit", "less probable"]
"""What became of a candidate, in two words."""


@dataclass(frozen=True, kw_only=True)
class Amplitude:
    """Posterior quantiles of an effect's first parameter, given that it is there; all alike if the card fixes it."""

    parameter: str
    form: str  # empty if the effect has one only
    # q05, q50, q95: in `unit`
    q05: float
    q50: float
    q95: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class EffectEntry:
    """A candidate effect: what it would do, how probable it is, and why it was rejected."""

    name: str
    setup: str  # "board" for an effect of the whole board
    raw_rms_cents: float | None  # shift of the modes at the nominal size; None where there is no frequency
    # what is left of it after the constants are fitted again, both with the weights of that fit, so that it is never
    # the larger; None where nothing is left because there are as many constants as modes
    visible_rms_cents: float | None
    visible_cents: tuple[float | None, ...]  # the same mode by mode
    below_detection_limit: bool  # whether these readings could not show it even if it were there
    bias_percent: Mapping[str, float] | None  # what ignoring it does to each modulus; None where there is no frequency
    inclusion_probability: float
    inclusion_probability_with_doubled_priors: float
    log_bayes_factor: float  # against no effect
    ockham_log_factor: float  # the part of the Bayes factor that the width of the prior costs
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
