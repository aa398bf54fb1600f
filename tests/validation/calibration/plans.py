"""Boards with two surviving explanations: does what a plan proposes settle them, and as often as it expects?

A board is asked about two effects of the library, no effect being the third possibility. Which of the three is true,
the effect's size and the noise are drawn from the very priors of the search, and the generator, another
discretisation, makes the frequencies; boards on which not just two explanations survive, the truth among them, are
passed over. Then four things are measured, each by the generator: the plan's first proposal; one drawn at random from
all that could be measured, its modes at random too; a line of the plan's own list at random, whose modes are chosen
already; and the next three modes up. Explanations are settled where the true one is left alone: ten times as probable
as the other.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from generator import effects as planted_effects
from generator.boards import PlantedBoard, plant
from generator.designs import DESIGNS, MEDIANS, POISSON, Design
from generator.designs import Setup as Held
from generator.naming import LEAST_CORRELATION, frequencies, named
from generator.plate import solve
from generator.recipes import RECIPES
from validation.calibration.planted import drawn
from validation.trial.cells import KINDS, SENSORS, UNKNOWN
from validation.trial.shared import baseline_of_card, median_baseline, shared_law

from bayesplate.board.board import Board
from bayesplate.board.prior import load_prior
from bayesplate.board.sessions import shared_variance_share
from bayesplate.diagnosis.forms import forms
from bayesplate.diagnosis.hypotheses import PRIOR_OF_NONE, PRIOR_OF_ONE, Hypothesis
from bayesplate.diagnosis.search import SearchGround, SearchResult, prepare_search, run_search
from bayesplate.diagnosis.verdict import ALTERNATIVE_FACTOR
from bayesplate.errors import BayesplateError
from bayesplate.planning.beliefs import entropy
from bayesplate.planning.explained import search_beliefs, surviving_explanations
from bayesplate.planning.gains import EXPLANATIONS, probabilities_after
from bayesplate.planning.laws import known_mass
from bayesplate.planning.modes_read import REPEAT_SCATTER
from bayesplate.planning.proposals import BELIEFS_STREAM, FAINT_GAIN, Planner, Proposal
from bayesplate.planning.sizes_read import INSPECTIONS
from bayesplate.streams import random_stream

Record = dict[str, Any]

NOISE_CENTS = 5.0
CHOSEN = ("cantilever-6", "cantilever-6", "clamped-9")
"""Designs of the boards, in turn."""
ASKED = {
    "cantilever-6": (
        "transverse_shear", "fluid_loading", "attached_mass", "clamp_rotation", "clamp_translation", "density_gradient",
        "stiffness_gradient", "thickness_profile", "grain_angle",
    ),
    "clamped-9": (
        "transverse_shear", "fluid_loading", "attached_mass", "clamp_rotation", "clamp_translation", "support_mass",
        "grain_angle",
    ),
}  # fmt: skip
"""Effects of which a board is asked about two."""
NEXT = 3
_MOST_BOARDS = 60
_SEARCHED = 34
_NO_EFFECT = PRIOR_OF_NONE / (PRIOR_OF_NONE + PRIOR_OF_ONE)
"""Probability, as the search has it, that a board has no effect, where it may have one at most."""
WAYS = ("first", "random", "listed", "next")
CALIBRATED = ("first", "random", "listed")
"""Ways whose expected drops are compared with the realised ones."""
EDGES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.01)
"""Of bins of the expected drop, as a share of the entropy."""


@dataclass(frozen=True)
class Settings:
    """How boards are made.

    Attributes
    ----------
    base_seed : int
    """

    base_seed: int = 1


@dataclass(frozen=True, eq=False)
class Asked:
    """A board with two surviving explanations.

    Attributes
    ----------
    planted : PlantedBoard
    found : SearchResult
    true : tuple of str
        Effects that it has: one, or none.
    """

    planted: PlantedBoard
    found: SearchResult
    true: tuple[str, ...]


def simulate_one(settings: Settings, index: int) -> Record:
    """One board with two surviving explanations, and what measuring in three ways tells of them."""
    started = time.perf_counter()
    rng = np.random.default_rng(np.random.SeedSequence([settings.base_seed, 21, index]))
    record: Record = {"simulation": index}
    try:
        asked, n_boards = _asked(rng, CHOSEN[index % len(CHOSEN)])
        record |= {"boards": n_boards, "design": asked.planted.design.name, "true": list(asked.true)}
        record |= _measured(asked, rng)
    except (BayesplateError, RuntimeError, np.linalg.LinAlgError) as error:
        record |= {"error": f"{type(error).__name__}: {error}"}
    return record | {"seconds": round(time.perf_counter() - started, 2)}


def _asked(rng: np.random.Generator, design: str) -> tuple[Asked, int]:
    """Boards until two explanations survive on one, the true one among them; and how many it took."""
    for n_boards in range(1, _MOST_BOARDS + 1):
        pair = tuple(str(one) for one in rng.choice(ASKED[design], size=2, replace=False))
        true = () if rng.random() < _NO_EFFECT else (pair[int(rng.integers(2))],)
        try:
            planted = _planted(rng, design, true)
        except (RuntimeError, ValueError):
            continue
        found = run_search(_as_planted(prepare_search(baseline_of_card(planted), shared_law, pair)))
        left = surviving_explanations(found)
        if (
            len(left) == 2
            and left[0].support < ALTERNATIVE_FACTOR * left[1].support
            and true in [one.members for one in left]
        ):
            return Asked(planted, found, true), n_boards
    raise RuntimeError(f"{design}: wanted two surviving explanations, got none in {_MOST_BOARDS} boards")


def _as_planted(ground: SearchGround) -> SearchGround:
    """The search without pairs and exchanged labels, neither of which is planted."""
    kept: tuple[Hypothesis, ...] = tuple(one for one in ground.hypotheses if len(one.members) < 2 and one.swap is None)
    return replace(ground, hypotheses=kept)


def _planted(rng: np.random.Generator, design: str, true: Sequence[str]) -> PlantedBoard:
    """A board whose effect has a size drawn from the prior of the search."""
    constants = {name: float(m * np.exp(np.log(f) * rng.standard_normal())) for name, (m, f) in MEDIANS.items()}
    fixed = {name: _size(name, design, constants, rng) for name in true}
    (setup,), acting = DESIGNS[design].setups, [RECIPES[name].make(dict(values)) for name, values in fixed.items()]
    plate = DESIGNS[design].plate(setup, {**constants, "nu_xy": POISSON})
    if frequencies(plate, acting, setup.beams)[1] < LEAST_CORRELATION:
        raise RuntimeError("a label is in doubt")  # nothing is left to be drawn: it would be in doubt again
    return plant(
        rng, design, true, noise_cents=NOISE_CENTS, fixed=fixed, sensor=SENSORS[design], noise_factor=UNKNOWN,
        constants=constants, noise_is_drawn=True,
    )  # fmt: skip


def _size(effect: str, design: str, constants: Mapping[str, float], rng: np.random.Generator) -> dict[str, Any]:
    """Parameters of the generator's effect, from one draw of the prior that the search has of them."""
    board = _board(design)
    every = forms(board)[effect]
    form = every[int(rng.integers(len(every)))]
    values = {one.key: one.prior.mean for one in form.board.parameters if one.effect == effect}
    values |= {one.key: drawn(one.prior, rng) for one in form.free}
    plate = DESIGNS[design].plate(DESIGNS[design].setups[0], {**constants, "nu_xy": POISSON})
    if effect == "clamp_rotation":
        return {"stiffness": plate.D_x / (values["compliance"] * plate.L_x)}
    if effect == "clamp_translation":
        return {"stiffness": plate.D_x / (values["compliance"] * plate.L_x**3)}
    if effect == "attached_mass":
        diameter = (4.0 * values["mass"] / (np.pi * 5000.0)) ** (1.0 / 3.0)
        is_solid = KINDS[design] == "accelerometer"
        radius = diameter * (1.0 / 16.0 + 1.0 / 3.0) ** 0.5 if is_solid else 0.0
        return {"mass": values["mass"], "places": (SENSORS[design],), "rotary_radius": radius}
    return values


