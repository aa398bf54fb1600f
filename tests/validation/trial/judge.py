"""One board of the trial: planted, read from its card, searched, and everything worth counting written down.

Verdict and claim are those of `diagnose`, whose rules need no draws of the sampler.
"""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from generator.boards import PlantedBoard, plant
from validation.trial.amplitudes import recovered
from validation.trial.cells import KINDS, SENSORS, Cell
from validation.trial.shared import control_of, ground_of, shared_law

from bayesplate.board.material import MODULI
from bayesplate.diagnosis.claim import effects_named_in_part, judge_claim, nested_errors_of_board
from bayesplate.diagnosis.null_control import NullControl
from bayesplate.diagnosis.search import SearchResult, run_search
from bayesplate.diagnosis.sensitivity import ConstantDraws, draw_constants
from bayesplate.diagnosis.verdict import Verdict, alternatives, decide_verdict, rank_explanations
from bayesplate.errors import BayesplateError

Record = dict[str, Any]

N_DRAWS = 800
SOLID_DENSITY, SOLID_GYRATION = 5000.0, 1.0 / 16.0 + 1.0 / 3.0
"""kg/m3, and squared radius of gyration of a cylinder as high as wide about a diameter of its base."""


def judge_one(cell: Cell, base_seed: int, index: int) -> Record:
    """Plant, search, record.

    Parameters
    ----------
    cell : Cell
    base_seed, index : int
        With the cell they seed everything random.

    Returns
    -------
    dict
        cell, index, truth and what was found; or cell, index and error.
    """
    started = time.perf_counter()
    rng = cell.rng(base_seed, index)
    record: Record = {"cell": cell.name, "index": index}
    effects = cell.draw_effects(rng)
    try:
        planted = plant_board(rng, cell, effects)
        found = run_search(ground_of(planted, shared_law))
        record |= {"truth": truth_of(planted)} | findings(found, planted, control_of(cell.setting), rng)
    except (BayesplateError, RuntimeError, np.linalg.LinAlgError) as error:
        record |= {"truth": {"effects": list(effects)}, "error": f"{type(error).__name__}: {error}"}
    record["seconds"] = round(time.perf_counter() - started, 2)
    return dict(json.loads(json.dumps(record)))  # as it will be read from the file: lists for tuples


def plant_board(rng: np.random.Generator, cell: Cell, effects: tuple[str, ...]) -> PlantedBoard:
    """A board of a cell; an accelerometer is a cylinder as high as wide, a shaker pushes and does not turn."""
    mass = cell.size * cell.of.nominal["attached_mass"]
    is_solid = KINDS[cell.design] == "accelerometer"
    diameter = (4.0 * mass / (np.pi * SOLID_DENSITY)) ** (1.0 / 3.0)
    radius = diameter * SOLID_GYRATION**0.5 if is_solid else 0.0
    return plant(
        rng,
        cell.design,
        effects,
        cell.size,
        cell.noise_cents,
        fixed={"attached_mass": {"rotary_radius": radius}},
        sensor=SENSORS[cell.design],
        noise_factor=cell.setting.noise_factor,
        noise_is_drawn=cell.noise == "drawn",
        resolution=cell.setting.resolution,
    )


def truth_of(planted: PlantedBoard) -> Record:
    """What is true of a board, as JSON."""
    truth = planted.truth
    told: Record = {
        "effects": sorted(truth.effects),
        "parameters": truth.effects,
        "size": truth.size,
        "constants": truth.constants,
        "noise_cents": truth.noise_cents,
        "drawn_noise": truth.drawn_noise,
        "draws": planted.n_draws,
    }
    return {key: _short(value) for key, value in told.items()}


def findings(found: SearchResult, planted: PlantedBoard, control: NullControl, rng: np.random.Generator) -> Record:
    """Verdict, claim, probabilities, gates, sizes and constants of a board.

    Parameters
    ----------
    found : SearchResult
    planted : PlantedBoard
    control : NullControl
        Of the board's setting.
    rng : numpy.random.Generator
        For draws of the constants.
    """
    verdict = decide_verdict(found, control)
    folded = nested_errors_of_board(found, control, verdict.judged_index)
    claim = judge_claim(found, verdict, control.without(folded.carrying_readings if folded else ()), folded)
    ranked = rank_explanations(found)
    near = verdict.explanations or (alternatives(found, ranked) if ranked else ())
    best = verdict.best
    return {
        "word": verdict.word,
        "needed": verdict.is_needed,
        "effects": list(verdict.effects),
        "reason": verdict.reason,
        "in_part": list(effects_named_in_part(found, verdict, folded)),
        "claim": bool(claim.holds),
        "conditions": {condition.name: bool(condition.is_met) for condition in claim.conditions},
        "best": list(best.members) if best else [],
        "support": _probability(best.support) if best else 0.0,
        "set": [[list(answer.members), _probability(answer.support)] for answer in near],
        "none": _probability(found.probability_of_none),
        "gain_percentile": _rounded(control.log_odds_percentile(found.log_odds)),
        "inclusion": {name: _probability(found.inclusion(name)) for name in found.ground.candidates},
        "gate": {
            "bare": _probability(found.p_value(0)),
            "best": _probability(found.p_value(best.index)) if best else None,
        },
        "below_sight": [
            name for name, one in found.ground.candidates.items() if one.signature.is_below_detection_limit
        ],
        "amplitudes": recovered(found, verdict, planted) if verdict.word == "named" else {},
        "constants": _constants(found, verdict, planted.truth.constants, rng) if planted.truth.effects else {},
    }


def traced(found: SearchResult, verdict: Verdict) -> list[int]:
    """Hypotheses that the constants after tracing are averaged over: the named one, the group's, or none."""
    if verdict.word == "named":
        return [verdict.index]
    if verdict.word == "indistinguishable group":
        return [answer.index for answer in verdict.explanations]
    return [0]


def _constants(
    found: SearchResult, verdict: Verdict, truth: Mapping[str, float], rng: np.random.Generator
) -> dict[str, dict[str, Any]]:
    """Intervals of 90 % and whether they hold the truth: without tracing, after it, averaged over all hypotheses."""
    among = traced(found, verdict)
    drawn = {"without": draw_constants(found, rng, N_DRAWS, [0])}
    drawn["after"] = drawn["without"] if among == [0] else draw_constants(found, rng, N_DRAWS, among)
    drawn["averaged"] = draw_constants(found, rng, N_DRAWS)
    return {name: {way: _interval(draws, name, truth[name]) for way, draws in drawn.items()} for name in MODULI}


def _interval(draws: ConstantDraws, name: str, truth: float) -> dict[str, Any]:
    low, high = np.quantile(draws[name], [0.05, 0.95])
    return {"q05": _rounded(low), "q95": _rounded(high), "holds": bool(low <= truth <= high)}


def _rounded(value: float) -> float:
    """Four digits: more would be noise of the draws."""
    return float(f"{value:.4g}")


def _probability(value: float) -> float:
    """Four decimals: what is less probable is not told apart."""
    return round(float(value), 4)


def _short(value: Any) -> Any:
    """Six digits of every number of what was planted."""
    if isinstance(value, Mapping):
        return {key: _short(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_short(one) for one in value]
    return float(f"{value:.6g}") if isinstance(value, float) else value
