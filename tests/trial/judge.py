"""One board of the trial: planted, read from its card, searched, and everything worth counting written down.

The laws of the forms are solved once a design and process, around the board of the design's median constants, and
serve every board of the design: a full solve of all forms takes ten times as long as all the rest.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from generator.boards import PlantedBoard, plant
from generator.designs import MEDIANS
from trial.amplitudes import recovered
from trial.cells import KINDS, SENSORS, UNKNOWN, Cell

from bayesplate.diagnosis.decision.constants import ConstantDraws, draw_constants
from bayesplate.diagnosis.decision.verdict import Verdict, alternatives, answers, decide
from bayesplate.diagnosis.evidence.search import Found, Ground, prepare_search, search
from bayesplate.diagnosis.shifts.baseline import Baseline, baseline_at
from bayesplate.diagnosis.shifts.forms import Form, forms
from bayesplate.diagnosis.shifts.laws import FormLaw, form_law
from bayesplate.errors import BayesplateError
from bayesplate.estimates.least_squares import weighted_least_squares
from bayesplate.plate.material import MODULI
from bayesplate.workflow.prepare import prepare

Record = dict[str, Any]

HALF_WIDTH = 0.6
"""Of the shared laws in ln D_x / D_s and ln D_y / D_s: boards of a design spread by 0.17 and 0.18."""
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
        found = search(ground_of(planted, shared_law))
        record |= {"truth": truth_of(planted)} | findings(found, planted, rng)
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
        noise_factor=cell.noise_factor,
    )


def baseline_of_card(planted: PlantedBoard) -> Baseline:
    """Read the card and fit the ideal board, as a user would; nothing else of the planted board is looked at."""
    with tempfile.TemporaryDirectory() as folder:
        card = Path(folder, f"{planted.name}.toml")
        card.write_text(planted.card_text({"kind": f'"{KINDS[planted.design.name]}"'}))
        board = prepare(card).board
    return baseline_at(board, weighted_least_squares(board))


def ground_of(planted: PlantedBoard, law: Any = form_law) -> Ground:
    """Everything that the search needs of a board, each form by a given law."""
    return prepare_search(baseline_of_card(planted), law)


def shared_law(baseline: Baseline, form: Form) -> FormLaw:
    """The law of a form that the boards of a design share; the search finds the board's modes in it."""
    return _laws(baseline.board.title.rpartition(", ")[2])[form.title]


@cache
def _laws(design: str) -> Mapping[str, FormLaw]:
    """By the form's title, around the noiseless board of the median constants."""
    median = {name: value for name, (value, _) in MEDIANS.items()}
    rng = np.random.default_rng(0)
    board = plant(rng, design, (), noise_cents=0.0, sensor=SENSORS[design], noise_factor=UNKNOWN, constants=median)
    baseline = baseline_of_card(board)
    every = [form for each in forms(baseline.board).values() for form in each]
    return {form.title: form_law(baseline, form, HALF_WIDTH) for form in every}


def truth_of(planted: PlantedBoard) -> Record:
    """What is true of a board, as JSON."""
    truth = planted.truth
    return {
        "effects": sorted(truth.effects),
        "parameters": truth.effects,
        "size": truth.size,
        "constants": truth.constants,
        "noise_cents": truth.noise_cents,
        "draws": planted.n_draws,
    }


def findings(found: Found, planted: PlantedBoard, rng: np.random.Generator) -> Record:
    """Verdict, probabilities, gates, sizes and constants of a board."""
    verdict = decide(found)
    ranked = answers(found)
    near = alternatives(found, ranked)
    best = verdict.best
    return {
        "word": verdict.word,
        "effects": list(verdict.effects),
        "reason": verdict.reason,
        "best": list(best.members) if best else [],
        "set": [[list(answer.members), _rounded(answer.support)] for answer in near],
        "none": _rounded(found.none),
        "inclusion": {name: _rounded(found.inclusion(name)) for name in found.ground.candidates},
        "gate": {"bare": _rounded(found.p_value(0)), "best": _rounded(found.p_value(best.index)) if best else None},
        "below_sight": [name for name in found.ground.candidates if found.ground.is_below_detection_limit(name)],
        "amplitudes": recovered(found, verdict, planted) if verdict.word == "named" else {},
        "constants": _constants(found, verdict, planted.truth.constants, rng),
    }


def traced(found: Found, verdict: Verdict) -> list[int]:
    """Hypotheses that the constants after tracing are averaged over: the named one, the group's, or none."""
    if verdict.word == "named":
        return [verdict.index]
    if verdict.word == "indistinguishable group":
        return [answer.index for answer in alternatives(found, answers(found))]
    return [0]


def _constants(
    found: Found, verdict: Verdict, truth: Mapping[str, float], rng: np.random.Generator
) -> dict[str, dict[str, Any]]:
    """Intervals of 90 % and whether they hold the truth: without tracing, after it, averaged over all hypotheses."""
    ways = {"without": [0], "after": traced(found, verdict), "averaged": None}
    drawn = {way: draw_constants(found, rng, N_DRAWS, among) for way, among in ways.items()}
    return {name: {way: _interval(draws, name, truth[name]) for way, draws in drawn.items()} for name in MODULI}


def _interval(draws: ConstantDraws, name: str, truth: float) -> dict[str, Any]:
    low, high = draws.interval(name)
    return {"q05": _rounded(low), "q95": _rounded(high), "holds": bool(low <= truth <= high)}


def _rounded(value: float) -> float:
    """Six digits: more would be noise of the draws."""
    return float(f"{value:.6g}")