@cache
def _board(design: str) -> Board:
    """The board of a design as its card states it: of it only the priors of the effects are asked."""
    return median_baseline(design).board


def _measured(asked: Asked, rng: np.random.Generator) -> Record:
    """What is expected and what comes of the three ways to go on."""
    seed = int(rng.integers(2**31))
    beliefs = search_beliefs(asked.found, load_prior("weakly-informative"), random_stream(seed, BELIEFS_STREAM))
    planner = Planner(beliefs, seed, EXPLANATIONS)
    every = planner.rank_proposals(least_gain=float("-inf"))
    listed = [one for one in every if one.entry.gain.score > FAINT_GAIN]
    if not listed:
        return {"silent": True}
    chosen = {
        "first": listed[0],
        "random": _at_random(planner, every, rng),
        "listed": listed[int(rng.integers(len(listed)))],
        "next": _next_up(planner, every),
    }
    names = [list(one.members) for one in beliefs.explanations]
    record: Record = {"explanations": names, "before": [round(float(p), 5) for p in beliefs.probabilities]}
    for way in WAYS:
        one = chosen[way]
        read = _read(asked, one, rng)
        after = probabilities_after(beliefs, one.readings, read[None, :])[:, 0]
        own = float(after[[tuple(name) for name in names].index(asked.true)])
        record[way] = {
            "what": one.entry.what,
            "cost": one.entry.cost_minutes,
            "expected": round(one.entry.gain.explanations, 5),
            "error": round(one.entry.gain.explanations_error, 5),
            "realised": round(beliefs.entropy - float(entropy(after[:, None])[0]), 5),
            "true": round(own, 5),
        }
    return record


