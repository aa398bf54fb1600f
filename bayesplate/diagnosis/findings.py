"""diagnosis.json: verdict, errors before and after, every candidate and why it was rejected, what to measure next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bayesplate.diagnosis.constants import draw_constants
from bayesplate.diagnosis.entries import candidate_entry, relabelling_entries, rms
from bayesplate.diagnosis.folds import Nested, log_score
from bayesplate.diagnosis.null_control import NullControl, gain
from bayesplate.diagnosis.search import Found
from bayesplate.diagnosis.sensitivity import inclusion_with_width
from bayesplate.diagnosis.verdict import Answer, Verdict, answers
from bayesplate.effects import EFFECTS
from bayesplate.frequencies.laws import cents
from bayesplate.plate.material import MODULI
from bayesplate.posterior.draws import Draws
from bayesplate.results.contract import Spread, as_json
from bayesplate.results.summary import Summary

Floats = NDArray[np.float64]

FORMAT = 1
_AVERAGE_LINE = 11
_N_AVERAGED = 8000
Diagnosis = dict[str, Any]


@dataclass(frozen=True, eq=False)
class Side:
    """The model before or after: its hypothesis, its summary and its draws."""

    index: int
    summary: Summary
    draws: Draws


@dataclass(frozen=True, eq=False)
class Case:
    """Everything that the report of a diagnosis is made of.

    Attributes
    ----------
    found : Found
    verdict : Verdict
    control : NullControl
    folded : Nested or None
    before, after : Side
        The same where nothing was added.
    is_clear_of_zero : bool
        Whether every effect that was added has a size whose 95 % interval excludes zero.
    recommendation : str
    finalists : sequence of (Answer, Summary)
        Explanations that were fitted again, best first, each with the summary of its fit.
    notes : tuple of str
    """

    found: Found
    verdict: Verdict
    control: NullControl
    folded: Nested | None
    before: Side
    after: Side
    is_clear_of_zero: bool
    recommendation: str
    finalists: Sequence[tuple[Answer, Summary]] = ()
    notes: tuple[str, ...] = ()

    @property
    def claim(self) -> bool:
        """Whether "error reduced" may be said: beyond chance selection, size clear of zero, gate passed."""
        to_beat = self.control.ratio_to_beat
        if self.verdict.index == 0 or self.folded is None or to_beat is None:
            return False
        return bool(float(self.folded.ratio[0]) < to_beat and self.is_clear_of_zero)


def diagnosis(case: Case) -> Diagnosis:
    """The content of diagnosis.json.

    Parameters
    ----------
    case : Case

    Returns
    -------
    dict
    """
    found, verdict, control = case.found, case.verdict, case.control
    priors = np.array([one.prior for one in found.ground.hypotheses])
    observed = float(gain(found.log_evidence[:, None], priors)[0])
    ranked = answers(found)
    doubled = inclusion_with_width(found, 2.0)
    return {
        "format": FORMAT,
        "name": case.before.summary.name,
        "seed": case.before.summary.seed,
        "card_sha256": case.before.summary.card_sha256,
        "verdict": verdict.word,
        "claim": case.claim,
        "effects": list(verdict.effects),
        "refitted": _refitted(case),
        "reason": verdict.reason,
        "sentences": [EFFECTS[name].sentence for name in verdict.effects if name in EFFECTS],
        "declared": list(found.ground.baseline.board.effects),
        "probability_of_none": found.none,
        "probability_of_none_with_doubled_priors": doubled[""],
        "gate": {"before": found.passes(0), "after": found.passes(verdict.index)},
        "before": _errors(case, case.before),
        "after": _errors(case, case.after),
        "gain_null_percentile": control.percentile_of_gain(observed),
        "null_control": {
            "n_sets": int(control.gain.size),
            "flagged_percent": 100.0 * control.flagged,
            "nested_ratio": None if case.folded is None else float(case.folded.ratio[0]),
            "nested_ratio_to_beat": control.ratio_to_beat,
        },
        "elastic_shift": _elastic_shift(case),
        "finalists": [_finalist(answer, summary) for answer, summary in case.finalists],
        "elastic_averaged": _elastic_averaged(case),
        "answers": [{"effects": list(one.members), "probability": one.support} for one in ranked[:8]],
        "candidates": [
            candidate_entry(found, verdict, ranked, one, doubled[one.name]) for one in found.ground.candidates.values()
        ]
        + relabelling_entries(found, verdict),
        "recommendation": case.recommendation,
        "notes": list(case.notes),
    }


def _refitted(case: Case) -> list[str]:
    return list(case.found.ground.hypotheses[case.after.index].members)


def _errors(case: Case, side: Side) -> Diagnosis:
    found = case.found
    error = side.summary.error
    folded = case.folded
    nested = None
    if folded is not None:
        nested = rms(cents(folded.after[0] if side.index else folded.before[0]))
    low, high = np.quantile(side.draws.predictive.reshape(-1, found.ground.baseline.n_modes), [0.05, 0.95], axis=0)
    measured = np.concatenate([setup.measured for setup in found.ground.baseline.board.setups])
    return {
        "in_sample_rms_cents": error.in_sample_rms_cents,
        "leave_one_out_rms_cents": error.leave_one_out_rms_cents,
        "nested_leave_one_out_rms_cents": nested,
        "log_score": log_score(found.ground, side.index, found.residual) if folded is not None else None,
        "hits_90": float(np.mean((measured >= low) & (measured <= high))),
    }


def _elastic_shift(case: Case) -> Diagnosis:
    before, after = case.before.summary.elastic, case.after.summary.elastic
    return {
        name: {
            "before": before[name].mean,
            "after": after[name].mean,
            "shift_in_sd": (after[name].mean - before[name].mean) / before[name].sd,
        }
        for name in MODULI
    }


def _elastic_averaged(case: Case) -> Diagnosis:
    """The constants averaged over everything that may be the case, in the linear approximation of the search."""
    rng = np.random.default_rng([case.before.summary.seed, _AVERAGE_LINE])
    drawn = draw_constants(case.found, rng, _N_AVERAGED)
    return {name: as_json(Spread.of(drawn.values[name], "Pa")) for name in MODULI}


def _finalist(answer: Answer, summary: Summary) -> Diagnosis:
    """An explanation that was fitted again: its errors, its sizes and its constants, by the sampler."""
    return {
        "effects": list(answer.members),
        "probability": answer.support,
        "in_sample_rms_cents": summary.error.in_sample_rms_cents,
        "leave_one_out_rms_cents": summary.error.leave_one_out_rms_cents,
        "elastic": as_json(summary.elastic),
        "sizes": {
            owner: {name: as_json(sizes) for name, sizes in effects.items() if name in answer.members}
            for owner, effects in summary.effects.items()
        },
    }
