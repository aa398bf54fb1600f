"""Diagnoses made by hand, one of each verdict."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from bayesplate.diagnosis.claim import Condition
from bayesplate.diagnosis.known_words import KnownModel
from bayesplate.diagnosis.result import (
    Amplitude,
    Diagnosis,
    EffectEntry,
    ElasticShift,
    ExchangeEntry,
    ExplanationSummary,
    Finalist,
    Histogram,
    ModelErrors,
    NullControlSummary,
    PValues,
)
from bayesplate.diagnosis.stated import StatedClaim
from bayesplate.diagnosis.verdict import VerdictWord
from bayesplate.effects import EFFECTS
from bayesplate.results.contract import Spread

NULL_ODDS = Histogram(edges=(-6.0, -3.0, 0.0, 3.0, 6.0), counts=(200, 250, 40, 10))
NULL_RATIOS = Histogram(edges=(0.5, 0.75, 1.0, 1.25), counts=(25, 300, 175))
BEFORE = ModelErrors(
    in_sample_rms_cents=21.25,
    leave_one_out_rms_cents=46.5,
    nested_leave_one_out_rms_cents=46.5,
    log_score=-24.75,
    hits_90=0.5,
)
AFTER = ModelErrors(
    in_sample_rms_cents=4.25,
    leave_one_out_rms_cents=9.5,
    nested_leave_one_out_rms_cents=12.5,
    log_score=-15.5,
    hits_90=1.0,
)


def known_model(error: float, left_out: float | None, *effects: str, without: tuple[str, ...] = ()) -> KnownModel:
    """A board that declares a sensor, with effects of known sizes."""
    factor = 1.0 if effects or without else 0.0
    return KnownModel(
        combination=(*effects, *(() if without else ("attached_mass",))),
        effects=effects,
        without=without,
        in_sample_rms_cents=error,
        leave_one_out_rms_cents=left_out,
        n_left_out=0 if left_out is None else 6,
        n_readings=6,
        change_percent={"E_x": 1.25 * factor, "E_y": 0.0 - 2.5 * factor, "G_xy": 0.0},
    )


STATED = (
    StatedClaim(
        effects=("attached_mass",),
        predicts="",
        before_rms_cents=61.0,
        after_rms_cents=46.5,
        log_score_gain=4.5,
        standard_error=2.0,
        n_modes=6,
        holds=True,
    ),
)
KNOWN = (
    known_model(21.25, 46.5),
    known_model(9.5, 12.25, "transverse_shear"),
    known_model(42.75, 94.0, "fluid_loading"),
    known_model(38.5, 88.0, "transverse_shear", "fluid_loading"),
    known_model(30.25, 61.0, without=("attached_mass",)),
)
"""Shear lowers the error, air raises it, and the sensor is there."""
WORDS = {
    "membrane_tension": "membrane tension",
    "fluid_loading": "fluid loading",
    "relabelling": "relabelling (1,0) and (0,1)",
}
SHIFT = {
    "E_x": ElasticShift(before=10.25e9, after=11.5e9, shift_in_sd=2.5),
    "E_y": ElasticShift(before=1.0e9, after=0.75e9, shift_in_sd=-1.25),
    "G_xy": ElasticShift(before=0.5e9, after=0.5e9, shift_in_sd=0.0),
}
CONDITIONS = (
    Condition("chance selection", 0.25, 0.75, True),
    Condition("log score", 1.25, 2.5, False),
    Condition("probability of none", 0.03, 0.05, True),
    Condition("probability of another", 0.02, 0.05, True),
    Condition("prior predictive", 0.5, 0.05, True),
)
NEXT = "Weigh a second accelerometer onto the board and measure (1,0) again."


def spread(mean: float, unit: str = "Pa") -> Spread:
    """A mean with a tenth of it as standard deviation."""
    sd = 0.1 * mean
    quantiles = {f"q{p:02}": mean + z * sd for p, z in ((5, -1.5), (25, -0.75), (50, 0.0), (75, 0.75), (95, 1.5))}
    return Spread(mean=mean, sd=sd, **quantiles, unit=unit)


def candidate(name: str, setup: str = "clamped", **changed: Any) -> EffectEntry:
    """One candidate effect."""
    return EffectEntry(
        **{
            "name": name,
            "setup": setup,
            "raw_rms_cents": 45.0,
            "visible_rms_cents": 12.5,
            "visible_cents": (12.5, -12.5),
            "below_detection_limit": False,
            "bias_percent": {"E_x": 1.5, "E_y": -2.5, "G_xy": 0.5},
            "inclusion_probability": 0.25,
            "inclusion_probability_with_doubled_priors": 0.125,
            "log_bayes_factor": 1.25,
            "ockham_log_factor": -2.25,
            "p_value": 0.375,
            "learnt_bits": {"tension": 1.5},
            "amplitude": Amplitude(parameter="tension", form="", q05=10.0, q50=120.0, q95=230.0, unit="N/m"),
            "look_alikes": (),
            "rejected_because": "less probable (0.250) than something else (0.500)",
            "fate": "less probable",
        }
        | changed
    )


TENSION = candidate("membrane_tension", inclusion_probability=0.97, rejected_because=None, fate="in the verdict")
AIR = candidate(
    "fluid_loading", raw_rms_cents=60.0, visible_rms_cents=2.5, inclusion_probability=0.02, amplitude=None,
    look_alikes=("attached_mass",), rejected_because="its visible part drowns in the noise", fate="not detectable",
)  # fmt: skip
GRAIN = candidate("grain_angle", "board", visible_rms_cents=0.25, inclusion_probability=0.01)
EXCHANGE = ExchangeEntry(
    setup="clamped", labels=("(1,0)", "(0,1)"), inclusion_probability=0.03, log_bayes_factor=-1.5,
    rejected_because="exchanging the labels does not make the readings likelier", fate="less probable",
)  # fmt: skip


def diagnosis(
    word: VerdictWord, effects: tuple[str, ...] = (), claim: bool = False, after: ModelErrors | None = None
) -> Diagnosis:
    """A diagnosis with three candidate effects; with an `after`, the first of its effects was added."""
    still = {name: ElasticShift(before=one.before, after=one.before, shift_in_sd=0.0) for name, one in SHIFT.items()}
    refitted = effects[:1] if after else ()
    elastic = {name: spread(one.after) for name, one in SHIFT.items()}
    sizes = {"clamped": {name: {"tension": spread(120.0, "N/m")} for name in refitted}}
    finalist = Finalist(
        effects=refitted, forms={}, probability=0.97, in_sample_rms_cents=4.25, leave_one_out_rms_cents=9.5,
        elastic=elastic, sizes=sizes,
    )  # fmt: skip
    return Diagnosis(
        name="a-board",
        seed=1,
        card_sha256="0" * 64,
        verdict=word,
        claim=claim,
        conditions=tuple(replace(one, is_met=claim or one.is_met) for one in CONDITIONS) if after else (),
        effects=effects,
        words=" or ".join(WORDS[name] for name in effects),
        refitted=refitted,
        refitted_words=" and ".join(WORDS[name] for name in refitted),
        reason="the reason of it",
        sentences=tuple(EFFECTS[name].sentence for name in effects),
        declared=(),
        stated_claims=STATED if word == "named" else (),
        known=KNOWN if word == "named" else KNOWN[:1],
        probability_of_none=0.02,
        probability_of_none_with_halved_priors=0.02,
        probability_of_none_with_doubled_priors=0.03,
        p_value=PValues(before=0.01, after=0.5),
        before=BEFORE,
        after=after or BEFORE,
        gain_null_percentile=99.0 if after else 40.0,
        null_control=NullControlSummary(
            n_sets=500,
            flagged_percent=2.0,
            log_odds=None if word == "undetectable" else 4.5 if after else -1.0,
            log_odds_needed=3.0,
            log_odds_of_sets=NULL_ODDS,
            nested_ratio=None if word == "undetectable" else 0.25,
            nested_ratio_to_beat=0.75,
            nested_ratio_percentile=99.0,
            nested_ratio_of_sets=NULL_RATIOS,
        ),
        elastic_shift=SHIFT if after else still,
        finalists=(finalist,) if after else (),
        elastic_averaged={name: spread(one.before) for name, one in SHIFT.items()},
        rigidity_averaged={name: spread(value, "N m") for name, value in (("D_x", 30.0), ("D_y", 2.5), ("D_s", 5.0))},
        explanations=(
            ExplanationSummary(effects=("membrane_tension",), probability=0.97, words="membrane tension"),
            ExplanationSummary(effects=("fluid_loading",), probability=0.0075, words="fluid loading"),
            ExplanationSummary(effects=("grain_angle",), probability=0.0025, words="grain angle"),
        ),
        candidates=() if word == "undetectable" else (TENSION, AIR, GRAIN),
        recommendation=NEXT,
        notes=(),
    )


DIAGNOSES = {
    one.verdict: one
    for one in (
        diagnosis("none needed"),
        diagnosis("named", ("membrane_tension",), claim=True, after=AFTER),
        diagnosis("indistinguishable group", ("membrane_tension", "fluid_loading"), after=AFTER),
        diagnosis("unexplained"),
        diagnosis("undetectable"),
    )
}
"""By verdict."""