def _at_random(planner: Planner, every: Sequence[Proposal], rng: np.random.Generator) -> Proposal:
    """One of all the things that could be measured; where modes are chosen for it, others in their place."""
    one = every[int(rng.integers(len(every)))]
    if one.entry.what != "modes" or one.station_readings is None:
        return one
    return _of_modes(
        planner, one, sorted(rng.choice(one.station_readings.further.n, size=len(one.rows), replace=False).tolist())
    )


def _next_up(planner: Planner, every: Sequence[Proposal]) -> Proposal:
    """The next modes up in the session that goes on, as a proposal."""
    of_modes = [one for one in every if one.entry.what == "modes" and one.station_readings is not None]
    if not of_modes:
        raise RuntimeError("no mode is left to be read in the session that goes on")
    best = max(of_modes, key=lambda one: len(one.rows))
    assert best.station_readings is not None
    assert list(best.station_readings.rows) == sorted(best.station_readings.rows)
    return _of_modes(planner, best, list(range(min(NEXT, best.station_readings.further.n))))


def _of_modes(planner: Planner, one: Proposal, some: Sequence[int]) -> Proposal:
    """A proposal of further modes with others in their place."""
    assert one.station_readings is not None
    readings, rows = one.station_readings.further.select(some), tuple(one.station_readings.rows[i] for i in some)
    entry = replace(one.entry, gain=planner.gain(readings, one.entry.cost_minutes))
    return replace(one, entry=entry, readings=readings, rows=rows)


def _read(asked: Asked, one: Proposal, rng: np.random.Generator) -> np.ndarray:
    """What the generator's board shows: ln f (Hz) of the modes, or the sizes that are looked at."""
    what = one.entry.what
    if one.station_readings is None:
        return _looked_at(asked, one, rng)
    station, design, truth = one.station_readings.law.station, asked.planted.design, asked.planted.truth
    setup = station.setup
    beams = tuple(setup.readings[i].beams for i in one.rows)
    covered = design.setups[0].covered if not station.is_new else 0.0
    held = Held(setup.name, setup.edges, beams, covered=covered)
    acting = [RECIPES[name].make(dict(values)) for name, values in truth.effects.items() if RECIPES[name].acts(held)]
    if what == "mass":
        board = asked.found.ground.baseline.board
        place = station.places(board)[one.spot]
        acting.append(planted_effects.AttachedMass(known_mass(board), (place,)))
    exact = _solved(design, held, truth.constants, acting)
    first = truth.drawn_noise[design.setups[0].name] * np.log(2.0) / 1200.0
    if what not in ("again", "mass"):
        noise = first if what == "modes" else drawn(setup.noise, rng)
        return np.asarray(exact + noise * rng.standard_normal(len(exact)))
    before = asked.found.ground.baseline.board.setup(station.base.name)
    bare = exact if what == "again" else _solved(design, held, truth.constants, acting[:-1])
    off = np.log(before.measured) - bare
    if what == "mass":
        return np.asarray(exact + off + REPEAT_SCATTER * rng.standard_normal(len(exact)))
    share, noise = shared_variance_share(before), drawn(setup.noise, rng)
    discrepancy = share * off + (share * (1.0 - share)) ** 0.5 * first * rng.standard_normal(len(exact))
    return np.asarray(exact + discrepancy + (1.0 - share) ** 0.5 * noise * rng.standard_normal(len(exact)))


def _solved(design: Design, held: Held, constants: Mapping[str, float], acting: Sequence[Any]) -> np.ndarray:
    """ln f (Hz) of the modes that are read, by the generator."""
    plate = design.plate(held, constants)
    found = named(solve(plate, acting, _SEARCHED), plate.edges)
    if any(b not in found for b in held.beams):
        raise RuntimeError("a mode was not found on the true board")
    return np.asarray(np.log([found[b][0] for b in held.beams]))


def _looked_at(asked: Asked, one: Proposal, rng: np.random.Generator) -> np.ndarray:
    """The sizes of an effect as they are, zero where the board does not have it, with the error of the look."""
    effect = next(name for name, look in INSPECTIONS.items() if look.sentence == one.entry.sentence)
    keys = [free.key for free in asked.found.ground.candidates[effect].laws[0].form.free]
    true = asked.planted.truth.effects.get(effect, {})
    sd = INSPECTIONS[effect].sd(asked.found.ground.baseline.board)
    return np.array([float(true.get(key, 0.0)) + sd * rng.standard_normal() for key in keys])


def is_group(record: Record) -> bool:
    """Whether both survivors are effects, so that it is known that something is lacking."""
    return [] not in record["explanations"]


def settled(record: Record, way: str) -> bool:
    """Whether the true explanation is left alone."""
    true = record[way]["true"]
    return bool(true >= ALTERNATIVE_FACTOR * (1.0 - true))


def wrongly(record: Record, way: str) -> bool:
    """Whether the false explanation is left alone."""
    true = record[way]["true"]
    return bool(1.0 - true >= ALTERNATIVE_FACTOR * true)


def judged(records: Sequence[Record]) -> list[Record]:
    """Records of boards that could be asked and measured."""
    return [one for one in records if not {"error", "silent"} & set(one)]


def shares(records: Sequence[Record]) -> dict[str, float]:
    """Share of the boards that each way settles."""
    every = judged(records)
    return {way: float(np.mean([settled(one, way) for one in every])) for way in WAYS}


def foremost(records: Sequence[Record]) -> tuple[float, float]:
    """Mean probability stated of the more probable explanation, and the share of boards on which it is the true one."""
    every = judged(records)
    stated = float(np.mean([max(one["before"]) for one in every]))
    return stated, float(np.mean([one["explanations"][int(np.argmax(one["before"]))] == one["true"] for one in every]))


def calibration(records: Sequence[Record]) -> list[Record]:
    """By bins of the expected drop, as a share of the entropy: its mean, the realised one, and its standard error.

    Where nearly all doubt should go, rare misses make the mean, and a few boards may have none: the standard error is
    at least that of a share which is all or nothing.
    """
    rows = []
    for record in judged(records):
        before = np.array(record["before"])
        whole = float(-(before * np.log(before)).sum())
        rows += [(one["expected"] / whole, one["realised"] / whole) for one in (record[way] for way in CALIBRATED)]
    pairs = np.array(rows)
    table = []
    for low, high in pairwise(EDGES):
        inside = pairs[(pairs[:, 0] >= low) & (pairs[:, 0] < high)]
        if len(inside) >= 5:
            expected, realised = inside.mean(axis=0)
            mean = float(np.clip(expected, 0.0, 1.0))
            sd = max(float(inside[:, 1].std(ddof=1)), (mean * (1.0 - mean)) ** 0.5) / len(inside) ** 0.5
            table.append({"low": low, "high": high, "n": len(inside), "expected": float(expected),
                          "realised": float(realised), "sd": sd})  # fmt: skip
    return table


def is_calibrated(records: Sequence[Record]) -> bool:
    """Whether the realised drop of every bin lies within three standard errors of the expected one."""
    return all(abs(row["realised"] - row["expected"]) <= 3.0 * row["sd"] for row in calibration(records))


def limits(records: Sequence[Record]) -> dict[str, bool]:
    """What must hold."""
    found = shares(records)
    return {
        "the first proposal settles at least 20 points more of the boards than a random one": (
            found["first"] >= found["random"] + 0.20
        ),
        "and than a random line of the plan itself": found["first"] >= found["listed"] + 0.20,
        "and at least as many as the next modes up": found["first"] >= found["next"],
        "expected gains are realised within three standard errors": is_calibrated(records),
    }
